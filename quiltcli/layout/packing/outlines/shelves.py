"""Interlocking shelves: facets side by side in rows, each pushed left until it touches.

Facets stand in rows as high as their highest. A row keeps, for every row of pixels, where the free
part begins: its front. The next facet is the one, among the next few by height, that leaves the
least of the front unused, in whatever orientation, standing on the row's bottom or hanging from its
top. Triangles so alternate head up and head down by themselves. The idea of scanning a front is that
of skyline packing (Jylänki 2010, §2.3) with outlines in the place of rectangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import IntArray, offsets, segments
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.shapes import NOWHERE, Shapes
from quiltcli.layout.packing.rectangles.rooms import Strip, Strips


@dataclass(frozen=True)
class ShelfRule:
    """How a facet is chosen for a row.

    Attributes:
        window: facets looked at for each place, the next ones by height.
        slack: tenths of the height a facet leaves free in its row that count as lost.
        levels: heights in the row that are tried: 2 is bottom and top.
        reach: windows looked through for something that still fits a row's end.
    """

    window: int = 12
    slack: int = 3
    levels: int = 2
    reach: int = 4


def pack_shelves(wanted: PackInput, shapes: Shapes, rule: ShelfRule) -> PackResult:
    """Place facets in interlocking rows, highest first, each row in the first room with place for it."""
    count = len(wanted.size)
    page, where = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    strips = Strips(wanted)
    begins = best_for_rows(shapes, wanted.padding)
    waiting = _by_height(shapes, begins)
    while waiting:
        strip, height = _room_for(strips, shapes, waiting[0], int(begins[waiting[0]]))
        row = _Row(wanted, shapes, rule, strip.room.width, height)
        for shape, orientation, x, y in row.fill(waiting):
            page[shape], where[shape] = strip.room.page, orientation
            corner[shape] = strip.room.left + x, strip.top + y
        step = height + wanted.padding
        strip.top += -(-step // wanted.align) * wanted.align
        waiting = row.waiting
    return PackResult(page, where % 4, where >= 4, corner)


def best_for_rows(shapes: Shapes, padding: int) -> IntArray:
    """Orientation (n,), 0 or 1, in which a row of nothing but this shape is filled best.

    Such a row holds the shape upright and upside down in turn, or always upright if that is denser.
    A triangle gets one of its sides onto the row's bottom, though it may be higher so.
    """
    taken = []
    for turn in (0, 1):
        start, height = shapes.start[:, turn], shapes.size[:, turn, 1].astype(np.int64)
        row, y = segments(offsets(height))
        upright, turned = start[row] + y, shapes.start[row, turn + 2] + y
        first = np.cumsum(height) - height
        # Steps to the right from one to the next; rows that are not touched are never the greatest.
        steps = [
            np.maximum.reduceat(shapes.right[a] - shapes.left[b], first).astype(np.int64) + padding
            for a, b in ((upright, turned), (turned, upright), (upright, upright))
        ]
        taken.append((height + padding) * np.minimum(steps[0] + steps[1], 2 * steps[2]))
    lower = shapes.size[:, 1, 1] < shapes.size[:, 0, 1]
    return np.where(taken[0] == taken[1], lower, taken[1] < taken[0]).astype(np.int64)


def _by_height(shapes: Shapes, begins: IntArray) -> list[int]:
    """Shapes by the height of the row they would begin, then by area, largest first."""
    index = np.arange(len(begins))
    order: list[int] = np.lexsort((index, -shapes.area, -shapes.size[index, begins, 1])).tolist()
    return order


def _room_for(strips: Strips, shapes: Shapes, shape: int, begins: int) -> tuple[Strip, int]:
    """The first strip a shape fits, and the height of the row it then begins."""
    width, height = shapes.size[shape].T
    for at in range(len(strips.open) + 1):
        strip = strips.open[at] if at < len(strips.open) else strips.more()
        fits = (width <= strip.room.width) & (height <= strip.height)
        if fits.any():
            return strip, int(height[begins] if fits[begins] else height[fits].min())
    raise AssertionError("a facet larger than the page")


class _Row:
    """One row while it is filled.

    A window of shapes is looked at. Those that are alike are tried once: each kind has a block of
    places, one for every orientation and level. `_edge` holds, for every place, the shape's left side
    on the rows of pixels it would take, so that all places are tried on the front at once.
    """

    def __init__(self, wanted: PackInput, shapes: Shapes, rule: ShelfRule, width: int, height: int) -> None:
        self._shapes, self._rule = shapes, rule
        self._padding, self._align = wanted.padding, wanted.align
        self._width, self._height = width, height
        self._places = shapes.size.shape[1] * rule.levels
        count = rule.window * self._places
        self._edge = np.full((count, height), NOWHERE, dtype=np.int32)
        self._low = np.zeros(count, dtype=np.int64)  # first row of pixels of each place
        self._tall = np.zeros(count, dtype=np.int64)  # and how many there are
        self._wide = np.full(count, NOWHERE, dtype=np.int64)
        self._taken = np.zeros(count, dtype=np.int64)  # sum of the left side, where there is one
        self._area = np.ones(count, dtype=np.int64)
        self._front = np.zeros(height, dtype=np.int32)
        self._slot: list[int] = [-1] * rule.window
        self._kind: list[int] = [-1] * rule.window  # of the shape in each block
        self._slots: dict[int, set[int]] = {}  # where shapes of a kind are
        self._done: set[int] = set()  # kinds that fit nowhere any more, for the front only moves on
        self._passed: list[int] = []
        self._next = 0
        self._order: list[int] = []

    @property
    def waiting(self) -> list[int]:
        """Shapes that found no place in the row, in their order."""
        left = set(self._passed) | {shape for shape in self._slot if shape >= 0}
        return [shape for shape in self._order[: self._next] if shape in left] + self._order[self._next :]

    def fill(self, waiting: list[int]) -> list[tuple[int, int, int, int]]:
        """Shape, orientation, x and y in the row of everything that is placed."""
        self._order = waiting
        placed: list[tuple[int, int, int, int]] = []
        for slot in range(self._rule.window):
            self._refill(slot)
        reach = self._rule.reach
        while any(shape >= 0 for shape in self._slot):
            best = self._best(first=not placed)
            if best is None:
                # Nothing of this window fits the end of the row: perhaps something smaller does.
                if reach == 0:
                    break
                reach -= 1
                for slot in range(self._rule.window):
                    self._pass(slot)
                    self._refill(slot)
                continue
            place, x = best
            slot, y = self._first_slot(place), int(self._low[place])
            orientation = place % self._places // self._rule.levels
            placed.append((self._slot[slot], orientation, x, y))
            self._advance(self._slot[slot], orientation, x, y)
            self._take_out(slot, place // self._places)
            self._refill(slot)
        return placed

    def _first_slot(self, place: int) -> int:
        """The first slot with a shape of the kind that a place is for."""
        return min(self._slots[self._kind[place // self._places]])

    def _pass(self, slot: int) -> None:
        if self._slot[slot] >= 0:
            self._passed.append(self._slot[slot])

    def _take_out(self, slot: int, block: int) -> None:
        """Empty a slot; its kind's block too, when no other slot has that kind."""
        kind = self._kind[block]
        self._slots[kind].discard(slot)
        if not self._slots[kind]:
            self._clear(block)

    def _clear(self, block: int) -> None:
        """Leave a block to another kind."""
        del self._slots[self._kind[block]]
        self._kind[block] = -1
        self._wide[block * self._places : (block + 1) * self._places] = NOWHERE

    def _refill(self, slot: int) -> None:
        """Put the next waiting shape into a slot, unless it is of a kind that fits nowhere any more."""
        if self._next == len(self._order):
            self._slot[slot] = -1
            return
        shape = self._slot[slot] = self._order[self._next]
        self._next += 1
        kind = int(self._shapes.first_alike[shape])
        if kind in self._slots:
            self._slots[kind].add(slot)
        elif kind not in self._done:
            block = self._kind.index(-1)
            self._kind[block] = kind
            self._slots[kind] = {slot}
            self._describe(shape, block * self._places)

    def _describe(self, shape: int, first: int) -> None:
        """Write down a shape's places, from `first` on: every orientation and level that fits the row."""
        self._area[first : first + self._places] = self._shapes.area[shape]
        levels = self._rule.levels
        for orientation, (wide, tall) in enumerate(self._shapes.size[shape].tolist()):
            free = self._height - tall
            if free < 0:
                continue
            left = self._shapes.left[self._shapes.rows(shape, orientation)]
            at = first + orientation * levels
            lows = [0]
            if free:
                lows = [free * level // (levels - 1) // self._align * self._align for level in range(levels)]
            part = slice(at, at + len(lows))
            self._edge[part] = NOWHERE
            for place, low in enumerate(lows, at):
                self._edge[place, low : low + tall] = left
            self._low[part], self._tall[part], self._wide[part] = lows, tall, wide
            self._taken[part] = self._shapes.taken[shape, orientation]

    def _best(self, first: bool) -> tuple[int, int] | None:
        """The place that wastes least for its shape's size, and its x; None when nothing fits.

        Kinds that fit nowhere are done with.
        """
        blocks = max((block for block, kind in enumerate(self._kind) if kind >= 0), default=-1) + 1
        if not blocks:
            return None
        use = slice(blocks * self._places)
        x = (self._front - self._edge[use]).max(axis=1).astype(np.int64)
        np.maximum(x, 0, out=x)
        if self._align > 1:
            x = -(-x // self._align) * self._align
        fits = x + self._wide[use] <= self._width
        if first:  # the shape the row was begun for, whose block is the first
            fits[self._places :] = False
        else:
            for block in np.flatnonzero(~fits.reshape(blocks, -1).any(axis=1)).tolist():
                if self._kind[block] >= 0:
                    self._done.add(self._kind[block])
                    self._clear(block)
        if not fits.any():
            return None
        low, tall = self._low[use], self._tall[use]
        before = offsets(self._front)
        wasted = tall * x + self._taken[use] - before[low + tall] + before[low]
        ahead = np.maximum(x + self._wide[use] + self._padding - int(self._front.max()), 0)
        slack = self._rule.slack * (self._height - tall) * ahead
        cost = np.where(fits, (10 * wasted + slack) / self._area[use], np.inf)
        least = np.flatnonzero(cost == cost.min()).tolist()
        best = min(least, key=lambda place: (self._first_slot(place), place))
        return best, int(x[best])

    def _advance(self, shape: int, orientation: int, x: int, y: int) -> None:
        """Move the front past a placed shape, and past the padding around it on every side."""
        right = self._shapes.right[self._shapes.rows(shape, orientation)]
        reach = x + right + self._padding
        for shift in range(-self._padding, self._padding + 1):
            low, high = max(y + shift, 0), min(y + shift + right.size, self._height)
            if low < high:
                rows = reach[low - y - shift : high - y - shift]
                np.maximum(self._front[low:high], rows, out=self._front[low:high])
