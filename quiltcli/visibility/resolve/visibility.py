"""From a drawn canvas to what each pixel sees.

Microtiles that one triangle fills are read as wholes. The pixels of the others are read one by one;
where all 64 see something, they are handed on in runs of neighbours all the same, for those are stored
fastest.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.visibility.resolve.hits import Hits, Wanted
from quiltcli.visibility.resolve.pixels import pixel_hits
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.surfaces import has_one_normal
from quiltcli.visibility.resolve.tiles import Tiles, in_parts, owned_pixels, tiles_at
from quiltcli.visibility.resolve.whole import TileShader, shaded_hits, tile_hits, whole_tiles
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.keys import distinct, serial_of
from quiltcli.visibility.setup.blocks import Blocks, Canvas
from quiltcli.visibility.setup.planes import PlaneTable

_WHOLE, _PIXELS = 8192, 1024  # squares, or microtiles, at a time
SQUARE = 4
"""Microtiles from side to side of the squares that are looked for: a power of two."""


def read_canvas(
    canvas: Canvas,
    table: PlaneTable,
    blocks: Blocks,
    limits: DepthRange,
    bits: int,
    wanted: Wanted,
    shader: TileShader | None = None,
) -> Iterator[Hits]:
    """The hits of a drawn canvas, a cache-sized number at a time.

    Args:
        canvas: what was drawn.
        table: the planes of all pairs that were.
        blocks: the blocks.
        limits: how depth is measured, with the rays of the canvas's blocks.
        bits: bits of the serial in a key.
        wanted: what the hits shall tell.
        shader: shades whole microtiles by their nodes, where it is given.
    """
    tiles = tiles_at(canvas, blocks, canvas.drawn())
    if not tiles.index.size:
        return
    reader = Reader(canvas, table, blocks, limits, bits, wanted)
    serial, complete = _sort_out(reader, tiles)
    whole = np.flatnonzero(serial >= 0)
    is_even = np.zeros(whole.size, dtype=np.bool_)
    if wanted.normals is not None:
        filling, which = distinct(serial[whole], table.row_of_serial.size)
        triangle = table.planes.triangle.take(table.row_of_serial.take(filling))
        is_even = has_one_normal(wanted.normals, triangle).take(which)
    border = ~tiles.interior[whole]
    alone = np.ones(whole.size, dtype=np.bool_)
    if shader is not None:
        squares = _squares(canvas, tiles, np.where(border, -1, serial[whole]), whole)
        for even in (True, False):
            for some in in_parts(squares[is_even[squares[:, 0]] == even], _WHOLE):
                first = whole[some[:, 0]]
                found = whole_tiles(reader, tiles[first], serial[first], even=even, border=False, side=SQUARE)
                calm = shader.calm(found)
                alone[some[calm]] = False
                yield from shaded_hits(found, shader, calm)
    for at_border in (False, True):
        for even in (True, False):
            chosen = np.flatnonzero(alone & (border == at_border) & (is_even == even))
            for some in in_parts(whole[chosen], _WHOLE):
                found = whole_tiles(reader, tiles[some], serial[some], even=even, border=at_border, side=1)
                if shader is None:
                    yield from tile_hits(found)
                    continue
                calm = shader.calm(found)
                yield from shaded_hits(found, shader, calm)
                yield from tile_hits(found.of(~calm))
    for part in in_parts(np.flatnonzero(complete), _PIXELS):
        yield _complete_tiles(reader, tiles[part])
    for part in in_parts(np.flatnonzero(~complete & (serial < 0)), _PIXELS):
        hits = _scattered_pixels(reader, tiles[part])
        if hits.triangle.size:
            yield hits


def _squares(canvas: Canvas, tiles: Tiles, serial: IntArray, whole: IntArray) -> IntArray:
    """Microtiles that together are squares of SQUARE by SQUARE filled by one pair.

    Args:
        canvas: the canvas.
        tiles: where microtiles lie.
        serial: (n,) the pair that fills each of `whole`, −1 for none.
        whole: (n,) indices into `tiles`.

    Returns:
        (S, SQUARE²) places in `whole`, those of the squares' first microtiles first.
    """
    filled = np.full(canvas.touched.size, -1, dtype=np.int64)
    place = np.zeros(canvas.touched.size, dtype=np.int64)
    index, block = tiles.index[whole], tiles.block[whole]
    filled[index], place[index] = serial, np.arange(whole.size)
    across, down = canvas.tiles_across.take(block), canvas.tiles_down.take(block)
    column, row = tiles.x[whole] >> 3, tiles.y[whole] >> 3
    first = (serial >= 0) & ((column | row) & (SQUARE - 1) == 0)
    first &= (column + SQUARE <= across) & (row + SQUARE <= down)
    first = np.flatnonzero(first)
    offsets = np.arange(SQUARE)
    cells = index[first, None, None] + across[first, None, None] * offsets[:, None] + offsets
    cells = cells.reshape(-1, SQUARE**2)
    same = (filled.take(cells) == serial[first, None]).all(axis=1)
    found: IntArray = place.take(cells[same])
    return found


def _sort_out(reader: Reader, tiles: Tiles) -> tuple[IntArray, BoolArray]:
    """How the microtiles (n,) are to be read; those all of whose pixels see something are noted down as full.

    Returns:
        the serial of the pair that fills a microtile, −1 where pixels have to be looked at; and among
        those, microtiles inside their facet all of whose pixels see something.
    """
    canvas, bits = reader.canvas, reader.bits
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
    return serial, complete & tiles.interior


def _complete_tiles(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of microtiles in their facets all of whose pixels see something."""
    keys = reader.canvas.keys.take(tiles.index, axis=0).reshape(-1)
    return pixel_hits(reader, tiles, keys, np.arange(keys.size), tiles.places(), keys.size)


def _scattered_pixels(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of those pixels of microtiles that see something and that their facet owns."""
    keys = reader.canvas.keys.take(tiles.index, axis=0)
    pixel, places, inside = owned_pixels(reader.blocks, tiles, keys != 0)
    keys = keys.reshape(-1).take(pixel)
    return pixel_hits(reader, tiles, keys, pixel, places, inside)
