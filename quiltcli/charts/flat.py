"""Surfaces cut into flat pieces, as many as an error of so many pixels asks for.

Cells of a grid over the raster, its lines on whole pixels, become triangles, or quadrilaterals where these
are parallelograms. A piece's corners lie on the surface; between them it is off by a sag that falls as the
square of its size. Lines are added where cells are off too far, from edge to edge: no corner lies within
another's edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.geometry import BoolArray, FloatArray, IntArray

_ALONG = 5
_PARALLEL = 1e-4  # of a cell's size, that its fourth corner may be off a parallelogram


@dataclass(frozen=True)
class FlatPieces:
    """A surface in flat pieces.

    Attributes:
        points: (V, 3) corners, world metres.
        pixels: (V, 2) facet pixels of the corners.
        faces: corners of each piece, three or four, anticlockwise as seen from the lit side.
        error: pixels that the surface is away from its pieces at most.
    """

    points: FloatArray
    pixels: FloatArray
    faces: list[tuple[int, ...]]
    error: float


def flat_pieces(chart: Chart, error: float, most: int) -> FlatPieces | None:
    """Cut a surface into pieces that are nowhere more than `error` pixels away from it.

    Args:
        chart: a surface.
        error: pixels, by the greater step from pixel to pixel at each place.
        most: pieces at most.

    Returns:
        the pieces; None where so many are not enough.
    """
    width, height = chart.size
    xs, ys = (_lines(side, min(4, side)) for side in (width, height))
    while True:
        off, across, down = _errors(chart, xs, ys)
        if off.size > most:
            return None
        if off.max() <= error or (np.diff(xs).max() <= 1 and np.diff(ys).max() <= 1):
            break
        # Lines where it is bent most: of a cell that is off, in the direction in which it is bent more.
        bad = off > error
        columns = np.asarray((bad & (across >= down / 2)).any(axis=0))
        rows = np.asarray((bad & (down >= across / 2)).any(axis=1))
        before = xs.size + ys.size
        xs, ys = _halved(xs, columns), _halved(ys, rows)
        if xs.size + ys.size == before:
            xs, ys = _halved(xs, np.asarray(bad.any(axis=0))), _halved(ys, np.asarray(bad.any(axis=1)))
    found = _pieces(chart, xs, ys, float(off.max()))
    return found if len(found.faces) <= most else None


def _lines(side: int, count: int) -> IntArray:
    return np.unique(np.rint(np.linspace(0, side, count + 1)).astype(np.int64))


def _halved(lines: IntArray, chosen: BoolArray) -> IntArray:
    """Lines, and one in the middle of each chosen gap that is wider than a pixel."""
    first, last = lines[:-1][chosen], lines[1:][chosen]
    middle = (first + last) // 2
    return np.unique(np.concatenate((lines, middle[middle > first])))


def _errors(chart: Chart, xs: IntArray, ys: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """How far (rows, columns), in pixels, cells are off their triangles; and their sag across and down."""
    share = np.linspace(0, 1, _ALONG)
    x = (xs[:-1, None] + np.diff(xs)[:, None] * share).reshape(1, -1)
    y = (ys[:-1, None] + np.diff(ys)[:, None] * share).reshape(-1, 1)
    cells = (ys.size - 1, _ALONG, xs.size - 1, _ALONG)
    points = np.broadcast_to(chart.points(x, y), (3, y.size, x.size)).reshape(3, *cells)
    a, b, c, d = (points[:, :, i, :, j] for i, j in ((0, 0), (0, -1), (-1, -1), (-1, 0)))
    u, v = share[None, None, None, :], share[None, :, None, None]
    pitch = _pitch(chart, x, y).reshape(cells)
    upper = [
        a[k][:, None, :, None] + u * (b[k] - a[k])[:, None, :, None] + v * (c[k] - b[k])[:, None, :, None]
        for k in range(3)
    ]
    lower = [
        a[k][:, None, :, None] + u * (c[k] - d[k])[:, None, :, None] + v * (d[k] - a[k])[:, None, :, None]
        for k in range(3)
    ]
    off = np.zeros(cells)
    for k in range(3):
        off += (points[k] - np.where(u >= v, upper[k], lower[k])) ** 2
    middle = _ALONG // 2
    across = np.sqrt(((points[:, :, :, :, middle] - (points[..., 0] + points[..., -1]) / 2) ** 2).sum(axis=0))
    down = np.sqrt(((points[:, :, middle] - (points[:, :, 0] + points[:, :, -1]) / 2) ** 2).sum(axis=0))
    off = np.sqrt(off) / pitch
    return (
        np.nan_to_num(off).max(axis=(1, 3)),
        np.nan_to_num(across / pitch[:, :, :, middle]).max(axis=1),
        np.nan_to_num(down / pitch[:, middle]).max(axis=2),
    )


def _pitch(chart: Chart, x: FloatArray, y: FloatArray) -> FloatArray:
    """The greater of the steps to the next pixel right and down, metres."""
    steps = [
        np.sqrt(((chart.points(x + dx, y + dy) - chart.points(x - dx, y - dy)) ** 2).sum(axis=0)) * 2
        for dx, dy in ((0.25, 0.0), (0.0, 0.25))
    ]
    shape = (y.size, x.size)
    return np.asarray(np.maximum(np.broadcast_to(np.fmax(*steps), shape), 1e-12))


def _pieces(chart: Chart, xs: IntArray, ys: IntArray, error: float) -> FlatPieces:
    x, y = np.meshgrid(xs.astype(np.float64), ys.astype(np.float64))
    points = np.broadcast_to(chart.points(x, y), (3, *x.shape)).reshape(3, -1).T
    number = np.arange(x.size).reshape(x.shape)
    faces: list[tuple[int, ...]] = []
    for j in range(ys.size - 1):
        for i in range(xs.size - 1):
            a, b, c, d = (int(number[k]) for k in ((j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i)))
            if chart.mask is not None and not chart.mask[ys[j] : ys[j + 1], xs[i] : xs[i + 1]].any():
                continue
            corners = points[[a, b, c, d]]
            if not np.isfinite(corners).all():
                continue
            # Corners at a pole are one point: what is left has the area.
            size = np.ptp(corners, axis=0).max()
            off = np.abs(corners[0] + corners[2] - corners[1] - corners[3]).max()
            pieces = [(a, d, c, b)] if off <= _PARALLEL * size else [(a, c, b), (a, d, c)]
            faces += [piece for piece in pieces if _has_area(points[list(piece)], size)]
    if chart.side < 0:
        faces = [face[::-1] for face in faces]
    return FlatPieces(points, np.stack((x.reshape(-1), y.reshape(-1)), axis=1), faces, error)


def _has_area(corners: FloatArray, size: float) -> bool:
    """Whether a piece is more than a line."""
    area = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return bool(np.sqrt(area @ area) > 1e-6 * size * size)
