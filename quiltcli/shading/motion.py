"""Motion: how far what a pixel shows is carried over the quilt until the next frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array
from quiltcli.projection.curved import ChartView
from quiltcli.projection.gaze import Gaze
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.materials import between_corners
from quiltcli.visibility.resolve.hits import Hits, Wanted


def motion_wants(scene: Scene) -> Wanted:
    """What `motion` asks of hits."""
    return Wanted.POSITION if scene.corner_motion is None else Wanted.POSITION | Wanted.WEIGHTS


def motion(gaze: Gaze, shaded: Shaded) -> Sequence[FloatArray]:
    """Right and down, each (G, k) quilt pixels, from where a point is to where it will be a frame later.

    The point goes with its triangle, and both places are seen through the facet that shows it now: the
    second may lie anywhere on the facet's plane, or of a curved one where Newton's steps find it, up to a
    quarter of the raster away. 0 where it lies nowhere, behind the later eye, and where nobody knows what
    becomes of the triangle.
    """
    hits, scene = shaded.hits, shaded.scene
    assert hits.position is not None
    assert gaze.rays is not None
    later = hits.position + (gaze.rays.eye - gaze.later.eye)[:, None, None]
    if scene.corner_motion is not None:
        later += between_corners(scene.corner_motion, hits.points)
    x, y, _ = _pixels(gaze.rays.quilt_from_eye, hits.facet, hits.position)
    later_x, later_y, ahead = _pixels(gaze.later.quilt_from_eye, hits.facet, later)
    ahead &= np.isfinite(later_x) & np.isfinite(later_y)
    right, down = np.where(ahead, later_x - x, 0.0), np.where(ahead, later_y - y, 0.0)
    for facet, view in enumerate(gaze.later_views):
        if view is not None:
            _on_chart(view, hits, hits.facet == facet, later, gaze.turns, (right, down))
    return right, down


def _on_chart(
    view: ChartView,
    hits: Hits,
    mine: BoolArray,
    later: FloatArray,
    turns: bool,
    into: tuple[FloatArray, FloatArray],
) -> None:
    """Motion of the pixels of a curved facet (G,), which are groups of their own, written into (G, 1)."""
    assert hits.position is not None
    rows = np.flatnonzero(mine)
    way = later[:, rows, 0]
    # What rests is met where it was, but for the last bits.
    goes = np.isfinite(way).all(axis=0)
    goes &= turns or (way != hits.position[:, rows, 0]).any(axis=0)
    moved = np.zeros((2, rows.size))
    if goes.any():
        moved[:, goes] = view.moved(hits.pixel[rows[goes]], way[:, goes])
    for values, found in zip(into, moved, strict=True):
        values[rows, 0] = found


def _pixels(
    matrices: FloatArray, facet: Int32Array, points: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Columns and rows (G, k) of points (3, G, k) minus the eye on facets (G,); those ahead of the eye."""
    matrix = matrices.take(facet, axis=0)[:, :, :, None]
    x, y, w = (
        matrix[:, row, 0] * points[0] + matrix[:, row, 1] * points[1] + matrix[:, row, 2] * points[2]
        for row in range(3)
    )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return x / w, y / w, np.asarray(w > 0)
