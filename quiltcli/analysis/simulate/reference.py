"""What resampling alone costs: direct pictures as dense as the display, resampled once.

A display of finite pixels can at best show what a plain picture of as many pixels shows, and both have
to be resampled to be looked at. That picture's error is the measure of the display's. A display is not
equally dense everywhere, and a panel that is seen aslant is less dense across than along: a picture of
square pixels, as many to the solid angle, would be finer in one direction and coarser in the other, and
err by another amount at every edge. So each facet has a picture of its own, a *window*: the scene drawn
through the facet's plane with pixels where the facet has its own, as a whole rectangle that goes on
past the facet's edges. There is no polygon in it, no quilt, no bleed and no seam.
"""

from __future__ import annotations

import numpy as np

from quiltcli.analysis.simulate.lookup import Shown, look_up, quilt_places
from quiltcli.analysis.simulate.picture import Camera, camera_stage, exact, picture_rays
from quiltcli.display import Facets, lit_facets
from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray, dot
from quiltcli.layout import Layout
from quiltcli.projection.camera import raster_display
from quiltcli.projection.planar import eye_from_quilt
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer

_MARGIN = 2  # pixels around the places that are looked up: one is needed
_TOGETHER = 1 << 23  # pixels of windows that are drawn at a time, as far as one window is no larger


def resampled_light(
    stage: Stage,
    viewer: Viewer,
    shown: Shown,
    camera: Viewer,
    through: Camera,
    facet: Int32Array,
    threads: int,
    how: str = "linear",
) -> Float32Array | None:
    """Direct pictures as dense as the display, resampled once to a picture's rays.

    Args:
        stage: its scene is drawn.
        viewer: whose near and far hold.
        shown: the display and its layout.
        camera: the picture's camera, at the viewer's eye.
        through: its display of one facet.
        facet: (P,) facet each ray meets, −1 for none.
        threads: batches drawn at a time.
        how: a filter of `lookup.FILTERS`, that of the display.

    Returns:
        (3, P) linear light, black where no lit facet is met; None where none is.
    """
    facing = lit_facets(shown.facets, camera.eye) & shown.lit
    met = np.flatnonzero(facet >= 0)
    met = met[facing[facet[met]]]
    if not met.size:
        return None
    mine = facet[met]
    place = quilt_places(shown, mine, picture_rays(camera, through, met), camera.eye, facing)
    light = np.zeros((3, facet.size), dtype=np.float32)
    for some in _groups(mine, place):
        chosen, row = np.unique(mine[some], return_inverse=True)
        windows, corner = facet_windows(shown.facets, shown.layout, chosen, row, place[:, some], camera.eye)
        images = _drawn(stage, viewer, windows, threads)
        light[:, met[some]] = look_up(images, row.astype(np.int32), place[:, some] - corner[row].T, how)
    return light


def facet_windows(
    facets: Facets, layout: Layout, chosen: Int32Array, row: IntArray, place: FloatArray, eye: FloatArray
) -> tuple[Camera, IntArray]:
    """The windows of some facets that hold some places, with a margin.

    Args:
        facets: the display.
        layout: its layout.
        chosen: (W,) facet index of each window.
        row: (P,) window of every place; each has one.
        place: (2, P) in pixels of the facets' pages.
        eye: (3,) world metres.

    Returns:
        The windows as a display with a page each, and (W, 2) the pixel of the facet's page at which
        each begins.
    """
    low, high = _bounds(row, place)
    corner = np.floor(low).astype(np.int64) - _MARGIN
    size = (np.ceil(high).astype(np.int64) + _MARGIN - corner).astype(np.int32)
    du, dv, first = (eye_from_quilt(layout, eye)[chosen, :, k] for k in range(3))
    origin = eye + first + corner[:, :1] * du + corner[:, 1:] * dv
    # Facets that are lit on both sides are seen on the one that the eye is on.
    away = dot(origin - eye, facets.normal[chosen])[:, None]
    normal = np.where(away > 0, -facets.normal[chosen], facets.normal[chosen])
    return raster_display(origin, du, dv, size, normal), corner


def _groups(facet: Int32Array, place: FloatArray) -> list[IntArray]:
    """Places (P,), by as many facets at a time as can be drawn together."""
    row = np.unique(facet, return_inverse=True)[1]
    low, high = _bounds(row, place)
    group = (np.cumsum((high - low).prod(axis=1)) // _TOGETHER).astype(np.int64)[row]
    return [np.flatnonzero(group == each) for each in np.unique(group).tolist()]


def _bounds(row: IntArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest (W, 2) of the places (2, P) of each row; none is without."""
    order = np.argsort(row, kind="stable")
    start = np.flatnonzero(np.diff(row[order], prepend=-1))
    low, high = (which.reduceat(place[:, order], start, axis=1).T for which in (np.minimum, np.maximum))
    return low, high


def _drawn(stage: Stage, viewer: Viewer, windows: Camera, threads: int) -> Shown:
    """The scene through windows."""
    direct = camera_stage(exact(stage.job), windows, stage.scene)
    buffers = new_buffers(direct)
    draw_frame(direct, viewer, buffers, threads)
    lit = np.ones(windows[0].count, dtype=np.bool_)
    return Shown(*windows, lit, buffers, direct.owners, viewer.eye)
