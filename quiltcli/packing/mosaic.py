"""Facets on a grid of cells, each where it ends highest, holes included: for few facets of odd shapes.

A page is one whole number whose bits are its cells, row after row; a bit is set when a facet or its
padding reaches into the cell. Where a shape may go is then found for all cells at once: a row of it,
a run of m cells, fits nowhere that an occupied cell lies within the next m, and shifting and joining
numbers of many thousand bits is quick. The rule of placing is bottom-left, upside down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from quiltcli.geometry import Int32Array
from quiltcli.packing.model import PackInput, PackResult
from quiltcli.packing.shapes import NOWHERE, Shapes

Runs = list[tuple[int, int, int]]
"""Row, first cell and one past the last, relative to the cell of the shape's top-left pixel."""


@dataclass(frozen=True)
class Cells:
    """One shape in one orientation on the grid.

    Attributes:
        wide, tall: pixels of its raster.
        own: cells it touches.
        kept: cells it keeps others out of, padding included.
    """

    wide: int
    tall: int
    own: Runs
    kept: Runs


def cells_of(wanted: PackInput, shapes: Shapes, cell: int) -> list[list[Cells]]:
    """Cells of every shape in every orientation, for cells of `cell` × `cell` pixels."""
    return [
        [
            _cells(shapes, shape, orientation, wanted.padding, cell)
            for orientation in range(shapes.size.shape[1])
        ]
        for shape in range(len(shapes.size))
    ]


def _cells(shapes: Shapes, shape: int, orientation: int, padding: int, cell: int) -> Cells:
    wide, tall = (int(side) for side in shapes.size[shape, orientation])
    rows = shapes.rows(shape, orientation)
    left, right = shapes.left[rows], shapes.right[rows]
    ring = np.arange(-padding, padding + 1)
    y = np.arange(tall)
    around = (y + ring[:, None]).ravel()
    kept_left = np.tile(left, ring.size) - padding
    kept_right = np.tile(right, ring.size) + padding
    return Cells(wide, tall, _runs(y, left, right, cell), _runs(around, kept_left, kept_right, cell))


def _runs(y: np.ndarray, left: Int32Array, right: Int32Array, cell: int) -> Runs:
    """Rows of pixels gathered to rows of cells."""
    touched = right > left
    row = y[touched] // cell
    first, count = int(row.min()), int(np.ptp(row)) + 1
    low, high = np.full(count, NOWHERE), np.full(count, -NOWHERE)
    np.minimum.at(low, row - first, left[touched] // cell)
    np.maximum.at(high, row - first, -(-right[touched] // cell))
    return [(first + at, int(a), int(b)) for at, (a, b) in enumerate(zip(low, high, strict=True)) if b > a]


class _Page:
    """The cells of one page, from row `_base` on; rows above it are done with."""

    def __init__(self, size: tuple[int, int], cell: int, taken: int = 0, band: int = 0) -> None:
        self._base, self._band = 0, band
        self._width, self._height = size
        self._cell = cell
        self._stride = -(-size[0] // cell)
        self._set(taken)

    def _set(self, taken: int) -> None:
        self._taken = taken
        self._reaches = [taken]  # cells within 1, 2, 4, … cells to the left of a taken one

    @property
    def empty(self) -> bool:
        """Whether nothing is on it."""
        return self._taken == 0 and self._base == 0

    def spot(self, cells: Cells) -> tuple[int, int] | None:
        """Row and column of the highest, then leftmost cell where a shape fits; None without room."""
        last = (self._width - cells.wide) // self._cell
        lowest = (self._height - cells.tall) // self._cell
        if last < 0 or lowest < 0:
            return None
        # No row below the lowest taken one is blocked, so the first of those is always a place.
        rows = self._taken.bit_length() // self._stride + 2
        line = ((1 << self._stride) - 1) ^ ((1 << (last + 1)) - 1)
        blocked = _repeated(line, self._stride, rows)
        for row, low, high in cells.own:
            reach = self._reach(high - low)
            blocked |= reach >> (row * self._stride + low)
        free = ~blocked & (blocked + 1)  # the lowest bit that is not set
        y, x = divmod(free.bit_length() - 1, self._stride)
        y += self._base
        return (y, x) if y <= lowest else None

    def _reach(self, length: int) -> int:
        """Cells with a taken one among the `length` that begin with them."""
        power = length.bit_length() - 1
        while len(self._reaches) <= power:
            wide = self._reaches[-1]
            self._reaches.append(wide | wide >> (1 << (len(self._reaches) - 1)))
        wide = self._reaches[power]
        return wide | wide >> (length - (1 << power)) if length > 1 << power else wide

    def take(self, cells: Cells, y: int, x: int) -> None:
        """Mark the cells of a placed shape and of its padding."""
        taken, top = self._taken, y - self._base
        for row, low, high in cells.kept:
            low, high = max(x + low, 0), min(x + high, self._stride)
            if top + row >= 0 and high > low:
                taken |= ((1 << (high - low)) - 1) << ((top + row) * self._stride + low)
        done = taken.bit_length() // self._stride - self._band if self._band else 0
        if done > 0:
            self._base += done
            taken >>= done * self._stride
        self._set(taken)


@lru_cache(maxsize=1024)
def _repeated(bits: int, stride: int, rows: int) -> int:
    """The same bits on every row."""
    result, have = bits, 1
    while have < rows:
        more = min(have, rows - have)
        result |= (result & ((1 << (more * stride)) - 1)) << (have * stride)
        have += more
    return result


def pack_mosaic(
    wanted: PackInput,
    cells: list[list[Cells]],
    cell: int,
    order: Sequence[int],
    locks: Sequence[int],
    band: int = 0,
) -> PackResult:
    """Place shapes in this order, each on the first page that has room for it.

    Of a shape's orientations the one that ends highest is taken, then the leftmost, then the first.
    A lock is the only orientation a shape may have, −1 for any; one that fits no page is ignored.
    With a band, only so many rows of cells above the lowest taken one are looked at, which is quicker.
    """
    count = len(order)
    page, where = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    pages = _begun_pages(wanted, cell)
    for shape in order:
        at, best = 0, None
        while best is None:
            if at == len(pages):
                pages.append(_Page(wanted.page, cell, band=band))
            best = _best(pages[at], cells[shape], cell, locks[shape])
            fresh = at >= wanted.begun and pages[at].empty
            best = _best(pages[at], cells[shape], cell, -1) if best is None and fresh else best
            at += 1
        _, x, orientation, y = best
        pages[at - 1].take(cells[shape][orientation], y, x)
        page[shape], where[shape], corner[shape] = at - 1, orientation, (x * cell, y * cell)
    return PackResult(page, where % 4, where >= 4, corner)


def _best(page: _Page, orientations: list[Cells], cell: int, lock: int) -> tuple[int, int, int, int] | None:
    """End, column, orientation and row of the best place on a page."""
    best = None
    for orientation, cells in enumerate(orientations):
        spot = page.spot(cells) if lock in (-1, orientation) else None
        if spot is not None:
            y, x = spot
            place = (y * cell + cells.tall, x, orientation, y)
            best = place if best is None else min(best, place)
    return best


def _begun_pages(wanted: PackInput, cell: int) -> list[_Page]:
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
    return [_Page(wanted.page, cell, bits) for bits in taken]
