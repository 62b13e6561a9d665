"""A cube map: draw six pictures all around the eye, then look every pixel up in them (image-based).

What planetarium and panorama programs do, to compare with: six faces of `render.faces` pixels a side are
drawn by the same rasterizer, and each pixel of a facet, flat or curved, goes between the four nearest pixels
of the face that its ray goes through. It never sees the scene itself.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from quiltcli.display import lit_facets
from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.projection.camera import raster_display
from quiltcli.projection.planar import quilt_rays, viewer_rays
from quiltcli.render.buffers import Buffers, clear, new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.methods.raycast import pixels_of
from quiltcli.render.methods.twopass import look_up
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage, stage_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.pixels import lit_pixels, places

FACES = 2048
"""Pixels a side of the faces where a job does not say."""

AXES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=np.float64)
"""Directions of the faces, in the world's axes."""


def draw_cubemap(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame by way of a cube map; for the arguments see `frame.draw_frame`."""
    lit = lit_facets(stage.facets, viewer.eye) & (stage.layout.page >= 0)
    side = stage.job.render.faces or FACES
    faces, record, to_face = draw_faces(stage, viewer, side, threads)
    begin = time.perf_counter()
    if only is not None:
        lit &= only
    clear(stage, buffers, only)
    rays = viewer_rays(stage.layout, stage.facets, lit, viewer)
    visible = 0
    for address in pixels_of(stage, rays.lit):
        address = address[lit_pixels(address, stage.layout, stage.owners, rays)]
        pixels = places(address, stage.layout, stage.owners, rays)
        directions = pixels.directions()
        face = face_of(directions)
        for k in range(6):
            mine = np.flatnonzero(face == k)
            if not mine.size:
                continue
            x, y, w = to_face[k] @ directions[mine].T
            place = np.clip(np.stack((x / w, y / w)), 0, np.nextafter(side, 0))
            picture = {name: flat[k * side * side : (k + 1) * side * side] for name, flat in faces.items()}
            look_up(buffers, picture, (side, side), address[mine], place, pixels.facet[mine] + 1)
            nearest = np.floor(place).astype(np.int64)
            seen = np.isfinite(picture["Z"][nearest[1] * side + nearest[0]])
            visible += int(np.count_nonzero(seen & ~pixels.bleed[mine]))
    return replace(
        record,
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds={**record.seconds, "resample": time.perf_counter() - begin},
    )


def face_of(directions: FloatArray) -> np.ndarray:
    """The face (P,) that directions (P, 3) go through: the axis along which they are longest."""
    axis = np.abs(directions).argmax(axis=1)
    return np.asarray(2 * axis + (directions[np.arange(len(axis)), axis] < 0))


def draw_faces(
    stage: Stage, viewer: Viewer, side: int, threads: int
) -> tuple[Buffers, FrameRecord, FloatArray]:
    """Six faces one after the other, what drawing them took, and maps (6, 3, 3) from directions to them."""
    up = np.where(np.abs(AXES[:, 1:2]) > 0.5, np.array([0.0, 0, 1]), np.array([0.0, 1, 0]))
    right = np.cross(AXES, up)
    du, dv = right * (2 / side), -up * (2 / side)
    origin = viewer.eye + AXES - right + up
    size = np.full((6, 2), side, dtype=np.int32)
    facets, layout = raster_display(origin, du, dv, size, -AXES)
    channels = tuple(dict.fromkeys((*stage.job.output.channels, "Z")))
    job = stage.job.model_copy(
        update={
            "render": stage.job.render.model_copy(update={"method": "homography"}),
            "output": stage.job.output.model_copy(update={"channels": channels}),
        }
    )
    # A plane before the eye would cut off what lies behind it.
    around = viewer if viewer.by_distance else replace(viewer, clip="distance")
    camera = stage_of(job, facets, layout, stage.scene, bleed=0)
    buffers = new_buffers(camera)
    record = draw_frame(camera, around, buffers, threads)
    return buffers, record, quilt_rays(layout, np.ones(6, dtype=np.bool_), viewer.eye).quilt_from_eye
