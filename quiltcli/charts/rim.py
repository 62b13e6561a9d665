"""A net of triangles that reaches up to a chart's rim, its mask's edges and its cuts, for looking at it.

`meet.net` leaves out every cell that is not whole: good enough for first guesses, but a row of steps along a
dome's rim, and a gap wherever a cube map's faces end.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.meet import CELLS
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray

_INSIDE = 1e-6  # pixels that a face's net keeps from a cut, at which a place belongs to the next face
_FINER = 8  # most parts of a cell across and down, at the rim


def net_to_the_rim(chart: Chart, cells: int = CELLS) -> tuple[FloatArray, FloatArray, Int32Array]:
    """Triangles that stand for a chart, as of `meet.net`, of which those at its rim and its cuts are small.

    A cell that is there in part is divided up to pixels or eighths, and so are those beside it: coarse and
    fine triangles overlap there, and no gap is left between the chord of one and the arc of the others.

    Args:
        chart: the chart.
        cells: cells from side to side.

    Returns:
        points (V, 3), or directions; facet pixels (V, 2); triangles (T, 3).
    """
    points: list[FloatArray] = []
    pixels: list[FloatArray] = []
    triangles: list[Int32Array] = []
    count = 0
    for xs in _spans(chart.size[0], chart.cuts[0], cells):
        for ys in _spans(chart.size[1], chart.cuts[1], cells):
            whole, partly = _cells(chart, xs, ys)
            row, column = np.nonzero(_with_neighbours(partly))
            parts = min(_FINER, int(np.ceil(max(xs[1] - xs[0], ys[1] - ys[0]))))
            share = np.linspace(0, 1, parts + 1)
            fine_x = xs[column, None] + (xs[column + 1] - xs[column])[:, None] * share
            fine_y = ys[row, None] + (ys[row + 1] - ys[row])[:, None] * share
            for x, y, mask in (
                (xs[None], ys[None], whole[None]),
                (fine_x, fine_y, _fine_mask(chart, fine_x, fine_y)),
            ):
                grid_x, grid_y = np.broadcast_arrays(x[:, None, :], y[:, :, None])
                found = np.moveaxis(chart.points(grid_x, grid_y), 0, -1).reshape(-1, 3)
                known = np.isfinite(found.sum(axis=1))
                points.append(np.where(known[:, None], found, 0.0))
                pixels.append(np.stack((grid_x.reshape(-1), grid_y.reshape(-1)), axis=1))
                triangles.append(_triangles(known.reshape(grid_x.shape), mask) + np.int32(count))
                count += len(found)
    return np.concatenate(points), np.concatenate(pixels), np.concatenate(triangles).astype(np.int32)


def _spans(length: int, cuts: tuple[int, ...], cells: int) -> list[FloatArray]:
    """Lines of the grid along one side, a row of them for each part between cuts."""
    spans = []
    for first, last in pairwise((0, *cuts, length)):
        lines = np.linspace(first, last, max(1, round(min(cells, length) * (last - first) / length)) + 1)
        lines[0] += _INSIDE * (first > 0)
        lines[-1] -= _INSIDE * (last < length)
        spans.append(lines)
    return spans


def _cells(chart: Chart, xs: FloatArray, ys: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Which cells (rows, columns) are there as a whole, and which in part."""
    known = np.isfinite(chart.points(xs[None, :], ys[:, None]).sum(axis=0))
    corners = np.stack([known[:-1, :-1], known[1:, :-1], known[1:, 1:], known[:-1, 1:]])
    every, some = np.asarray(corners.all(axis=0)), np.asarray(corners.any(axis=0))
    if chart.mask is not None:
        # Pixels of each cell that there are, counted between the pixels in which its lines lie.
        rows, columns = ys.astype(int), xs.astype(int)
        rows[-1], columns[-1] = round(ys[-1]), round(xs[-1])
        there = chart.mask[: rows[-1], : columns[-1]].astype(np.int64)
        count = np.add.reduceat(np.add.reduceat(there, rows[:-1], axis=0), columns[:-1], axis=1)
        every &= count == np.outer(np.diff(rows), np.diff(columns))
        some &= count > 0
    return every, some & ~every


def _with_neighbours(cells: BoolArray) -> BoolArray:
    """The cells (rows, columns), and all beside them."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _fine_mask(chart: Chart, xs: FloatArray, ys: FloatArray) -> BoolArray:
    """Whether a chart has pixels in the middle of cells between lines (N, k + 1) across and down."""
    x, y = ((lines[:, :-1] + lines[:, 1:]) / 2 for lines in (xs, ys))
    if chart.mask is None:
        return np.ones((len(x), y.shape[1], x.shape[1]), dtype=np.bool_)
    pixel: tuple[IntArray, IntArray] = (y.astype(np.int64)[:, :, None], x.astype(np.int64)[:, None, :])
    return np.asarray(chart.mask[pixel])


def _triangles(known: BoolArray, mask: BoolArray) -> IntArray:
    """Two triangles (T, 3) for each cell of grids (N, rows + 1, columns + 1) that is there."""
    number = np.arange(known.size).reshape(known.shape)
    a, b, c, d = number[:, :-1, :-1], number[:, 1:, :-1], number[:, 1:, 1:], number[:, :-1, 1:]
    keep = mask & known[:, :-1, :-1] & known[:, 1:, :-1] & known[:, 1:, 1:] & known[:, :-1, 1:]
    first, second = (np.stack(corners, axis=-1)[keep] for corners in ((a, b, c), (a, c, d)))
    return np.stack((first, second), axis=1).reshape(-1, 3)
