"""Large triangles: what their spans hide is left out, what they fill is noted, and the rest is evaluated.

    span                              round
    a microtile of 8 × 8 pixels       64 pixels of each microtile,
    that a pair may show in           none of them twice

    a, a, b, c, c, c             →    1st  a b c
                                      2nd  a   c
                                      3rd      c

A microtile that a surface covers completely hides everything farther away in it (a hierarchical depth test).
One that a triangle fills with nothing else left in it is noted down by that triangle alone, its filler. What
remains are fragments: they are evaluated 64 at a time, one pair a microtile and round, so that no two writes
of a round meet.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, slices
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.keys import depth_part, make_keys, serial_of, serial_part
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.scan.spans import MICROTILE, Spans
from quiltcli.visibility.setup.blocks import Canvas, least_keys
from quiltcli.visibility.setup.grids import BASIS, grid_values
from quiltcli.visibility.setup.planes import Planes, facing, moved

_ROUND = 1024  # microtiles whose pixels are evaluated at a time: their values fit the cache
_EARLY = 3  # rounds that are long enough to be sorted by the edges that cross their microtiles
_CLEARLY = 2.0**-24  # as a share of 1/t: more than keys and the rounding of planes can tell
_X, _Y = (BASIS[k] for k in (0, 1))


def covering_keys(planes: Planes, spans: Spans, canvas: Canvas, bits: int) -> IntArray:
    """Keys (M,) that every pixel of a microtile will have at least, for a pair covers it; 0 for none."""
    nearest = np.zeros(canvas.touched.size, dtype=np.int64)
    covers = np.flatnonzero((spans.crossed == 0) & ~planes.cut.take(spans.row))
    serial = serial_part(planes.serial.take(spans.row[covers]), bits)
    np.maximum.at(nearest, spans.tile[covers], make_keys(serial, bits, out=spans.least[covers]))
    return nearest


def draw_large(
    planes: Planes,
    spans: Spans,
    covering: IntArray | None,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None = None,
) -> int:
    """Draw pairs of any size.

    Args:
        planes: the pairs.
        spans: from `large_spans`.
        covering: from `covering_keys`; None with `by`.
        canvas: what smaller pairs have left; its keys are raised, and microtiles that one pair fills noted.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
        by: what to order by instead of 1/t.

    Returns:
        Number of pixels that were evaluated.
    """
    # By another order than 1/t nothing is known to hide anything: all is evaluated.
    drawn = 0
    if covering is not None:
        # What small triangles drew, and what covers a microtile, hides spans as a whole.
        least = least_keys(canvas)
        np.greater(least, 0, out=canvas.full)
        spans = not_behind(spans, np.maximum(least, covering), bits)
        spans = spans.take(np.flatnonzero(~_behind_cover(planes, spans, covering, bits)))
        spans = _fill(planes, spans, canvas)
        # Backs and walls come last: pieces of other surfaces may hide them together.
        last = (spans.crossed == 0) | (facing(planes, spans.row, limits.handed) < 0)
        first, spans = spans.take(np.flatnonzero(~last)), spans.take(np.flatnonzero(last))
        _draw_rounds(planes, first, canvas, limits, bits, by)
        drawn = first.row.size
        # Only where something is left need the least keys be found again.
        left = np.zeros(canvas.touched.size, dtype=np.bool_)
        left[spans.tile] = True
        spans = not_behind(spans, least_keys(canvas, left), bits)
    _draw_rounds(planes, spans, canvas, limits, bits, by)
    return (drawn + spans.row.size) * MICROTILE * MICROTILE


def not_behind(spans: Spans, least: IntArray, bits: int) -> Spans:
    """The spans that are not wholly behind the `least` keys (M,) that the pixels of their microtiles have."""
    return spans.take(np.flatnonzero(spans.greatest >= depth_part(least, bits).take(spans.tile)))


def _behind_cover(planes: Planes, spans: Spans, covering: IntArray, bits: int) -> BoolArray:
    """Which spans (S,) lie, pixel by pixel, behind the pair that covers their microtile.

    So does the far side of a thin wall, though somewhere in the microtile it is nearer than the near
    side is elsewhere.
    """
    # The pair that covers a microtile is told by the serial in its key.
    result = np.zeros(spans.row.size, dtype=np.bool_)
    key = covering.take(spans.tile)
    some = np.flatnonzero(key)
    row_of_serial = np.empty(int(planes.serial.max(initial=0)) + 1, dtype=np.int64)
    row_of_serial[planes.serial] = np.arange(planes.serial.size)
    cover, row = row_of_serial.take(serial_of(key.take(some), bits)), spans.row.take(some)
    # The difference of two planes of 1/t is a plane: its greatest value is at a corner.
    behind = np.take(planes.inverse, row, axis=1)
    behind -= (1 - _CLEARLY) * np.take(planes.inverse, cover, axis=1)
    a, b, c = moved(spans.x.take(some), spans.y.take(some), out=behind)
    c += np.maximum(a * (MICROTILE - 1), 0) + np.maximum(b * (MICROTILE - 1), 0)
    # What is drawn of a sliver is held to its corners.
    held = planes.low.take(row) < (1 - _CLEARLY) * depth_part(key.take(some), bits)
    result[some] = (c < 0) & held & (cover != row)
    return result


def _fill(planes: Planes, spans: Spans, canvas: Canvas) -> Spans:
    """Note the microtiles that have nothing but one pair that fills them; the spans of all others."""
    # Alone: one span, and nothing that small triangles have drawn.
    count = np.bincount(spans.tile, minlength=canvas.touched.size)
    count += canvas.touched
    alone = (count.take(spans.tile) == 1) & (spans.crossed == 0) & ~planes.cut.take(spans.row)
    filled = np.flatnonzero(alone)
    canvas.filler[spans.tile[filled]] = planes.serial.take(spans.row[filled]) + np.int64(1)
    return spans.take(np.flatnonzero(~alone))


def _draw_rounds(
    planes: Planes, spans: Spans, canvas: Canvas, limits: DepthRange, bits: int, by: BatchOrder | None
) -> None:
    """Evaluate the microtiles' pixels, in rounds in which every microtile occurs once."""
    canvas.touched[spans.tile] = True
    group, order = rounds(spans)
    spans = spans.take(order)
    bounds = np.flatnonzero(np.diff(group, prepend=-1, append=-1))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        for part in slices(first, last, _ROUND):
            # No microtile twice: reading, comparing and writing back loses nothing.
            few = spans[part]
            keys = canvas.keys.take(few.tile, axis=0)
            canvas.keys[few.tile] = np.maximum(keys, tile_keys(planes, few, limits, bits, by), out=keys)


def rounds(spans: Spans) -> tuple[IntArray, IntArray]:
    """Numbers of groups (S,) to be evaluated together, ascending, and the spans in their order (S,).

    In a group no microtile comes twice, and, but for the late rounds, the same edges cross all: few
    spans are left then, and one evaluation for all costs less than several.
    """
    # The rank of a span among those of its microtile is its round.
    by_tile = _sorted_order(spans.tile)
    tile = spans.tile[by_tile]
    fresh = np.flatnonzero(np.diff(tile, prepend=-1))
    rank = np.arange(tile.size) - np.repeat(fresh, np.diff(fresh, append=tile.size))
    crossed = spans.crossed[by_tile].astype(np.int64)
    group = rank * 8 + np.where(rank < _EARLY, crossed, np.minimum(crossed, 1))
    by_group = _sorted_order(group)
    return group[by_group], by_tile[by_group]


def _sorted_order(values: IntArray) -> IntArray:
    """The order (S,) that sorts small whole numbers; equal ones stay as they are."""
    # With its place in the lower half every number is another, so the fastest sort is stable, too.
    packed = values << 32 | np.arange(values.size)
    packed.sort()
    packed &= 0xFFFFFFFF
    return packed


def tile_keys(planes: Planes, spans: Spans, limits: DepthRange, bits: int, by: BatchOrder | None) -> IntArray:
    """Keys (S, 64) of some microtiles; negative where they are not covered."""
    # Edges that cross none of these microtiles are not evaluated at all.
    row, x, y = spans.row, spans.x, spans.y
    crossed = int(np.bitwise_or.reduce(spans.crossed))

    def values(plane: FloatArray) -> FloatArray:
        return grid_values(moved(x, y, out=np.take(plane, row, axis=1)))

    # 1/t, negative wherever an edge that crosses some microtile is, or a limit of depth.
    inverse = values(planes.inverse)
    np.maximum(inverse, planes.low.take(row)[:, None], out=inverse)
    np.minimum(inverse, planes.high.take(row)[:, None], out=inverse)
    edges = [values(planes.edge[k]) for k in range(3) if crossed >> k & 1]
    for other in edges[1:]:
        np.minimum(edges[0], other, out=edges[0])
    cut = planes.cut.take(row)
    if cut.any():
        kept = limits.keeps(planes.block.take(row)[:, None], x[:, None] + _X, y[:, None] + _Y, inverse)
        np.negative(inverse, out=inverse, where=~kept & cut[:, None])
    # The sign tells covered from not, the size how near: one number for both.
    if edges:
        np.copysign(inverse, np.minimum(inverse, edges[0], out=edges[0]), out=inverse)
    if by is not None:
        inverse = by.values(planes.block.take(row)[:, None], x[:, None] + _X, y[:, None] + _Y, inverse)
    return make_keys(serial_part(planes.serial.take(row), bits)[:, None], bits, out=inverse)
