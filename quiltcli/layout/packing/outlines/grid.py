"""Pages as grids of cells, and where on them a shape fits.

A page is one whole number whose bits are its cells, row after row; a bit is set when a facet or its
padding reaches into the cell. Where a shape may go is then found for all cells at once: a row of it,
a run of m cells, fits nowhere that an occupied cell lies within the next m, and shifting and joining
numbers of many thousand bits is quick. The rule of placing is bottom-left, upside down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import Int32Array, IntArray
from quiltcli.layout.packing.model import PackInput
from quiltcli.layout.packing.outlines.shapes import NOWHERE

Runs: TypeAlias = list[tuple[int, int, int]]
"""Row, first cell and one past the last, relative to some cell."""

Sides: TypeAlias = Int32Array | IntArray


@dataclass(frozen=True)
class Cells:
    """One shape in one orientation on the grid, its top-left pixel at a cell's.

    Attributes:
        wide, tall: pixels of its raster.
        own: cells it touches.
    """

    wide: int
    tall: int
    own: Runs


def runs_of(y: IntArray, left: Sides, right: Sides, cell: int) -> Runs:
    """Rows of cells that rows of pixels reach into; of a row of pixels, `left` to `right` is taken."""
    touched = right > left
    row = y[touched] // cell
    first, count = int(row.min()), int(np.ptp(row)) + 1
    low, high = np.full(count, NOWHERE), np.full(count, -NOWHERE)
    np.minimum.at(low, row - first, left[touched] // cell)
    np.maximum.at(high, row - first, -(-right[touched] // cell))
    return [
        (first + at, a, b) for at, (a, b) in enumerate(zip(low.tolist(), high.tolist(), strict=True)) if b > a
    ]


def kept_runs(y: IntArray, left: Sides, right: Sides, padding: int, cell: int) -> Runs:
    """As `runs_of`, with padding around the rows of pixels."""
    ring = np.arange(-padding, padding + 1)
    around = (y + ring[:, None]).ravel()
    low = np.tile(left.astype(np.int64), ring.size) - padding
    high = np.tile(right.astype(np.int64), ring.size) + padding
    return runs_of(around, low, high, cell)


class Page:
    """The cells of one page, from row `base` on; rows above it are done with."""

    def __init__(self, size: tuple[int, int], cell: int, taken: int = 0) -> None:
        self.base = 0
        self.stride = -(-size[0] // cell)
        self._width, self._height = size
        self._cell = cell
        self._set(taken)

    def _set(self, taken: int) -> None:
        self._taken = taken
        self._reaches = [taken]  # cells within 1, 2, 4, … cells to the left of a taken one

    @property
    def empty(self) -> bool:
        """Whether nothing is on it."""
        return self._taken == 0 and self.base == 0

    @property
    def rows(self) -> int:
        """Rows from `base` to the lowest taken one."""
        return -(-self._taken.bit_length() // self.stride)

    def spot(self, cells: Cells) -> tuple[int, int] | None:
        """Row and column of the highest, then leftmost cell where a shape fits; None without room."""
        last = (self._width - cells.wide) // self._cell
        lowest = (self._height - cells.tall) // self._cell
        if last < 0 or lowest < 0:
            return None
        # No row below the lowest taken one is blocked, so the first of those is always a place.
        rows = self._taken.bit_length() // self.stride + 2
        line = ((1 << self.stride) - 1) ^ ((1 << (last + 1)) - 1)
        blocked = _repeated(line, self.stride, rows)
        for row, low, high in cells.own:
            reach = self._reach(high - low)
            blocked |= reach >> (row * self.stride + low)
        free = ~blocked & (blocked + 1)  # the lowest bit that is not set
        y, x = divmod(free.bit_length() - 1, self.stride)
        y += self.base
        return (y, x) if y <= lowest else None

    def _reach(self, length: int) -> int:
        """Cells with a taken one among the `length` that begin with them."""
        power = length.bit_length() - 1
        while len(self._reaches) <= power:
            wide = self._reaches[-1]
            self._reaches.append(wide | wide >> (1 << (len(self._reaches) - 1)))
        wide = self._reaches[power]
        return wide | wide >> (length - (1 << power)) if length > 1 << power else wide

    def take(self, runs: Runs, y: int, x: int) -> None:
        """Mark runs of cells, moved down by `y` rows and right by `x` cells."""
        taken, top = self._taken, y - self.base
        for row, low, high in runs:
            low, high = max(x + low, 0), min(x + high, self.stride)
            if top + row >= 0 and high > low:
                taken |= ((1 << (high - low)) - 1) << ((top + row) * self.stride + low)
        self._set(taken)

    def top(self, rows: int) -> Page:
        """A page of only so many rows from `base` on, with what is taken there."""
        page = Page((self._width, min(rows * self._cell, self._height)), self._cell)
        page._height = min((self.base + rows) * self._cell, self._height)
        page.base = self.base
        page._set(self._taken & ((1 << (rows * self.stride)) - 1))
        return page

    def forget(self, rows: int) -> None:
        """Be done with so many rows from `base` on."""
        self.base += rows
        self._set(self._taken >> (rows * self.stride))


@lru_cache(maxsize=1024)
def _repeated(bits: int, stride: int, rows: int) -> int:
    """The same bits on every row."""
    result, have = bits, 1
    while have < rows:
        more = min(have, rows - have)
        result |= (result & ((1 << (more * stride)) - 1)) << (have * stride)
        have += more
    return result


def best_spot(
    page: Page, orientations: Sequence[Cells], cell: int, lock: int = -1
) -> tuple[int, int, int, int] | None:
    """End, column, orientation and row of the best place on a page."""
    best = None
    for orientation, cells in enumerate(orientations):
        spot = page.spot(cells) if lock in (-1, orientation) else None
        if spot is not None:
            y, x = spot
            place = (y * cell + cells.tall, x, orientation, y)
            best = place if best is None else min(best, place)
    return best


def begun_pages(wanted: PackInput, cell: int) -> list[Page]:
    """Pages with everything taken but their rooms, in whole cells."""
    stride, rows = -(-wanted.page[0] // cell), -(-wanted.page[1] // cell)
    taken = [(1 << (stride * rows)) - 1] * wanted.begun
    for room in wanted.rooms:
        left, top = -(-room.left // cell), -(-room.top // cell)
        # A room that ends with the page ends with its last cell, though that may reach past it.
        right, bottom = (room.left + room.width) // cell, (room.top + room.height) // cell
        right = stride if room.left + room.width == wanted.page[0] else right
        bottom = rows if room.top + room.height == wanted.page[1] else bottom
        if right > left and bottom > top:
            line = ((1 << (right - left)) - 1) << left
            taken[room.page] &= ~(_repeated(line, stride, bottom - top) << (top * stride))
    return [Page(wanted.page, cell, bits) for bits in taken]
