"""Pictures of what an eye sees of the display, held against direct pictures of the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from quiltcli.analysis.ring.content import centres, content_lines, light_along
from quiltcli.analysis.ring.eye import Camera, Image, Seen, best_angle, camera_at, look
from quiltcli.analysis.simulate.compare import Comparison, compare
from quiltcli.errors import JobError
from quiltcli.formats.bitplanes import PLANES, packed_name, read_packed, unpack
from quiltcli.geometry import Float32Array, FloatArray, normalized
from quiltcli.halftone import Sequel, halftone
from quiltcli.halftone.light import luminance
from quiltcli.job import JobFile
from quiltcli.render.ring.setup import RingStage, set_ring_stage
from quiltcli.render.ring.turn import number_of
from quiltcli.ring.cast import Lines, Target, aim_at
from quiltcli.ring.outline import lit_pixels
from quiltcli.ring.picture import Picture, Show, draw_picture
from quiltcli.ring.plane import pixels_of
from quiltcli.ring.seen import slices_seen
from quiltcli.ring.tones import tones_of

_COVERED = 0.5


@dataclass(frozen=True)
class EyeOptions:
    """How to look.

    Attributes:
        eye: azimuth in degrees, height and distance in metres; None for the ring at 0°.
        size: width and height of the picture, pixels.
        content: what the pictures show: `mcop`, which is what a render draws, `perspective` or `diffuse`.
        tones: tones, not bits.
        slices: paint alternate positions dark and bright instead, to see where they lie.
        aperture: width and height of the camera's opening, metres; a point when None.
        focus: distance at which a camera with an opening is sharp; the axis when None, metres.
        sub: mirror angles within the exposure of each picture.
        photometric: leave gaps between positions dark.
        folder: output folder where packed pictures are, instead of the job's.
    """

    eye: tuple[float, float, float] | None = None
    size: tuple[int, int] = (512, 512)
    content: str = "mcop"
    tones: bool = False
    slices: bool = False
    aperture: tuple[float, float] | None = None
    focus: float | None = None
    sub: int = 1
    photometric: bool = False
    folder: Path | None = None


@dataclass(frozen=True)
class EyePicture:
    """What was seen.

    Attributes:
        frame: frame number.
        picture: (H, W, 3) linear light.
        direct: (H, W, 3) the scene without a display, as bright as the display shows it.
        positions: how many mirror positions light some of the picture.
        expected: how many should by the closed form.
        mixed: mean number of positions that are mixed in a pixel.
        error: largest and root mean square distance of the rays that are shown from those looked along, where
            these meet the scene, metres.
        comparison: with the direct picture, where the mirror is seen; None where there is none.
    """

    frame: int
    picture: Float32Array
    direct: Float32Array
    positions: int
    expected: float
    mixed: float
    error: tuple[float, float]
    comparison: Comparison | None


def default_eyes(stage: RingStage, frame: int) -> list[tuple[float, float, float]]:
    """The ring at 0°, and every user of a frame: azimuth in degrees, height, distance."""
    curve = stage.show(frame).curve
    found = [(0.0, float(h), float(d)) for d, h in [np.array(curve.at(np.zeros(1)))[:, 0]]]
    return found + [(math.degrees(user.azimuth), user.height, user.distance) for user in curve.users]


def eye_place(eye: tuple[float, float, float]) -> FloatArray:
    """World place (3,) of an eye at an azimuth in degrees, a height and a distance."""
    turn = math.radians(eye[0])
    return np.array([eye[2] * math.cos(turn), eye[1], eye[2] * math.sin(turn)])


def seen_light(stage: RingStage, frame: int, eyes: Iterable[EyeOptions]) -> Iterator[Float32Array]:
    """What eyes see of a frame's turn, (H, W, 3) linear light each, and nothing beside it."""
    show = stage.show(frame)
    target = aim_at(show.mesh)
    kept: dict[tuple[str, bool, bool], dict[tuple[int, int], Image]] = {}
    for options in eyes:
        assert options.eye is not None
        camera = camera_at(eye_place(options.eye), stage.rig.radius * 1.1, options.size)
        shown = kept.setdefault((options.content, options.tones, options.slices), {})
        seen = _seen(stage, show, target, frame, camera, options, shown)
        yield np.broadcast_to(seen.light, (*seen.light.shape[:2], 3)).astype(np.float32)


def look_at_display(job: JobFile, frame: int, options: EyeOptions) -> EyePicture:
    """Light the display with a frame's pictures and look at it.

    Bits are those that a render has left, where it has; tones, and what is not there, are drawn in memory.

    Raises:
        QuiltError: something is wrong with the job, or an eye cannot be there.
    """
    stage = set_ring_stage(job, [frame])
    show = stage.show(frame)
    chosen = options.eye or default_eyes(stage, frame)[0]
    if not chosen[2] > stage.rig.radius or chosen[1] <= -chosen[2]:
        raise JobError(
            f"--eye: nothing is seen from {chosen[1]:g} m high, {chosen[2]:g} m from the axis"
            " (expected a place outside of the mirror, above its plane)"
        )
    camera = camera_at(eye_place(chosen), stage.rig.radius * 1.1, options.size)
    target = aim_at(show.mesh)
    kept: dict[tuple[int, int], Image] = {}
    seen = _through_aperture(
        camera, options, lambda lens: _seen(stage, show, target, frame, lens, options, kept)
    )
    direct = _direct(stage, show, target, camera, options)
    covered = (seen.weight > _COVERED) & np.isfinite(seen.light).all(axis=-1)
    picture = np.broadcast_to(seen.light, (*seen.light.shape[:2], 3)).astype(np.float32)
    comparison = None
    if not options.slices and covered.any():
        comparison = compare(picture, direct, covered, np.zeros_like(covered))
    return EyePicture(
        frame=frame,
        picture=picture,
        direct=direct,
        positions=len(seen.positions),
        expected=slices_seen(stage.rig, chosen[2]),
        mixed=float(seen.images[seen.images > 0].mean()) if seen.images.any() else 0.0,
        error=ray_errors(stage, show, camera, options.content),
        comparison=comparison,
    )


def _through_aperture(camera: Camera, options: EyeOptions, seen_by: Callable[[Camera], Seen]) -> Seen:
    """The mean of what is seen from places all over an opening."""
    if options.aperture is None:
        return seen_by(camera)
    places = list(_opening(options.aperture))
    focus = options.focus or float(np.sqrt(camera.eye @ camera.eye))
    all_seen = [
        seen_by(camera.sheared(camera.eye + u * camera.right + v * camera.up, focus)) for u, v in places
    ]
    weight = sum((seen.weight for seen in all_seen), np.zeros_like(all_seen[0].weight))
    total = sum((seen.light * seen.weight[..., None] for seen in all_seen), np.zeros(1))
    light = np.divide(total, weight[..., None], out=np.zeros_like(total), where=weight[..., None] > 0)
    return replace(all_seen[len(all_seen) // 2], light=light, weight=weight / len(places))


def _opening(size: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Places in an opening; along a side of no length there is one."""
    counts = [9 if length > 0 else 1 for length in size]
    for i in range(counts[0]):
        for j in range(counts[1]):
            yield ((i + 0.5) / counts[0] - 0.5) * size[0], ((j + 0.5) / counts[1] - 0.5) * size[1]


def _seen(
    stage: RingStage,
    show: Show,
    target: Target,
    frame: int,
    camera: Camera,
    options: EyeOptions,
    kept: dict[tuple[int, int], Image],
) -> Seen:
    """What one place of an opening sees; `kept` has what was drawn for others."""

    def image_of(position: int, side: int) -> Image:
        if (position, side) not in kept:
            kept[position, side] = _image(stage, show, target, frame, position, side, options)
        return kept[position, side]

    bits = not options.tones and options.content == "mcop" and not options.slices
    return look(stage.rig, camera, image_of, sub=options.sub, photometric=options.photometric, nearest=bits)


def _image(
    stage: RingStage,
    show: Show,
    target: Target,
    frame: int,
    position: int,
    side: int,
    options: EyeOptions,
) -> Image:
    """What a side shows at a position, in its filter's colour."""
    rig = stage.rig
    angle = rig.angle(position)
    lit = lit_pixels(rig, rig.at(angle, side))
    tint = np.array(rig.sides[side].filter)
    if options.slices:
        return Image(np.full((*lit.shape, 3), float(position % 2)), lit)
    if options.content != "mcop":
        lines = content_lines(options.content, rig.at(angle, side), show.curve, *centres(rig.size))
        rgb = np.zeros((lit.size, 3), dtype=np.float32)
        inside = np.flatnonzero(lit)
        rgb[inside] = light_along(show, target, Lines(lines.eye[inside], lines.along[inside]))
        tone = rgb if len(rig.streams) > 1 else luminance(rgb)[:, None]
        tone = tone.reshape(*lit.shape, -1) * np.float32(stage.halftone.exposure)
        return Image(np.clip(tone, 0, 1) * tint, lit)
    bits = None if options.tones else bits_on_disk(stage, frame, position, options.folder)
    if bits is None:
        sides = range(len(rig.sides))
        pictures: list[Picture] = [draw_picture(show, angle, one) for one in sides]
        tones = tones_of(rig, pictures, stage.halftone, stage.shortest)
        bits = tones.values.astype(np.float32)
        if not options.tones:
            sequel = Sequel([position], float(np.degrees(rig.step)))
            bits = np.concatenate(
                [halftone(one[None], tones.inside, stage.halftone, sequel) for one in tones.values]
            )
    return Image(np.moveaxis(bits, 0, -1) * tint, lit)


def bits_on_disk(
    stage: RingStage, frame: int, position: int, folder: Path | None = None
) -> np.ndarray | None:
    """The pictures of one bit (C, H, W), by stream, that a render has left; None where one is missing."""
    number = number_of(stage, stage.job.frames.index(frame), position // PLANES)
    packed = (folder or stage.job.output.directory) / "packed"
    paths = [packed / packed_name(number, stream) for stream in stage.rig.streams]
    if not all(path.is_file() for path in paths):
        return None
    packing = stage.display.packing
    planes = (unpack(read_packed(path)[None], packing.order, packing.bits) for path in paths)
    return np.stack([plane[position % PLANES] for plane in planes])


def _direct(
    stage: RingStage, show: Show, target: Target, camera: Camera, options: EyeOptions
) -> Float32Array:
    """The scene from a camera, as the display shows colours."""
    shape = camera.along.shape[:2]
    along = camera.along.reshape(-1, 3)
    rgb = light_along(show, target, Lines(np.broadcast_to(camera.eye, along.shape), along))
    filters = np.array([side.filter for side in stage.rig.sides])
    exposure = np.float32(stage.halftone.exposure)
    if (filters == filters[0]).all() and len(stage.rig.streams) == 1:
        grey = np.clip(luminance(rgb) * exposure, 0, 1)
        return np.asarray((grey[:, None] * filters[0]).reshape(*shape, 3), dtype=np.float32)
    return np.asarray(np.clip(rgb * exposure, 0, 1).reshape(*shape, 3), dtype=np.float32)


def ray_errors(stage: RingStage, show: Show, camera: Camera, content: str) -> tuple[float, float]:
    """Largest and root mean square distance of what is shown from what is looked at, metres.

    For rays of the camera through points of the scene's middle, at the mirror angle that serves each best:
    how far the ray that is shown there passes by the point. It needs no picture.
    """
    rng = np.random.default_rng(19)
    points = rng.uniform(-0.5, 0.5, (60, 3)) * stage.rig.radius
    along = normalized(points - camera.eye)
    angles = best_angle(stage.rig, camera.eye, along)
    missed = np.empty(len(points))
    for k, angle in enumerate(angles):
        pose = stage.rig.at(float(angle) - stage.rig.sides[0].azimuth)
        eye, ray = pose.from_world(camera.eye), pose.axes @ along[k]
        slope = pose.slope
        away = pose.lift - (eye[0] * slope[0] + eye[2] * slope[2])
        mirror = eye + away / (ray[0] * slope[0] + ray[2] * slope[2]) * ray
        x, y = pixels_of(pose, mirror[:, None])
        shown = content_lines(content, pose, show.curve, x, y)
        offset = points[k] - shown.eye[0]
        missed[k] = np.linalg.norm(offset - (offset @ shown.along[0]) * shown.along[0])
    return float(missed.max()), float(np.sqrt((missed**2).mean()))


def told(found: EyePicture, who: str) -> Iterator[str]:
    """Lines for a user."""
    yield f"{'frame':<24}{found.frame}, {who}"
    yield f"{'mirror positions':<24}{found.positions} seen, {found.expected:.1f} by the closed form"
    yield f"{'mixed in a pixel':<24}{found.mixed:.2f} of them"
    worst, usual = (1000 * value for value in found.error)
    yield f"{'rays off by':<24}{usual:.4f} mm rms, {worst:.4f} mm at most"
    if found.comparison is not None:
        psnr, flip = found.comparison.psnr, found.comparison.flip
        yield f"{'against a direct picture':<25}{psnr:.1f} dB, ꟻLIP {flip:.4f}"


__all__ = ["EyeOptions", "EyePicture", "default_eyes", "look_at_display", "ray_errors", "seen_light", "told"]
