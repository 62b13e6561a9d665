"""Settle a packing: push every facet up and to the left, pixel by pixel, as far as its neighbours let it.

Shelves have straight ends and mosaics have cells; what those leave between facets is closed here. The
way of a facet is found for all places at once: each of its rows or columns of pixels, against the
same one of a neighbour, forbids an interval of places, and the first place outside all of them is free.
So a facet may jump into a hole. Every place is checked against all facets, moved or not, and the
place a facet has is always free: settling never does harm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import Int32Array, IntArray, segments
from quiltcli.packing.model import PackInput, PackResult
from quiltcli.packing.shapes import Shapes

_REACH = (1, 2)
"""How far a facet may jump to the left and up, in its own sizes."""


def settle(wanted: PackInput, shapes: Shapes, result: PackResult, passes: int = 3) -> PackResult:
    """The same packing with facets pushed together, on every page that had nothing on it before."""
    corner = result.corner.astype(np.int64)
    for page in range(wanted.begun, int(result.page.max(initial=-1)) + 1):
        on = np.flatnonzero(result.page == page)
        heap = _Heap(wanted, shapes, on, (result.turn + 4 * result.mirror)[on].astype(np.int64), corner[on])
        for _ in range(passes):
            if not heap.sweep():
                break
        corner[on] = heap.corner
    return replace(result, corner=corner.astype(np.int32))


@dataclass(frozen=True)
class _Lanes:
    """Outlines of facets in lanes of pixels, rows or columns, one facet after another.

    Attributes:
        start: (n+1,) first lane of each facet.
        low, high: first pixel taken in each lane, and one past the last.
        kept_start, kept_low, kept_high: the same with the padding around, which takes lanes of its own.
    """

    start: IntArray
    low: IntArray
    high: IntArray
    kept_start: IntArray
    kept_low: IntArray
    kept_high: IntArray

    @staticmethod
    def of(first: IntArray, count: IntArray, sides: tuple[Int32Array, Int32Array], padding: int) -> _Lanes:
        """Lanes from tables of both sides in which those of a facet begin at `first`."""
        start = np.concatenate(([0], np.cumsum(count)))
        facet, rank = segments(start)
        low, high = (side[first[facet] + rank].astype(np.int64) for side in sides)
        kept_start = np.concatenate(([0], np.cumsum(count + 2 * padding)))
        kept_low = np.full(int(kept_start[-1]), 1 << 40)
        kept_high = -kept_low
        for shift in range(2 * padding + 1):
            lane = kept_start[facet] + rank + shift
            kept_low[lane] = np.minimum(kept_low[lane], low - padding)
            kept_high[lane] = np.maximum(kept_high[lane], high + padding)
        return _Lanes(start, low, high, kept_start, kept_low, kept_high)


class _Heap:
    """The facets of one page."""

    def __init__(
        self, wanted: PackInput, shapes: Shapes, on: IntArray, where: IntArray, corner: IntArray
    ) -> None:
        self.corner = corner.copy()
        self._size = shapes.size[on, where].astype(np.int64)
        self._padding, self._align = wanted.padding, wanted.align
        sides = shapes.left, shapes.right
        rows = _Lanes.of(shapes.start[on, where], self._size[:, 1], sides, wanted.padding)
        # Columns are the rows of the shape turned once more, seen from the other side.
        turned = where // 4 * 4 + (where + 1) % 4
        first = np.concatenate(([0], np.cumsum(self._size[:, 0])))
        facet, rank = segments(first)
        lane, height = shapes.start[on, turned][facet] + rank, shapes.size[on, where][facet, 1]
        sides = height - shapes.right[lane], height - shapes.left[lane]
        columns = _Lanes.of(first[:-1], self._size[:, 0], sides, wanted.padding)
        self._lanes = (rows, columns)

    def sweep(self) -> bool:
        """Push each facet up, then left, the highest first; whether anything moved."""
        moved = False
        for i in np.lexsort((self.corner[:, 0], self.corner[:, 1])).tolist():
            for axis in (1, 0):
                at = int(self.corner[i, axis])
                free = self._free(i, axis) if at else at
                moved |= free < at
                self.corner[i, axis] = min(free, at)
        return moved

    def _free(self, i: int, axis: int) -> int:
        """First place of a facet along an axis that is free, not further back than it may jump."""
        across, lanes, pad = 1 - axis, self._lanes[axis], self._padding
        at, size = int(self.corner[i, axis]), int(self._size[i, axis])
        limit = max(at - _REACH[axis] * size, 0)
        first = int(self.corner[i, across]) - pad
        stop = first + int(self._size[i, across]) + 2 * pad
        low, high = self.corner[:, across], self.corner[:, across] + self._size[:, across]
        near = (low < stop) & (high > first) & (self.corner[:, axis] < at + size)
        near &= self.corner[:, axis] + self._size[:, axis] > limit - pad
        near[i] = False
        others = np.flatnonzero(near)
        if not others.size:
            return -(-limit // self._align) * self._align
        begin, end = np.maximum(low[others], first), np.minimum(high[others], stop)
        other, rank = segments(np.concatenate(([0], np.cumsum(end - begin))))
        theirs = (lanes.start[others] + begin - low[others])[other] + rank
        mine = (lanes.kept_start[i] + begin - first)[other] + rank
        shift = self.corner[others, axis][other]
        a = lanes.low[theirs] + shift - lanes.kept_high[mine] + 1
        b = lanes.high[theirs] + shift - lanes.kept_low[mine] - 1
        return self._first_outside(a, b, limit)

    def _first_outside(self, a: IntArray, b: IntArray, limit: int) -> int:
        """Least multiple of the alignment from `limit` on that lies in none of the intervals a to b."""
        align = self._align
        a, b, limit = -(-a // align), b // align, -(-limit // align)
        closed = (a <= b) & (b >= limit)
        if not closed.any():
            return limit * align
        a, b = a[closed], b[closed]
        order = np.argsort(a, kind="stable")
        a, reach = a[order], np.maximum.accumulate(b[order])
        if a[0] > limit:
            return limit * align
        gap = np.flatnonzero(a[1:] > reach[:-1] + 1)
        return (int(reach[gap[0] if gap.size else -1]) + 1) * align
