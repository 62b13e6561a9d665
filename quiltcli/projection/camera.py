"""The camera of a picture: a display of one rectangle across the look direction.

Through it, anything the program can draw for a display it can draw as a plain picture, with the
same rays, the same rasterizer and the same rules at every edge: the paper's virtual view plane.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import ViewerError
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, cross, dot, normalized, segments
from quiltcli.layout import Layout
from quiltcli.viewer.viewer import Viewer

WIDEST = 120.0
"""Degrees a picture spans at most, up and down or across, when the camera frames the display by itself."""

_MARGIN = 1.12


def camera_display(viewer: Viewer, width: int, height: int, fov: float) -> tuple[Facets, Layout]:
    """A display of one facet that fills the viewer's view, and its layout of one page.

    Args:
        viewer: its eye, look and up are the camera's; the rectangle stands 1 m away.
        width: pixels.
        height: pixels.
        fov: degrees from the picture's top to its bottom, below 180; pixels are square.
    """
    pixel = 2 * math.tan(math.radians(fov) / 2) / height
    right = cross(viewer.look, viewer.up)
    du, dv = right * pixel, -viewer.up * pixel
    origin = viewer.eye + viewer.look - width / 2 * du - height / 2 * dv
    size = np.array([[width, height]], dtype=np.int32)
    return raster_display(origin[None], du[None], dv[None], size, -viewer.look[None])


def raster_display(
    origin: FloatArray, du: FloatArray, dv: FloatArray, size: Int32Array, normal: FloatArray
) -> tuple[Facets, Layout]:
    """A display of R whole rasters, and the layout that gives each a page of its own.

    Args:
        origin: (R, 3) top-left corners, world metres.
        du: (R, 3) world steps to the next pixel right.
        dv: (R, 3) world steps to the next pixel down.
        size: (R, 2) width and height, pixels.
        normal: (R, 3) unit normals on the lit side.
    """
    count = len(size)
    # Anticlockwise as seen from the lit side, where du points right and dv down unless it is mirrored.
    raster = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * size[:, None]
    mirrored = dot(cross(du, dv), normal) > 0
    raster[mirrored] = raster[mirrored, ::-1]
    corners = origin[:, None] + raster[..., :1] * du[:, None] + raster[..., 1:] * dv[:, None]
    facets = Facets(
        names=("picture",) * count,
        corner_start=4 * np.arange(count + 1, dtype=np.int64),
        corners=corners.reshape(-1, 3),
        origin=origin,
        du=du,
        dv=dv,
        size=size,
        normal=normal,
        both_sides=False,
        enabled=np.ones(count, dtype=np.bool_),
        mirrored=mirrored,
        uv=None,
        path="camera",
    )
    return facets, _own_pages(facets)


def _own_pages(facets: Facets) -> Layout:
    """The layout that gives each facet's raster a page of its own."""
    return Layout(
        facet=np.arange(1, facets.count + 1, dtype=np.int32),
        page=np.arange(facets.count, dtype=np.int32),
        size=facets.size,
        quilt_from_facet=np.tile(np.eye(2, 3), (facets.count, 1, 1)),
        origin=facets.origin,
        du=facets.du,
        dv=facets.dv,
        corner_start=facets.corner_start,
        polygon=np.rint(corner_pixels(facets)),
        pages=facets.size,
        padding=0,
        method="camera",
        display=facets.path,
        display_sha256=facets.sha256,
    )


def aimed(viewer: Viewer, look: FloatArray) -> Viewer:
    """The same viewer with its head turned: `look` (3,) of any length, up kept as far as it can be.

    Raises:
        ViewerError: there is no direction, or it is that of up.
    """
    ahead = normalized(look)
    right = cross(ahead, viewer.up)
    if not float(dot(right, right)) > 1e-12:
        right = cross(ahead, viewer.look)
    if not float(dot(right, right)) > 1e-12:
        raise ViewerError("the picture's camera is where it looks at, or looks along up (move it)")
    return replace(viewer, look=ahead, up=normalized(cross(normalized(right), ahead)))


def frame_display(viewer: Viewer, corners: FloatArray, aspect: float, turn: bool) -> tuple[Viewer, float]:
    """Turn and open a camera so that it shows the whole display with a margin.

    From inside a display, which no picture shows whole, the view opens to `WIDEST` along the longer
    side and keeps looking where it did.

    Args:
        viewer: the camera.
        corners: (C, 3) of the display, world metres.
        aspect: width over height of the picture.
        turn: whether the camera may turn to the display; it does not when it was told where to look.

    Returns:
        The camera, and degrees from the picture's top to its bottom.
    """
    widest = math.tan(math.radians(WIDEST) / 2)
    local = corners - viewer.eye
    middle = local.min(axis=0) + local.max(axis=0)
    turn = turn and float(dot(middle, middle)) > 1e-12 * float(np.abs(local).max()) ** 2
    camera = aimed(viewer, middle) if turn else viewer
    for _ in range(8 if turn else 1):
        x, y, ahead = _tangents(camera, local)
        if not ahead.all():
            break
        centre = ((x.min() + x.max()) / 2, (y.min() + y.max()) / 2)
        if turn:
            right = cross(camera.look, camera.up)
            camera = aimed(camera, camera.look + centre[0] * right + centre[1] * camera.up)
    x, y, ahead = _tangents(camera, local)
    reach = _MARGIN * max(float(np.abs(y).max()), float(np.abs(x).max()) / aspect) if ahead.all() else np.inf
    if reach * max(aspect, 1.0) > widest:
        camera = viewer
        reach = widest / max(aspect, 1.0)
    return camera, math.degrees(2 * math.atan(reach))


def viewer_frustum(viewer: Viewer, facets: Facets, lit: BoolArray) -> tuple[float, float]:
    """Slopes from the look direction to the sides and to the top of the viewer's own image.

    The frustum is symmetric about the look direction and as narrow as shows all lit facets, opened to
    `WIDEST` at most: the virtual view plane (Harish & Narayanan, §3.1).
    """
    row, _ = segments(facets.corner_start)
    x, y, ahead = _tangents(viewer, (facets.corners - viewer.eye)[lit[row]])
    widest = math.tan(math.radians(WIDEST) / 2)
    if not (ahead.size and ahead.all()):
        return widest, widest
    wide, high = (min(float(np.abs(slope).max()), widest) for slope in (x, y))
    return max(wide, 1e-6), max(high, 1e-6)


def beyond_frustum(viewer: Viewer, facets: Facets, lit: BoolArray) -> bool:
    """Whether lit facets reach beyond the widest frustum that `viewer_frustum` opens."""
    row, _ = segments(facets.corner_start)
    x, y, ahead = _tangents(viewer, (facets.corners - viewer.eye)[lit[row]])
    widest = math.tan(math.radians(WIDEST) / 2) * (1 + 1e-9)
    return not (ahead.all() and (np.abs(x) <= widest).all() and (np.abs(y) <= widest).all())


def _tangents(camera: Viewer, local: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Slopes to the right and up (C,) of points relative to the eye, and whether they lie ahead."""
    depth = dot(local, camera.look)
    ahead = depth > 1e-3 * np.sqrt(dot(local, local))
    safe = np.where(ahead, depth, 1.0)
    right = cross(camera.look, camera.up)
    return dot(local, right) / safe, dot(local, camera.up) / safe, np.asarray(ahead)
