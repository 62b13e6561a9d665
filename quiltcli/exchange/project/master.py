"""The picture that is projected: its files, its kind, and where it looks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from quiltcli.errors import JobError, OutputError, Problem
from quiltcli.exchange.project.cameras import Asked, Found, read_camera
from quiltcli.exchange.project.lenses import (
    FACES,
    Cube,
    Equirect,
    Fisheye,
    Lens,
    Pinhole,
    axes_of,
    viewer_axes,
)
from quiltcli.exchange.project.texels import Texels, texels
from quiltcli.formats.films import FILMS, film_picture
from quiltcli.formats.pictures import read_picture
from quiltcli.geometry import Float32Array
from quiltcli.job.sequence import is_pattern, numbered
from quiltcli.viewer.view import View

KINDS = ("pinhole", "equirect", "cubemap", "fisheye")
STEREO = ("side-by-side", "top-bottom")
_FACE = "{face}"
# Column, row and half turn of each face, where a cube is unfolded, by columns and rows.
_CROSSES: Mapping[tuple[int, int], tuple[tuple[int, int, bool], ...]] = {
    (4, 3): ((2, 1, False), (0, 1, False), (1, 0, False), (1, 2, False), (1, 1, False), (3, 1, False)),
    (3, 4): ((2, 1, False), (0, 1, False), (1, 0, False), (1, 2, False), (1, 1, False), (1, 3, True)),
    (6, 1): tuple((k, 0, False) for k in range(6)),
    (1, 6): tuple((0, k, False) for k in range(6)),
}


@dataclass(frozen=True)
class Master:
    """A picture, or one a frame.

    Attributes:
        path: the file, a picture or a film; # stands for the frame number, and {face} for a name of `FACES`.
        kind: a name of `KINDS`.
        fov: of a pinhole without a camera, degrees across.
        camera: file with a pinhole's camera: JSON, glTF or USD.
        camera_name: which of the file's cameras, where it has several.
        yaw: of a panorama, cube or fisheye: which way its front looks from −Z, degrees to the left.
        aperture: of a fisheye's circle, degrees.
        tilt: of a fisheye's middle, from straight up towards its front, degrees.
        stereo: a name of `STEREO` where both eyes' pictures are halves of one, left or top first; or empty.
        colorspace: as for `read_picture`.
        fps: frames a second of the job, by which frames are moments of a film or a camera's file.
    """

    path: Path
    kind: str
    fov: float | None = None
    camera: Path | None = None
    camera_name: str = ""
    yaw: float = 0.0
    aperture: float = 180.0
    tilt: float = 0.0
    stereo: str = ""
    colorspace: str = "auto"
    fps: float = 24.0

    def check(self) -> None:
        """Raise JobError where what is said does not go together."""
        if self.kind == "pinhole" and (self.fov is None) == (self.camera is None):
            raise JobError("a pinhole needs its angle or its camera (expected --fov-deg or --camera)")
        if self.kind != "pinhole" and (self.fov is not None or self.camera is not None):
            raise JobError(f"--fov-deg and --camera are a pinhole's, not of --as {self.kind}")
        if self.camera_name and self.camera is None:
            raise JobError("--camera-name names a camera of a file (expected --camera)")
        if self.fov is not None and not 0 < self.fov < 180:
            raise JobError(f"--fov-deg must be between 0 and 180, got {self.fov:g}")
        if not 0 < self.aperture <= 360:
            raise JobError(f"--aperture-deg must be above 0 and at most 360, got {self.aperture:g}")
        if _FACE in self.path.name and self.kind != "cubemap":
            raise JobError(f"{_FACE} in a name is for --as cubemap, not for {self.kind}")

    def files(self, frame: int) -> tuple[Path, ...]:
        """The file of a frame, or the six of a cube."""
        path = numbered(self.path, frame) if is_pattern(self.path) else self.path
        if _FACE not in path.name:
            return (path,)
        return tuple(path.with_name(path.name.replace(_FACE, face)) for face in FACES)

    @property
    def is_film(self) -> bool:
        """Whether frames are pictures of one file."""
        return self.path.suffix.lower() in FILMS

    def pictures(self, frame: int, eye: str) -> list[Float32Array]:
        """What is shown in a frame for an eye: one picture (H, W, 4), or six.

        Raises:
            OutputError: a file cannot be read, or has no shape that the kind of picture has.
        """
        files = self.files(frame)
        found = [_half(self._read(path, frame), self.stereo, eye) for path in files]
        path = files[0]
        if self.kind != "cubemap":
            return found
        faces = found if len(found) > 1 else _unfolded(found[0], path)
        shapes = {face.shape for face in faces}
        if len(shapes) > 1 or len({*shapes.pop()[:2]}) > 1:
            raise OutputError(Problem("a cube's faces must be square and of one size", file=str(path)))
        return faces

    def doubt(self, size: tuple[int, int]) -> str:
        """What is odd about a picture of this size (one eye's part of it); empty where nothing is."""
        width, height = size
        # Halves may be squeezed: then a picture of both eyes is as wide and high as one of one eye.
        if self.kind != "equirect" or width == 2 * height or (self.stereo and height in (width, width // 4)):
            return ""
        both = " (is it two eyes', --stereo top-bottom?)" if width == height and not self.stereo else ""
        shape = f"the picture has {width}×{height} pixels"
        return f"{shape}, and one of all directions is twice as wide as high{both}"

    def _read(self, path: Path, frame: int) -> Float32Array:
        if self.is_film:
            return film_picture(path, (frame - 1) / self.fps, self.colorspace)
        return read_picture(path, self.colorspace)

    def camera_of(self, view: View, size: tuple[int, int]) -> Found | None:
        """The camera of a view, where there is a file of it."""
        if self.camera is None:
            return None
        return read_camera(Asked(self.camera, self.camera_name, view, self.fps, size))

    def lens(self, view: View, size: tuple[int, int]) -> Lens:
        """How a picture of this size shows directions from the eye of a view."""
        axes = axes_of(math.radians(self.yaw), 0.0)
        if self.kind == "equirect":
            return Equirect(axes, size)
        if self.kind == "cubemap":
            return Cube(axes, size[0])
        if self.kind == "fisheye":
            pitch = math.radians(90 - self.tilt)
            return Fisheye(axes_of(math.radians(self.yaw), pitch), math.radians(self.aperture), size)
        if (found := self.camera_of(view, size)) is not None:
            return found.lens
        half = math.tan(math.radians(self.fov or 0) / 2)
        high = half * size[1] / size[0]
        return Pinhole(viewer_axes(view.viewer.look, view.viewer.up), (-half, half, -high, high), size)


def loaded(master: Master, view: View) -> tuple[Lens, Texels]:
    """The picture of a view, ready to be looked up."""
    pictures = master.pictures(view.frame, view.eye)
    height, width = pictures[0].shape[:2]
    lens = master.lens(view, (width, height))
    return lens, texels(pictures, lens)


def _half(light: Float32Array, stereo: str, eye: str) -> Float32Array:
    """The part of a picture that is an eye's; the left one's, where there is one eye."""
    height, width = light.shape[:2]
    second = eye == "right"
    if stereo == "side-by-side":
        return light[:, width // 2 :] if second else light[:, : width // 2]
    if stereo == "top-bottom":
        return light[height // 2 :] if second else light[: height // 2]
    return light


def _unfolded(light: Float32Array, path: Path) -> list[Float32Array]:
    """The faces of a cube that lie in one picture."""
    height, width = light.shape[:2]
    for (columns, rows), spots in _CROSSES.items():
        if width * rows != height * columns or width % columns or height % rows:
            continue
        side = width // columns
        faces = []
        for column, row, turned in spots:
            face = light[row * side : (row + 1) * side, column * side : (column + 1) * side]
            faces.append(face[::-1, ::-1] if turned else face)
        return faces
    wrong = f"is {width}×{height} pixels, which is no cross of 4×3 or 3×4 faces and no row or column of 6"
    raise OutputError(Problem(wrong, file=str(path)))
