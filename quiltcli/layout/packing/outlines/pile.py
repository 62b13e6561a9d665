"""Many unlike facets: largest first where they end highest, the smallest into the holes that leaves.

A place is found on a grid of cells, then the facet is pushed up and left to the pixel. Only the lower
rows of a page are looked at. Before the rows above are done with, the largest of the facets still
waiting that fit one of their holes are put there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from quiltcli.geometry import offsets, segments
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.grid import Cells, Page, Runs, begun_pages, best_spot, kept_runs
from quiltcli.layout.packing.outlines.heap import Heap
from quiltcli.layout.packing.outlines.shapes import NOWHERE, Shapes

_SMALLER = 0.96
"""When a facet fits no hole, the next to be tried has at most this share of its area."""

_PUSHES = 3


@dataclass(frozen=True)
class Pile:
    """How to pile facets up.

    Attributes:
        shapes: what to place.
        cell: side of a cell, pixels.
        band: rows of cells above the lowest taken one in which places are looked for.
    """

    shapes: Shapes
    cell: int
    band: int
    _cells: list[list[Cells]] = field(default_factory=list)

    def run(self, wanted: PackInput) -> PackResult:
        """Place all facets."""
        if not self._cells:
            self._cells.extend(cells_of(self.shapes, self.cell))
        return _Piling(self, wanted, self._cells).result()


def cells_of(shapes: Shapes, cell: int) -> list[list[Cells]]:
    """Every shape in every orientation on the grid; computed for all at once."""
    tall = shapes.size[:, :, 1].astype(np.int64)
    count = -(-tall // cell)
    first = offsets(count.ravel())
    row, rank = segments(offsets(tall.ravel()))
    line = shapes.start.ravel()[row] + rank
    at = first[row] + rank // cell
    low, high = np.full(first[-1], NOWHERE), np.full(first[-1], -NOWHERE)
    np.minimum.at(low, at, shapes.left[line] // cell)
    np.maximum.at(high, at, -(-shapes.right[line] // cell))
    starts, lows, highs = first.tolist(), low.tolist(), high.tolist()
    cells = [
        Cells(wide, high, _touched(lows[start:stop], highs[start:stop]))
        for (wide, high), start, stop in zip(
            shapes.size.reshape(-1, 2).tolist(), starts[:-1], starts[1:], strict=True
        )
    ]
    orientations = shapes.size.shape[1]
    return [cells[at : at + orientations] for at in range(0, len(cells), orientations)]


def _touched(lows: list[int], highs: list[int]) -> Runs:
    return [(y, low, high) for y, (low, high) in enumerate(zip(lows, highs, strict=True)) if high > low]


class _Piling:
    """Facets while they are being placed."""

    def __init__(self, pile: Pile, wanted: PackInput, cells: list[list[Cells]]) -> None:
        self._pile, self._wanted, self._cells = pile, wanted, cells
        area = pile.shapes.area
        self._waiting: list[int] = np.lexsort((np.arange(area.size), -area)).tolist()
        self._area: list[int] = area.tolist()
        self._heap = Heap(wanted, pile.shapes)
        self._pages = begun_pages(wanted, pile.cell)

    def result(self) -> PackResult:
        """Where everything lies in the end."""
        while self._waiting:
            shape = self._waiting.pop(0)
            at = self._place(shape)
            page = self._pages[at]
            if page.rows >= 2 * self._pile.band and at >= self._wanted.begun:
                done = page.rows - self._pile.band
                self._fill(at, page.top(done + self._pile.band // 2))
                page.forget(done)
        heap = self._heap
        return PackResult(
            heap.page.astype(np.int32),
            (heap.where % 4).astype(np.int32),
            heap.where >= 4,
            heap.corner.astype(np.int32),
        )

    def _place(self, shape: int) -> int:
        """Put a shape on the first page that has room for it; the number of that page."""
        at = 0
        while True:
            if at == len(self._pages):
                self._pages.append(Page(self._wanted.page, self._pile.cell))
            spot = best_spot(self._pages[at], self._cells[shape], self._pile.cell)
            if spot is not None:
                self._put(shape, at, spot, [self._pages[at]])
                return at
            at += 1

    def _fill(self, at: int, part: Page) -> None:
        """Put waiting shapes into holes in the upper part of a page."""
        for index in self._candidates():
            shape = self._waiting[index]
            spot = best_spot(part, self._cells[shape], self._pile.cell)
            if spot is not None:
                self._put(shape, at, spot, [part, self._pages[at]])
                self._waiting[index] = -1
        self._waiting = [shape for shape in self._waiting if shape >= 0]

    def _candidates(self) -> Iterator[int]:
        """Waiting shapes, by index; after one that was not taken, the next is a good deal smaller."""
        index = 0
        while index < len(self._waiting):
            area = self._area[self._waiting[index]]
            yield index
            index += 1
            if self._waiting[index - 1] >= 0:
                while index < len(self._waiting) and self._area[self._waiting[index]] > _SMALLER * area:
                    index += 1

    def _put(self, shape: int, at: int, spot: tuple[int, int, int, int], pages: list[Page]) -> None:
        _, x, where, y = spot
        cell, shapes = self._pile.cell, self._pile.shapes
        self._heap.put(shape, at, where, (x * cell, y * cell))
        for _ in range(_PUSHES if at >= self._wanted.begun else 0):
            if not self._heap.push(shape):
                break
        rows = shapes.rows(shape, where)
        left, top = self._heap.corner[shape].tolist()
        lines = np.arange(top, top + rows.stop - rows.start)
        runs = kept_runs(
            lines, shapes.left[rows] + left, shapes.right[rows] + left, self._wanted.padding, cell
        )
        for page in pages:
            page.take(runs, 0, 0)
