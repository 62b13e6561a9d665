"""Rays through the pixels of a facet, flat or curved: what the tiles of a projected picture ask."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.projection.curved import NEAR, ChartView, chart_views
from quiltcli.projection.planar import eye_from_quilt
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer

Rays: TypeAlias = FloatArray | ChartView
"""Page pixel → direction from the eye: a matrix (3, 3) of (x, y, 1), or a curved facet's own."""

_AHEAD = np.array([0.0, 0.0, -1.0])


def facet_rays(stage: Stage, viewer: Viewer) -> list[Rays]:
    """The rays of every facet of a display, for one eye."""
    matrices: list[Rays] = list(eye_from_quilt(stage.layout, viewer.eye))
    charts = stage.facets.charts
    for row, view in enumerate(chart_views(charts, stage.layout, viewer.eye, viewer.camera_from_world)):
        if view is not None:
            matrices[row] = view
    return matrices


def directions_at(rays: Rays, x: FloatArray, y: FloatArray) -> FloatArray:
    """Directions (3, ...) at page pixels that broadcast; straight ahead where there is none."""
    if isinstance(rays, ChartView):
        found = rays.rays(x, y)
        return np.where(np.isfinite(found.sum(axis=0)), found, _wide(_AHEAD, found.ndim))
    result: FloatArray = np.stack([row[0] * x + row[1] * y + row[2] for row in rays])
    return result


def slopes_at(rays: Rays, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How directions change from pixel to pixel, right and down: (3,) all over, or (3, ...) at each place."""
    if isinstance(rays, ChartView):
        right = (rays.rays(x + NEAR, y) - rays.rays(x - NEAR, y)) / (2 * NEAR)
        down = (rays.rays(x, y + NEAR) - rays.rays(x, y - NEAR)) / (2 * NEAR)
        return np.nan_to_num(right), np.nan_to_num(down)
    return rays[:, 0], rays[:, 1]


def moved(
    d: FloatArray, slopes: tuple[FloatArray, FloatArray], across: FloatArray, down: FloatArray
) -> FloatArray:
    """Directions (3, h, w) some pixels to the right and down of others, as slopes have them."""
    right, below = (_wide(slope, d.ndim) for slope in slopes)
    result: FloatArray = d + right * across + below * down
    return result


def shown_pixels(rays: Rays, x: FloatArray, y: FloatArray) -> BoolArray | None:
    """Which pixels show an image to the eye; None where all of the facet do."""
    return rays.lit(x, y) if isinstance(rays, ChartView) else None


def _wide(vector: FloatArray, dimensions: int) -> FloatArray:
    """A vector (3,) for arrays (3, ...); what is one already stays."""
    return vector if vector.ndim > 1 else vector.reshape(3, *[1] * (dimensions - 1))
