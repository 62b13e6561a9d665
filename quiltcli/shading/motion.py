"""Motion: how far what a pixel shows is carried over the quilt until the next frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array
from quiltcli.projection.gaze import Gaze
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import Shaded
from quiltcli.shading.materials import between_corners
from quiltcli.visibility.resolve.hits import Wanted


def motion_wants(scene: Scene) -> Wanted:
    """What `motion` asks of hits."""
    return Wanted.POSITION if scene.corner_motion is None else Wanted.POSITION | Wanted.WEIGHTS


def motion(gaze: Gaze, shaded: Shaded) -> Sequence[FloatArray]:
    """Right and down, each (G, k) quilt pixels, from where a point is to where it will be a frame later.

    The point goes with its triangle, and both places are seen through the facet that shows it now: the
    second may lie anywhere on the facet's plane. 0 where it lies nowhere, behind the later eye, and where
    nobody knows what becomes of the triangle.
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
    return np.where(ahead, later_x - x, 0.0), np.where(ahead, later_y - y, 0.0)


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
