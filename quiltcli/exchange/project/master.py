"""The picture that is projected: its files, its kind, and where it looks."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import JobError, OutputError, Problem
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
from quiltcli.formats.inputs import read_input
from quiltcli.formats.pictures import read_picture
from quiltcli.geometry import Float32Array, FloatArray
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
        path: the file; # stands for the frame number, and {face} for a name of `FACES`.
        kind: a name of `KINDS`.
        fov: of a pinhole without a camera, degrees across.
        camera: JSON file with a pinhole's camera.
        yaw: of a panorama, cube or fisheye: which way its front looks from −Z, degrees to the left.
        aperture: of a fisheye's circle, degrees.
        tilt: of a fisheye's middle, from straight up towards its front, degrees.
        stereo: a name of `STEREO` where both eyes' pictures are halves of one, left or top first; or empty.
        colorspace: as for `read_picture`.
    """

    path: Path
    kind: str
    fov: float | None = None
    camera: Path | None = None
    yaw: float = 0.0
    aperture: float = 180.0
    tilt: float = 0.0
    stereo: str = ""
    colorspace: str = "auto"

    def check(self) -> None:
        """Raise JobError where what is said does not go together."""
        if self.kind == "pinhole" and (self.fov is None) == (self.camera is None):
            raise JobError("a pinhole needs its angle or its camera (expected --fov-deg or --camera)")
        if self.kind != "pinhole" and (self.fov is not None or self.camera is not None):
            raise JobError(f"--fov-deg and --camera are a pinhole's, not of --as {self.kind}")
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

    def pictures(self, frame: int, eye: str) -> list[Float32Array]:
        """What is shown in a frame for an eye: one picture (H, W, 4), or six.

        Raises:
            OutputError: a file cannot be read, or has no shape that the kind of picture has.
        """
        found = [_half(read_picture(path, self.colorspace), self.stereo, eye) for path in self.files(frame)]
        path = self.files(frame)[0]
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
        if self.camera is not None:
            return _camera(self.camera, view, size)
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


def _camera(path: Path, view: View, size: tuple[int, int]) -> Pinhole:
    """A camera of JSON: one of `quilt cameras`, or its record alone.

    Raises:
        JobError: there is no camera of the frame, or several, or it is none.
    """
    try:
        data: Any = json.loads(read_input(path, JobError, "a camera"))
        record = _record(data, view)
        axes: FloatArray = np.array([record[key] for key in ("right", "up", "forward")], dtype=np.float64)
        left, right, bottom, top = (float(record["window"][k]) for k in ("left", "right", "bottom", "top"))
    except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        if isinstance(error, JobError):
            raise
        words = "is no camera (expected right, up, forward and window, as quilt cameras writes them)"
        raise JobError(Problem(words, file=str(path))) from None
    good = axes.shape == (3, 3) and bool(np.abs(axes @ axes.T - np.eye(3)).max() < 1e-6)
    if not (good and left < right and bottom < top):
        words = "is no camera: its axes must be perpendicular and of length 1, its window not empty"
        raise JobError(Problem(words, file=str(path)))
    return Pinhole(axes, (left, right, bottom, top), size)


def _record(data: Any, view: View) -> Any:
    if "frames" not in data:
        return data
    frames = data["frames"]
    mine = [shot for shot in frames if shot["frame"] == view.frame and shot["eye"] in (view.eye, "center")]
    cameras = (mine or (frames if len(frames) == 1 else []) or [{"cameras": []}])[0]["cameras"]
    if len(cameras) != 1:
        raise JobError(f"--camera has {len(cameras)} cameras of frame {view.name}, expected one")
    return cameras[0]
