"""Two passes: draw the viewer's own image, then cast it on the facets (projective texture mapping).

The first pass is a picture through the virtual view plane, with as many pixels as the lit facets have;
the second looks every quilt pixel up between the picture's four nearest. Whatever it does at an edge,
a facet's pixel never sees the scene itself, only what the picture kept of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS
from quiltcli.display import lit_facets
from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.projection.camera import camera_display, viewer_frustum
from quiltcli.projection.planar import quilt_rays, viewer_rays
from quiltcli.render.buffers import Buffers, clear, new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods.raycast import pixels_of
from quiltcli.render.notices import frame_warnings
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage, stage_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.pixels import places

_AROUND = ((0, 0), (1, 0), (0, 1), (1, 1))


def draw_twice(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame in two passes; for the arguments see `frame.draw_frame`.

    Pixels outside the viewer's frustum, which opens to 120° at most, stay empty.
    """
    lit = lit_facets(stage.facets, viewer.eye) & (stage.layout.page >= 0)
    picture, size, record = draw_picture(stage, viewer, lit, threads)
    begin = time.perf_counter()
    to_picture = picture_from_eye(stage, viewer, lit, size)
    if only is not None:
        lit &= only
    clear(stage, buffers, only)
    visible = outside = 0
    rays = viewer_rays(stage.layout, stage.facets, lit, viewer)
    for address in pixels_of(stage, rays.lit):
        pixels = places(address, stage.layout, stage.owners, rays)
        place = _projected(to_picture, pixels.directions())
        on = np.isfinite(place[0]) & (place >= 0).all(axis=0) & (place[0] < size[0]) & (place[1] < size[1])
        mine = np.flatnonzero(on)
        outside += int(np.count_nonzero(~on & ~pixels.bleed))
        look_up(buffers, picture, size, address[mine], place[:, mine], pixels.facet[mine] + 1)
        nearest = _address(np.floor(place[:, mine]).astype(np.int64), size)
        seen = np.isfinite(picture["Z"][nearest])
        visible += int(np.count_nonzero(seen & ~pixels.bleed[mine]))
    warnings = list(frame_warnings(stage, viewer, lit, record.pairs, visible))
    if outside:
        share = 100 * outside / np.count_nonzero(np.append(False, rays.lit)[np.maximum(stage.owners, 0)])
        warnings.append(
            f"{share:.1f} % of the lit pixels lie outside the picture of the first pass and stay empty"
        )
    return replace(
        record,
        binned=False,
        warnings=tuple(warnings),
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds={**record.seconds, "resample": time.perf_counter() - begin},
    )


def draw_picture(
    stage: Stage, viewer: Viewer, lit: BoolArray, threads: int
) -> tuple[Buffers, tuple[int, int], FrameRecord]:
    """The viewer's own image: its buffers, its width and height, and what drawing it took."""
    size, fov = picture_size(stage, viewer, lit)
    job = stage.job
    channels = tuple(dict.fromkeys((*job.output.channels, "Z")))
    job = job.model_copy(
        update={
            "render": job.render.model_copy(update={"method": "homography"}),
            "output": job.output.model_copy(update={"channels": channels}),
        }
    )
    camera = stage_of(job, *camera_display(viewer, *size, fov), stage.scene, bleed=0)
    buffers = new_buffers(camera)
    return buffers, size, draw_frame(camera, viewer, buffers, threads)


def picture_size(stage: Stage, viewer: Viewer, lit: BoolArray) -> tuple[tuple[int, int], float]:
    """Width and height of a picture of as many pixels as lit facets have; its degrees from top to bottom."""
    wide, high = viewer_frustum(viewer, stage.facets, lit)
    shown = np.concatenate(([False], lit))[np.maximum(stage.owners, 0)]
    pixels = max(int(np.count_nonzero(shown)), 1)
    height = max(round(math.sqrt(pixels * high / wide)), 1)
    return (max(round(height * wide / high), 1), height), math.degrees(2 * math.atan(high))


def picture_from_eye(stage: Stage, viewer: Viewer, lit: BoolArray, size: tuple[int, int]) -> FloatArray:
    """The map (3, 3) from directions to homogeneous pixels of the picture."""
    _, fov = picture_size(stage, viewer, lit)
    _, layout = camera_display(viewer, *size, fov)
    return np.asarray(quilt_rays(layout, np.ones(1, dtype=np.bool_), viewer.eye).quilt_from_eye[0])


def _projected(to_picture: FloatArray, directions: FloatArray) -> FloatArray:
    """Picture pixels (2, P) of directions (P, 3), not a number behind the eye."""
    x, y, w = to_picture @ directions.T
    w = np.where(w > 0, w, np.nan)
    return np.stack((x / w, y / w))


def look_up(
    buffers: Buffers,
    picture: Buffers,
    size: tuple[int, int],
    address: IntArray,
    place: FloatArray,
    facet: IntArray,
) -> None:
    """Write what the picture shows at places (2, P) to the quilt pixels at `address` (P,).

    Values go between the four pixels around, of which those that see nothing count only for colour;
    numbers of objects and triangles are those of the nearest pixel, the facet is the quilt's own.
    """
    nearest = _address(np.floor(place).astype(np.int64), size)
    seen = np.isfinite(picture["Z"])
    corners = list(_corners(place, size))
    solid = [(at, weight * seen[at]) for at, weight in corners]
    for name in buffers:
        if name == "facet":
            buffers[name][address] = np.where(seen[nearest], facet, 0)
        elif buffers[name].dtype.kind == "u":
            buffers[name][address] = picture[name][nearest]
        elif name in CHANNELS["rgba"].layers:
            buffers[name][address] = _mean(picture[name], corners)
        else:
            values = _mean(picture[name], solid)
            buffers[name][address] = np.where(seen[nearest], values, picture[name][nearest])


def _mean(values: NDArray[np.floating], corners: list[tuple[IntArray, FloatArray]]) -> FloatArray:
    """Weighted means (P,) of a picture's values; weights of 0 leave a value out whatever it is."""
    total = sum(weight for _, weight in corners)
    parts = [np.where(weight > 0, values[at].astype(np.float64), 0.0) * weight for at, weight in corners]
    result: FloatArray = np.sum(parts, axis=0) / np.maximum(total, 1e-30)
    return result


def _corners(place: FloatArray, size: tuple[int, int]) -> Iterator[tuple[IntArray, FloatArray]]:
    """Addresses and weights (P,) of the four pixels around places (2, P); the border repeats."""
    corner = np.floor(place - 0.5)
    share = place - 0.5 - corner
    for dx, dy in _AROUND:
        at = np.clip(corner + [[dx], [dy]], 0, [[size[0] - 1], [size[1] - 1]]).astype(np.int64)
        yield _address(at, size), (share[0] if dx else 1 - share[0]) * (share[1] if dy else 1 - share[1])


def _address(pixel: IntArray, size: tuple[int, int]) -> IntArray:
    """Addresses (P,) of picture pixels (2, P)."""
    result: IntArray = pixel[1] * size[0] + pixel[0]
    return result
