"""A light field of any scene: pictures from a ring of places around it, as a turntable would take them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.simulate.picture import camera_stage, exact, with_channels
from quiltcli.errors import JobError, OutputError, Problem, ViewerError, first_of, raise_all
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.geometry import FloatArray
from quiltcli.images.preview import write_png
from quiltcli.job import JobFile, OutputSpec, RenderSpec, dump_yaml, file_kind, load_job, load_scene_file
from quiltcli.job.lightfield import CameraSpec
from quiltcli.job.model import MESHES
from quiltcli.lightfield.cameras import ring_row
from quiltcli.projection.camera import camera_display
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import texture_limits
from quiltcli.scene import Scene
from quiltcli.scene.motion import load_moving_scene
from quiltcli.scene.source import SceneSource
from quiltcli.scene.textures.pool import TextureStore
from quiltcli.viewer.viewer import Viewer

NAME = "lightfield.yaml"
FORMATS = ("png", "exr")
_MARGIN = 1.05
_MOST = 12
_MOST_ROWS = 10_000


@dataclass(frozen=True)
class Ring:
    """Where pictures are taken from, and how.

    Attributes:
        views: pictures a turn.
        distance: of the cameras from the axis, metres.
        heights: of the rows, from the lowest, metres.
        size: width and height of a picture, pixels.
        look_at: what all cameras look at.
        fov: degrees from a picture's top to its bottom; as much as the scene takes when None.
        image_format: `png`, by the curve of sRGB and cut at white, or `exr`.
        depths: write depth maps, too.
        frames: of the job; the first one when empty.
    """

    views: int = 288
    distance: float = 1.0
    heights: tuple[float, ...] = (0.0,)
    size: tuple[int, int] = (512, 512)
    look_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fov: float | None = None
    image_format: str = "png"
    depths: bool = False
    frames: tuple[int, ...] = ()


def parse_heights(text: str) -> tuple[float, ...]:
    """Heights as a list, `0,0.1,0.2`, or from, to and step, `0:0.3:0.1`.

    Raises:
        JobError: the text is neither.
    """
    words = f"expected heights such as 0,0.1,0.2 or from, to and step, 0:0.3:0.1, got {text!r}"
    try:
        numbers = [float(part) for part in text.split(":" if ":" in text else ",")]
    except ValueError:
        raise JobError(words) from None
    if not all(map(math.isfinite, numbers)):
        raise JobError(words)
    if ":" not in text:
        return tuple(numbers)
    if len(numbers) != 3 or numbers[2] <= 0 or numbers[1] < numbers[0]:
        raise JobError(words)
    first, last, step = numbers
    count = math.floor((last - first) / step + 1e-9) + 1
    if count > _MOST_ROWS:
        raise JobError(f"{text!r} are {count} rows of cameras (expected at most {_MOST_ROWS})")
    return tuple(round(first + step * k, 12) for k in range(count))


def capture(
    path: Path,
    out: Path,
    ring: Ring,
    *,
    overwrite: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> Path:
    """Take the pictures of a light field and write its file, `out`/lightfield.yaml.

    Args:
        path: a job, a scene or a mesh.
        out: folder, made if need be.
        ring: where from.
        overwrite: replace files that exist.
        say: told after every row.

    Returns:
        The light field file.

    Raises:
        QuiltError: bad input, cameras that are inside the scene, or files that are in the way.
    """
    raise_all(JobError, _wrong(ring))
    job, scene, source = _stage(path)
    frames = ring.frames or job.frames[:1]
    pictures = list(_pictures(ring, frames, out))
    files = [out / NAME, *(file for picture in pictures for file in picture.files)]
    if not overwrite and (taken := [file for file in files if file.exists()]):
        wanted = "exists already, expected to be told to overwrite it"
        raise OutputError(first_of([Problem(wanted, str(file)) for file in taken], _MOST, str(out)))
    radius = _radius(scene, ring)
    fov = ring.fov or _fov(path, ring, radius)
    channels = ("rgba", "Z") if ring.depths else ("rgba",)
    job = with_channels(exact(job), channels)
    for picture in pictures:
        now = source.scene_at(picture.frame) if source is not None else scene
        viewer = picture.viewer(ring, radius)
        _write(picture, ring, _drawn(job, now, viewer, ring, fov))
        if picture.view == ring.views - 1:
            say(f"row {picture.row + 1} of {len(ring.heights)}, frame {picture.frame}: {ring.views} views")
    write_text(out / NAME, dump_yaml(_file(ring, fov, len(frames) > 1)))
    return out / NAME


@dataclass(frozen=True)
class _Picture:
    """One picture to be taken: row and view from 0, frame, and the files it becomes."""

    row: int
    view: int
    frame: int
    position: FloatArray
    rotation: FloatArray
    files: tuple[Path, ...]

    def viewer(self, ring: Ring, radius: float) -> Viewer:
        """The camera as a viewer."""
        away = float(np.linalg.norm(self.position - np.array(ring.look_at)))
        far = away + 4 * radius + ring.distance
        up = -self.rotation[1]
        return Viewer(self.frame, self.position, self.rotation[2], up, 1e-4 * away, far, "planar")


def _pictures(ring: Ring, frames: Sequence[int], out: Path) -> Iterator[_Picture]:
    azimuth = 2 * np.pi * np.arange(ring.views) / ring.views
    camera = CameraSpec(focal=(1.0, 1.0), size=ring.size, look_at=ring.look_at)
    patterns = _patterns(ring, len(frames) > 1)
    for frame in frames:
        for r, height in enumerate(ring.heights):
            row = ring_row(camera, height, ring.distance, azimuth, range(ring.views))
            for view in range(ring.views):
                names = (name.format(row=r + 1, view=view + 1, frame=frame) for name in patterns)
                files = tuple(out / name for name in names)
                yield _Picture(r, view, frame, row.position[view], row.rotation[view], files)


def _patterns(ring: Ring, several: bool) -> tuple[str, ...]:
    """Patterns of the names of pictures and, if they are wanted, of depth maps."""
    folder = "h{row:02}/" if len(ring.heights) > 1 else ""
    number = "{view:04}.{frame:04}" if several else "{view:04}"
    picture = f"{folder}v{number}.{ring.image_format}"
    return (picture, f"{folder}z{number}.exr") if ring.depths else (picture,)


def _file(ring: Ring, fov: float, several: bool) -> dict[str, Any]:
    """What the light field file says."""
    focal = ring.size[1] / 2 / math.tan(math.radians(fov) / 2)
    patterns = _patterns(ring, several)
    data: dict[str, Any] = {"quilt_lightfield": 1, "images": patterns[0]}
    if ring.depths:
        data["depths"] = patterns[1]
    return {
        **data,
        "views": ring.views,
        "camera_turns": "clockwise",
        "first_deg": 0,
        "distance": ring.distance,
        "heights": list(ring.heights),
        "camera": {"focal": [focal, focal], "size": list(ring.size), "look_at": list(ring.look_at)},
        "encoding": "srgb" if ring.image_format == "png" else "linear",
        "focus": "depth" if ring.depths else "mirror",
    }


def _drawn(job: JobFile, scene: Scene, viewer: Viewer, ring: Ring, fov: float) -> Buffers:
    stage = camera_stage(job, camera_display(viewer, *ring.size, fov), scene)
    buffers = new_buffers(stage)
    draw_frame(stage, viewer, buffers, default_threads())
    return buffers


def _write(picture: _Picture, ring: Ring, buffers: Buffers) -> None:
    width, height = ring.size
    image = {name: buffers[name].reshape(height, width) for name in "RGB"}
    make_folder(picture.files[0].parent)
    if ring.image_format == "exr":
        write_exr(picture.files[0], image, {})
    else:
        write_png(picture.files[0], np.stack([image[name] for name in "RGB"], axis=-1), "srgb")
    if ring.depths:
        write_exr(picture.files[1], {"Z": buffers["Z"].reshape(height, width)}, {})


def _stage(path: Path) -> tuple[JobFile, Scene, SceneSource | None]:
    """The job, and its scene with what gives that of each frame; of a scene alone a job of one frame."""
    if path.suffix.lower() in MESHES or file_kind(path) != JobFile.kind:
        spec = load_scene_file(path)
        job = JobFile.model_construct(
            display=path, scene=path, frames=(1,), render=RenderSpec(), output=OutputSpec()
        )
        return job, *load_moving_scene(spec, 30.0, TextureStore(texture_limits(job)))
    job = load_job(path)
    store = TextureStore(texture_limits(job))
    return job, *load_moving_scene(load_scene_file(job.scene), float(job.fps), store)


def _radius(scene: Scene, ring: Ring) -> float:
    """How far the scene reaches from what is looked at, metres."""
    return float(np.linalg.norm(scene.vertices - np.array(ring.look_at), axis=1).max())


def _fov(path: Path, ring: Ring, radius: float) -> float:
    """Degrees that show a ball of this radius from the nearest camera, up and down and across."""
    x, y, z = ring.look_at
    nearest = min(math.hypot(ring.distance, height - y) for height in ring.heights) - math.hypot(x, z)
    if radius >= nearest:
        words = f"reaches {radius:.3g} m from {list(ring.look_at)}, to the cameras (move them, or give a fov)"
        raise ViewerError(Problem(words, str(path)))
    reach = _MARGIN * math.tan(math.asin(radius / nearest))
    width, height = ring.size
    return math.degrees(2 * math.atan(reach * height / min(width, height)))


def _wrong(ring: Ring) -> Iterator[Problem]:
    if ring.views < 1:
        yield Problem(f"expected at least 1 view, got {ring.views}")
    if not 0 < ring.distance < math.inf:
        yield Problem(f"expected a distance greater than 0, got {ring.distance:g}")
    if list(ring.heights) != sorted(set(ring.heights)):
        yield Problem(f"expected heights from low to high, got {', '.join(f'{h:g}' for h in ring.heights)}")
    if ring.fov is not None and not 0 < ring.fov < 170:
        yield Problem(f"expected a field of view from 0 to 170 degrees, got {ring.fov:g}")
    if ring.image_format not in FORMATS:
        yield Problem(f"expected {' or '.join(FORMATS)} as format, got {ring.image_format!r}")
