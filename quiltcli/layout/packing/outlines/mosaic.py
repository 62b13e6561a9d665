"""Facets on a grid of cells, each where it ends highest, holes included: for few facets of odd shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.grid import (
    Cells,
    Page,
    Runs,
    begun_pages,
    best_spot,
    kept_runs,
    runs_of,
)
from quiltcli.layout.packing.outlines.shapes import Shapes


@dataclass(frozen=True)
class Piece(Cells):
    """A shape on the grid, and `kept`: the cells it keeps others out of, padding included."""

    kept: Runs


def pieces_of(wanted: PackInput, shapes: Shapes, cell: int) -> list[list[Piece]]:
    """Every shape in every orientation, for cells of `cell` × `cell` pixels."""
    return [
        [_piece(shapes, shape, where, wanted.padding, cell) for where in range(shapes.size.shape[1])]
        for shape in range(len(shapes.size))
    ]


def _piece(shapes: Shapes, shape: int, where: int, padding: int, cell: int) -> Piece:
    wide, tall = (int(side) for side in shapes.size[shape, where])
    rows = shapes.rows(shape, where)
    left, right = shapes.left[rows], shapes.right[rows]
    y = np.arange(tall)
    return Piece(wide, tall, runs_of(y, left, right, cell), kept_runs(y, left, right, padding, cell))


def pack_mosaic(
    wanted: PackInput,
    pieces: list[list[Piece]],
    cell: int,
    order: Sequence[int],
    locks: Sequence[int],
) -> PackResult:
    """Place shapes in this order, each on the first page that has room for it.

    Of a shape's orientations the one that ends highest is taken, then the leftmost, then the first.
    A lock is the only orientation a shape may have, −1 for any; one that fits no page is ignored.
    """
    count = len(order)
    page, where = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    pages = begun_pages(wanted, cell)
    for shape in order:
        at, best = 0, None
        while best is None:
            if at == len(pages):
                pages.append(Page(wanted.page, cell))
            best = best_spot(pages[at], pieces[shape], cell, locks[shape])
            fresh = at >= wanted.begun and pages[at].empty
            best = best_spot(pages[at], pieces[shape], cell) if best is None and fresh else best
            at += 1
        _, x, orientation, y = best
        pages[at - 1].take(pieces[shape][orientation].kept, y, x)
        page[shape], where[shape], corner[shape] = at - 1, orientation, (x * cell, y * cell)
    return PackResult(page, where % 4, where >= 4, corner)
