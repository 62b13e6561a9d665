"""Where the microtiles of a canvas lie in the quilt, which of their pixels facets own, and which are bare."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Int32Array, IntArray, slices
from quiltcli.visibility.resolve.hits import RUN, Places
from quiltcli.visibility.setup.blocks import Blocks, Canvas

_AT_A_TIME = 2048
_WHOLE_ROW = np.ones(8, dtype=np.bool_).view(np.int64)[0]


@dataclass(frozen=True)
class Tiles:
    """Where n microtiles lie.

    Attributes:
        index: (n,) their index in the canvas.
        block: (n,) place of the block in the batch.
        x: (n,) first column in the block.
        y: (n,) first row in the block.
        address: (n,) quilt address of the first pixel.
        stride: (n,) pixels from one row of the page to the next.
        facet: (n,) facet index.
        interior: (n,) those all of whose pixels lie in the facet.
        number: (n,) their index among the microtiles of all blocks.
    """

    index: IntArray
    block: IntArray
    x: IntArray
    y: IntArray
    address: IntArray
    stride: IntArray
    facet: Int32Array
    interior: BoolArray
    number: IntArray

    def __getitem__(self, part: slice | IntArray) -> Tiles:
        """Some of the microtiles."""
        return Tiles(*(column[part] for column in vars(self).values()))

    def split(self, side: int, across: IntArray) -> Tiles:
        """All microtiles (n·side²,) of squares that begin with these; `across` (n,) are in a block's row."""
        row, column = np.divmod(np.arange(side * side), side)
        further = across[:, None] * row + column

        def each(first: IntArray, step: IntArray) -> IntArray:
            return np.asarray((first[:, None] + step).reshape(-1))

        return Tiles(
            index=each(self.index, further),
            block=self.block.repeat(side * side),
            x=each(self.x, 8 * column),
            y=each(self.y, 8 * row),
            address=each(self.address, 8 * (self.stride[:, None] * row + column)),
            stride=self.stride.repeat(side * side),
            facet=self.facet.repeat(side * side),
            interior=self.interior.repeat(side * side),
            number=each(self.number, further),
        )

    def lines(self, side: int = 1) -> IntArray:
        """Quilt addresses (n, 8·side) of the first pixels of the rows of squares that begin with them."""
        step = self.stride[:1, None] if (self.stride == self.stride[:1]).all() else self.stride[:, None]
        result: IntArray = self.address[:, None] + step * np.arange(8 * side)
        return result

    def places(self, side: int = 1) -> Places:
        """All pixels of these squares."""
        return Places(self.lines(side).reshape(-1), RUN * side)


def tiles_at(canvas: Canvas, blocks: Blocks, index: IntArray) -> Tiles:
    """Where the microtiles of a canvas with these indices lie."""
    place, number = canvas.place[index], canvas.number[index]
    block = canvas.block[place]
    row, column = np.divmod(number - blocks.tile_start[block], canvas.tiles_across[place])
    x, y, stride = column * 8, row * 8, blocks.stride[block]
    return Tiles(
        index=index,
        block=place,
        x=x,
        y=y,
        address=blocks.address[block] + y * stride + x,
        stride=stride,
        facet=blocks.facet[block],
        interior=blocks.interior[number],
        number=number,
    )


def owned_pixels(blocks: Blocks, tiles: Tiles, drawn: BoolArray) -> tuple[IntArray, Places, int]:
    """Those of the `drawn` pixels (n, 64) of microtiles that their facet owns.

    Returns:
        the pixels, counted through all microtiles, whole rows first; where they lie in the quilt; how many
        are no bleed.
    """
    owned, inside = (
        np.unpackbits(bits.take(tiles.number, axis=0), axis=1).view(np.bool_)
        for bits in (blocks.owned, blocks.inside)
    )
    drawn &= owned
    inside &= drawn
    rows = drawn.reshape(-1, 8)
    whole = rows.view(np.int64)[:, 0] == _WHOLE_ROW
    row, single = np.flatnonzero(whole), np.flatnonzero(rows & ~whole[:, None])
    lines = tiles.lines().reshape(-1)
    places = Places(lines.take(row), RUN, lines.take(single >> 3) + (single & 7))
    pixel = np.concatenate(((8 * row[:, None] + np.arange(8)).reshape(-1), single))
    return pixel, places, int(np.count_nonzero(inside))


def missed_pixels(canvas: Canvas, blocks: Blocks, wanted: BoolArray, first: int) -> Iterator[Places]:
    """The pixels of facets at which nothing was drawn.

    Args:
        canvas: what was drawn.
        blocks: the blocks.
        wanted: (m,) the microtiles asked about, among so many of all blocks that the canvas's are all there.
        first: the index of the first of these.
    """
    asked = wanted.take(canvas.number - first)
    bare = np.flatnonzero(asked & canvas.used & (canvas.filler == 0) & ~canvas.full)
    tiles = tiles_at(canvas, blocks, bare)
    empty = tiles.interior & ~canvas.touched[bare]
    for part in in_parts(np.flatnonzero(empty), _AT_A_TIME):
        yield tiles[part].places()
    for part in in_parts(np.flatnonzero(~empty), _AT_A_TIME):
        some = tiles[part]
        yield owned_pixels(blocks, some, canvas.keys.take(some.index, axis=0) == 0)[1]


def in_parts(rows: IntArray, step: int) -> Iterator[IntArray]:
    """The rows, at most `step` at a time."""
    for part in slices(0, len(rows), step):
        yield rows[part]
