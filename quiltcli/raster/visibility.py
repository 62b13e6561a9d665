"""From a drawn canvas to what each pixel sees.

Microtiles that one triangle fills are read as wholes. The pixels of the others are read one by one;
where all 64 see something, they are handed on in runs of neighbours all the same, for those are stored
fastest.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.hits import Hits, Places, Wanted
from quiltcli.raster.keys import serial_of
from quiltcli.raster.pixels import pixel_hits
from quiltcli.raster.planes import PlaneTable
from quiltcli.raster.reader import Reader
from quiltcli.raster.surfaces import has_one_normal
from quiltcli.raster.tiles import Tiles, in_parts, owned_pixels, tiles_at
from quiltcli.raster.whole import TileShader, tile_hits, whole_tiles

_WHOLE, _PIXELS = 4096, 512  # microtiles at a time


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
    tiles = tiles_at(canvas, blocks, np.flatnonzero((canvas.touched | (canvas.filler > 0)) & canvas.used))
    if not tiles.index.size:
        return
    reader = Reader(canvas, table, blocks, limits, bits, wanted)
    serial, complete = _sort_out(reader, tiles)
    whole = np.flatnonzero(serial >= 0)
    triangle = table.planes.triangle.take(table.row_of_serial.take(serial[whole]))
    is_even = np.zeros(whole.size, dtype=np.bool_)
    if wanted.normals is not None:
        is_even = has_one_normal(wanted.normals, triangle)
    border = ~tiles.interior[whole]
    for at_border, even in ((False, True), (False, False), (True, True), (True, False)):
        chosen = whole[(border == at_border) & (is_even == even)]
        for some in in_parts(chosen, _WHOLE):
            found = whole_tiles(reader, tiles[some], serial[some], even=even, border=at_border)
            yield from tile_hits(found, shader)
    for part in in_parts(np.flatnonzero(complete), _PIXELS):
        yield _complete_tiles(reader, tiles[part])
    for part in in_parts(np.flatnonzero(~complete & (serial < 0)), _PIXELS):
        hits = _scattered_pixels(reader, tiles[part])
        if hits.triangle.size:
            yield hits


def _sort_out(reader: Reader, tiles: Tiles) -> tuple[IntArray, BoolArray]:
    """How the microtiles (n,) are to be read.

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
    pixel, address, inside = owned_pixels(reader.blocks, tiles, keys != 0)
    keys = keys.reshape(-1).take(pixel)
    return pixel_hits(reader, tiles, keys, pixel, Places(address, 1), inside)
