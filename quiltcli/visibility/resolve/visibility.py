"""From a drawn canvas (a visibility buffer) to regions of it, and from these to what each pixel sees.

A microtile of the canvas is read in the way that costs least:

    one pair fills it       16 such, in a square          several pairs, or a pair and nothing
    ┌────┐                  ┌──┬──┬──┬──┐                 ┌────┐  ┌────┐
    │aaaa│                  │aa│aa│aa│aa│                 │aabb│  │aa··│
    │aaaa│ `WholeTiles`     ├──┼──┼──┼──┤ `WholeTiles`    │abbb│  │a···│ `MixedTiles`
    └────┘ side 1           │aa│aa│aa│aa│ side 4          └────┘  └────┘
                            └──┴──┴──┴──┘                 complete  not

Regions know where their pixels lie and which surface shows there, and nothing of colour: whoever shades
them asks for a part (`of`), for smaller ones (`split`), or for `hits`, the fragments that are visible.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.visibility.resolve.hits import Wanted
from quiltcli.visibility.resolve.pixels import MixedTiles
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.surfaces import has_one_normal
from quiltcli.visibility.resolve.tiles import Tiles, in_parts, tiles_at
from quiltcli.visibility.resolve.whole import AT_ONCE, WholeTiles, whole_tiles
from quiltcli.visibility.scan.keys import distinct, serial_of
from quiltcli.visibility.setup.blocks import Canvas

_MIXED = 1024  # microtiles of pixels that are read one by one, at a time
SQUARE = 4
"""Microtiles from side to side of the squares that are looked for: a power of two."""

Region: TypeAlias = WholeTiles | MixedTiles


@dataclass(frozen=True)
class _Kind:
    """How microtiles are to be read.

    Attributes:
        whole: whether one pair fills each, or each square of them.
        even: whether that pair's triangle has one normal.
        border: whether some of their pixels are not the facet's.
        side: microtiles from side to side of a square.
    """

    whole: bool
    even: bool = False
    border: bool = False
    side: int = 1

    def region(self, reader: Reader, tiles: Tiles, pair: IntArray) -> Region:
        """The region of these microtiles, or of the squares that begin with them; `pair` (n,) fill them."""
        if not self.whole:
            return MixedTiles(reader, tiles, complete=not self.border)
        return whole_tiles(reader, tiles, pair, even=self.even, border=self.border, side=self.side)


def read_canvas(reader: Reader, largest: int = SQUARE) -> Iterator[Region]:
    """All regions of a drawn canvas, a cache-sized number of microtiles at a time.

    Args:
        reader: the canvas.
        largest: microtiles from side to side of the squares that are looked for, SQUARE or 1 for none.
    """
    canvas = reader.canvas
    tiles = tiles_at(canvas, reader.blocks, canvas.drawn())
    if not tiles.index.size:
        return
    pair, complete = _sort_out(reader, tiles)
    for kind, rows in _kinds(reader, tiles, pair, complete, largest):
        for some in in_parts(rows, AT_ONCE if kind.whole else _MIXED):
            yield kind.region(reader, tiles[some], pair[some])


def _kinds(
    reader: Reader, tiles: Tiles, pair: IntArray, complete: BoolArray, largest: int
) -> Iterator[tuple[_Kind, IntArray]]:
    """Which of the microtiles (n,) are to be read in what way, or are the first of squares that are."""
    filled = pair >= 0
    even = np.zeros(filled.size, dtype=np.bool_)
    if Wanted.NORMAL in reader.wanted:
        some = np.flatnonzero(filled)
        rows, which = distinct(pair[some], reader.table.row_of_serial.size)
        even[some] = has_one_normal(reader, rows).take(which)
    # Whole squares first; what they leave is read by microtiles.
    alone = filled.copy()
    if largest > 1:
        squares = _squares(reader.canvas, tiles, np.where(tiles.interior, pair, -1), largest)
        alone[squares] = False
        first = squares[:, 0]
        for kind in (True, False):
            yield _Kind(whole=True, even=kind, side=largest), first[even[first] == kind]
    for border in (False, True):
        for kind in (True, False):
            chosen = alone & (tiles.interior != border) & (even == kind)
            yield _Kind(whole=True, even=kind, border=border), np.flatnonzero(chosen)
    yield _Kind(whole=False), np.flatnonzero(complete)
    yield _Kind(whole=False, border=True), np.flatnonzero(~complete & ~filled)


def _squares(canvas: Canvas, tiles: Tiles, pair: IntArray, side: int) -> IntArray:
    """Microtiles that together are squares of `side` by `side` filled by one pair.

    Args:
        canvas: the canvas.
        tiles: n microtiles.
        pair: (n,) the pair that fills each, −1 for none.
        side: microtiles from side to side of a square.

    Returns:
        (S, side²) places in `tiles`, those of the squares' first microtiles first.
    """
    # The canvas with the pair that fills each microtile, and each one's place in `tiles`.
    filled = np.full(canvas.touched.size, -1, dtype=np.int64)
    place = np.zeros(canvas.touched.size, dtype=np.int64)
    filled[tiles.index], place[tiles.index] = pair, np.arange(pair.size)
    # Squares begin at multiples of their side and end in their block.
    across, down = canvas.tiles_across.take(tiles.block), canvas.tiles_down.take(tiles.block)
    column, row = tiles.x >> 3, tiles.y >> 3
    first = (pair >= 0) & ((column | row) & (side - 1) == 0)
    first &= (column + side <= across) & (row + side <= down)
    first = np.flatnonzero(first)
    # Those of one pair throughout.
    offsets = np.arange(side)
    cells = tiles.index[first, None, None] + across[first, None, None] * offsets[:, None] + offsets
    cells = cells.reshape(-1, side**2)
    same = (filled.take(cells) == pair[first, None]).all(axis=1)
    found: IntArray = place.take(cells[same])
    return found


def _sort_out(reader: Reader, tiles: Tiles) -> tuple[IntArray, BoolArray]:
    """How the microtiles (n,) are to be read; those all of whose pixels see something are noted down as full.

    Returns:
        the pair that fills a microtile, a row of the canvas's planes, −1 where pixels have to be looked at;
        and among those, microtiles inside their facet all of whose pixels see something.
    """
    canvas, bits = reader.canvas, reader.bits
    # One pair is noted down to fill it, or all its keys are of one pair.
    serial = canvas.filler[tiles.index] - 1
    keyed = np.flatnonzero(serial < 0)
    keys = canvas.keys.take(tiles.index[keyed], axis=0)
    full = np.flatnonzero(keys.min(axis=1) > 0)
    keyed, keys = keyed[full], keys[full]
    canvas.full[tiles.index[keyed]] = True
    one = np.bitwise_or.reduce(keys ^ keys[:, :1], axis=1) & np.int64((1 << bits) - 1) == 0
    serial[keyed[one]] = serial_of(keys[one, 0], bits)
    complete = np.zeros(serial.size, dtype=np.bool_)
    complete[keyed[~one]] = True
    pair = np.where(serial < 0, -1, reader.table.row_of_serial.take(np.maximum(serial, 0)))
    return pair, complete & tiles.interior
