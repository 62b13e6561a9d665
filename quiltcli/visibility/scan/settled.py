"""Settled microtiles: one pair is all that any sample of their pixels can see.

A sample lies up to half a pixel beside its pixel's centre. A pair covers all samples of a microtile where its
edge functions, less what they lose on that way, are positive at all centres; another can show at some of them
only where its own, with as much added, are. Where the first is nearer than all others could be, nothing
needs to be looked at again for any sample.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.visibility.scan.spans import large_spans
from quiltcli.visibility.setup.blocks import Canvas
from quiltcli.visibility.setup.planes import Planes, Warped, depth_bounds

REACH = 0.5
"""Pixels by which samples lie beside the centres of their pixels, at most."""
_MORE = 1 + 2.0**-20


def settled_tiles(
    pairs: Warped, small: IntArray, large: Planes, opaque: BoolArray, canvas: Canvas
) -> BoolArray:
    """Which microtiles (M,) are settled.

    Args:
        pairs: the pairs, with boxes that hold all samples.
        small: the pairs (R,) that are looked at by their boxes.
        large: the others.
        opaque: (T,) triangles that hold up all light.
        canvas: the microtiles.
    """
    count = canvas.touched.size
    # The nearest that covers each: how far away it reaches at most.
    covers = large_spans(_shifted(large, -REACH * _MORE), canvas, hide=False)
    whole = (covers.crossed == 0) & ~large.cut.take(covers.row) & opaque.take(large.triangle.take(covers.row))
    row, tile = covers.row[whole], covers.tile[whole]
    least = np.maximum(covers.least[whole] - _way(large.inverse, row), large.low.take(row))
    nearest = np.zeros(count)
    np.maximum.at(nearest, tile, least)
    best = np.full(count, -1, dtype=np.int64)
    mine = least == nearest.take(tile)
    best[tile[mine]] = row[mine]
    settled = (best >= 0) & canvas.used
    # All that comes as near at any sample.
    others = large_spans(_shifted(large, REACH * _MORE), canvas, hide=False)
    greatest = np.minimum(others.greatest + _way(large.inverse, others.row), large.high.take(others.row))
    before = (greatest >= nearest.take(others.tile)) & (others.row != best.take(others.tile))
    settled[others.tile[before]] = False
    _, high = depth_bounds(np.stack([corner[2].take(small) for corner in pairs.corners]))
    for cell in _under(pairs, small, canvas):
        settled[cell[high >= nearest.take(cell)]] = False
    return settled


def _shifted(planes: Planes, way: float) -> Planes:
    """The pairs with edge functions that are so many pixels of each slope greater."""
    edge = planes.edge.copy()
    edge[:, 2] += way * (np.abs(edge[:, 0]) + np.abs(edge[:, 1]))
    return replace(planes, edge=edge)


def _way(plane: FloatArray, row: IntArray) -> FloatArray:
    """What planes (3, N) of some rows change by from a pixel's centre to any of its samples (n,)."""
    slope = REACH * _MORE * (np.abs(plane[0]) + np.abs(plane[1]))
    result: FloatArray = slope.take(row)
    return result


def _under(pairs: Warped, rows: IntArray, canvas: Canvas) -> list[IntArray]:
    """The microtiles under small boxes (R,): those under their corners and their middle, nine in all."""
    block = pairs.block.take(rows)
    x0, x1, y0, y1 = np.take(pairs.box, rows, axis=1).astype(np.int64)
    across, start = canvas.tiles_across.take(block), canvas.tile_start.take(block)
    columns = [x >> 3 for x in (x0, (x0 + x1) >> 1, x1)]
    lines = [start + (y >> 3) * across for y in (y0, (y0 + y1) >> 1, y1)]
    return [line + column for line in lines for column in columns]
