"""Facets where they lie, to the pixel, and how far each can be pushed up or to the left.

The way of a facet is found for all places at once: each of its rows or columns of pixels, against the
same one of a neighbour, forbids an interval of places, and the first place outside all of them is free.
So a facet may jump into a hole. The place a facet has is always free: pushing never does harm.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import IntArray, offsets, segments
from quiltcli.layout.packing.model import PackInput
from quiltcli.layout.packing.outlines.shapes import Shapes

_REACH = (1, 2)
"""How far a facet may jump to the left and up, in its own sizes."""

_FAR = 1 << 40


class Heap:
    """Some or all of the facets, on pages.

    Attributes:
        page: (n,) 0-based page, −1 for facets that lie nowhere yet.
        where: (n,) orientation.
        corner: (n, 2) top-left pixel.
    """

    def __init__(self, wanted: PackInput, shapes: Shapes) -> None:
        count = len(wanted.size)
        self.page = np.full(count, -1, dtype=np.int64)
        self.where = np.zeros(count, dtype=np.int64)
        self.corner = np.zeros((count, 2), dtype=np.int64)
        self._end = np.zeros((count, 2), dtype=np.int64)
        self._shapes, self._padding, self._align = shapes, wanted.padding, wanted.align

    def put(self, facet: int, page: int, where: int, corner: tuple[int, int]) -> None:
        """Lay a facet down where nothing is in its way."""
        self.page[facet], self.where[facet], self.corner[facet] = page, where, corner
        self._end[facet] = self.corner[facet] + self._shapes.size[facet, where]

    def push(self, facet: int) -> bool:
        """Push a facet up, then left; whether it moved."""
        moved = False
        for axis in (1, 0):
            at = int(self.corner[facet, axis])
            free = self._free(facet, axis) if at else at
            if free < at:
                self.corner[facet, axis] -= at - free
                self._end[facet, axis] -= at - free
                moved = True
        return moved

    def _free(self, facet: int, axis: int) -> int:
        """First place of a facet along an axis that is free, not further back than it may jump."""
        across, pad = 1 - axis, self._padding
        at, end = int(self.corner[facet, axis]), int(self._end[facet, axis])
        limit = max(at - _REACH[axis] * (end - at), 0)
        low, high = self.corner[:, across], self._end[:, across]
        first, stop = int(low[facet]) - pad, int(high[facet]) + pad
        near = (low < stop) & (high > first) & (self.page == self.page[facet])
        near &= (self.corner[:, axis] < end) & (self._end[:, axis] > limit - pad)
        near[facet] = False
        others = np.flatnonzero(near)
        if not others.size:
            return -(-limit // self._align) * self._align
        begin, end_of = np.maximum(low[others], first), np.minimum(high[others], stop)
        other, rank = segments(offsets(end_of - begin))
        theirs_low, theirs_high = self._lanes(others[other], (begin - low[others])[other] + rank, axis)
        mine_low, mine_high = self._kept(facet, axis)
        mine = (begin - first)[other] + rank
        shift = self.corner[others, axis][other]
        return self._first_outside(
            theirs_low + shift - mine_high[mine] + 1, theirs_high + shift - mine_low[mine] - 1, limit
        )

    def _lanes(self, facet: IntArray, lane: IntArray, axis: int) -> tuple[IntArray, IntArray]:
        """First pixel that facets touch in these of their rows (axis 0) or columns, and one past the last."""
        where = self.where[facet]
        if axis == 0:
            row = self._shapes.start[facet, where] + lane
            return self._shapes.left[row].astype(np.int64), self._shapes.right[row].astype(np.int64)
        # Columns are the rows of the shape turned once more, seen from the other side.
        row = self._shapes.start[facet, where // 4 * 4 + (where + 1) % 4] + lane
        height = self._shapes.size[facet, where, 1].astype(np.int64)
        return height - self._shapes.right[row], height - self._shapes.left[row]

    def _kept(self, facet: int, axis: int) -> tuple[IntArray, IntArray]:
        """As `_lanes`, of one facet with its padding around, which has lanes of its own on both sides."""
        pad, count = self._padding, int((self._end - self.corner)[facet, 1 - axis])
        low, high = self._lanes(np.full(count, facet), np.arange(count), axis)
        kept_low, kept_high = np.full(count + 2 * pad, _FAR), np.full(count + 2 * pad, -_FAR)
        for shift in range(2 * pad + 1):
            lanes = slice(shift, shift + count)
            np.minimum(kept_low[lanes], low - pad, out=kept_low[lanes])
            np.maximum(kept_high[lanes], high + pad, out=kept_high[lanes])
        return kept_low, kept_high

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
