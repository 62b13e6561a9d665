"""Places spread evenly over a surface, each standing for the piece of area around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.measure import measure
from quiltcli.charts.shapes import crossed
from quiltcli.geometry import FloatArray

_NEAR = 0.25  # pixels to the places of which differences are taken


@dataclass(frozen=True)
class SurfaceLattice:
    """N places on a surface.

    Attributes:
        point: (N, 3) world metres.
        normal: (N, 3) unit, on the lit side.
        area: (N,) square metres that a place stands for.
    """

    point: FloatArray
    normal: FloatArray
    area: FloatArray


def surface_lattice(chart: Chart, count: int) -> SurfaceLattice:
    """About `count` places of a surface, its edges among them.

    Rows and columns are as many as the surface is long that way, in metres. A column that closes a ring is
    there once; poles, places outside the mask and those without a point are left out.
    """
    width, height = chart.size
    columns, rows = _divisions(chart, count)
    # The middles of pixels at the edges: beyond them a map does not know how it goes on.
    x = np.linspace(0, width, columns + 1)[: columns if chart.wraps else None]
    y = np.linspace(0, height, rows + 1)
    across = _weights(x.size, ring=chart.wraps) * (width / columns)
    down = _weights(y.size, ring=False) * (height / rows)
    i, j = np.clip(x, 0.5, width - 0.5)[None], np.clip(y, 0.5, height - 0.5)[:, None]
    points = np.broadcast_to(chart.points(i, j), (3, y.size, x.size))
    normals = np.broadcast_to(chart.normals(i, j), points.shape)
    right = chart.points(i + _NEAR, j) - chart.points(i - _NEAR, j)
    below = chart.points(i, j + _NEAR) - chart.points(i, j - _NEAR)
    pixel = np.sqrt((crossed(right, below) ** 2).sum(axis=0)) / (2 * _NEAR) ** 2
    area = np.broadcast_to(pixel, points.shape[1:]) * across * down[:, None]
    known = np.isfinite(points.sum(axis=0)) & (area > 0) & (normals != 0).any(axis=0)
    if chart.mask is not None:
        known &= chart.mask[np.ix_(j[:, 0].astype(int), i[0].astype(int))]
    area = area[known] * (measure(chart).area / max(float(area[known].sum()), 1e-300))
    return SurfaceLattice(points[:, known].T, normals[:, known].T, area)


def _divisions(chart: Chart, count: int) -> tuple[int, int]:
    """Columns and rows of cells, about `count` in all, that are about as wide as they are high."""
    width, height = chart.size
    x, y = np.meshgrid(*(np.linspace(0.5, side - 0.5, 9) for side in chart.size))
    points = chart.points(x, y)
    across, along = (
        float(np.nansum(np.sqrt((np.diff(points, axis=axis) ** 2).sum(axis=0)))) for axis in (2, 1)
    )
    ratio = across / along if across > 0 and along > 0 else 1.0
    columns = round(float(np.clip(np.sqrt(count * ratio), 2, width)))
    return columns, round(float(np.clip(count / columns, 2, height)))


def _weights(count: int, *, ring: bool) -> FloatArray:
    """Shares of the places of a row: half at its ends, unless it is a ring."""
    weights = np.ones(count)
    if not ring:
        weights[[0, -1]] = 0.5
    return weights


def chart_lines(chart: Chart, columns: int = 9, rows: int = 5, steps: int = 64) -> list[FloatArray]:
    """Lines (n, 3) along some columns and rows of a surface's pixels, its edges among them, world metres.

    A line ends where there are no pixels, and goes on where there are.
    """
    found: list[FloatArray] = []
    for axis, count in ((0, columns), (1, rows)):
        places = np.clip(np.linspace(0, chart.size[axis], count), 0.5, chart.size[axis] - 0.5)
        length = chart.size[1 - axis]
        along = np.clip(np.linspace(0, length, steps + 1), 0.5, length - 0.5)
        for place in places.tolist():
            still = np.full_like(along, place)
            x, y = (still, along) if axis == 0 else (along, still)
            points = chart.points(x, y)
            known = np.isfinite(points.sum(axis=0))
            if chart.mask is not None:
                known &= chart.mask[y.astype(int), x.astype(int)]
            edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(int)))
            found += [points[:, a:b].T for a, b in edges.reshape(-1, 2).tolist() if b - a > 1]
    return found
