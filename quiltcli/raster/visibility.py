"""From a drawn canvas to what each pixel sees.

A microtile that one triangle fills inside a facet is read as a whole: its planes are looked up once
and evaluated over 64 pixels. The pixels of the others are read one by one; where all 64 see
something, they are handed on in runs of neighbours all the same, for those are stored fastest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quiltcli.geometry import BoolArray, Int32Array, IntArray
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.hits import Hits, Places, Wanted
from quiltcli.raster.keys import serial_of
from quiltcli.raster.pixels import pixel_hits
from quiltcli.raster.planes import PlaneTable, moved
from quiltcli.raster.reader import Reader, rays_through
from quiltcli.raster.surfaces import has_one_normal, one_normal, surfaces
from quiltcli.raster.tiles import Tiles, in_parts, owned_pixels, tiles_at
from quiltcli.raster.vectors import TileVectors, Vectors, exact_values, grid_values

_WHOLE, _PIXELS = 2048, 512  # microtiles at a time
_MANY = 512  # microtiles of one triangle that are worth a part of their own


def read_canvas(
    canvas: Canvas,
    table: PlaneTable,
    blocks: Blocks,
    limits: DepthRange,
    bits: int,
    wanted: Wanted,
) -> Iterator[Hits]:
    """The hits of a drawn canvas, a cache-sized number at a time.

    Args:
        canvas: what was drawn.
        table: the planes of all pairs that were.
        blocks: the blocks.
        limits: how depth is measured, with the rays of the canvas's blocks.
        bits: bits of the serial in a key.
        wanted: what the hits shall tell.
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
    inner = tiles.interior[whole]
    for part in _parts_by_triangle(whole[inner & is_even], triangle[inner & is_even]):
        yield _filled_tiles(reader, tiles.take(part), serial[part], even=True)
    for part in in_parts(whole[inner & ~is_even], _WHOLE):
        yield _filled_tiles(reader, tiles.take(part), serial[part], even=False)
    for even in (True, False):
        for part in in_parts(whole[~inner & (is_even == even)], _WHOLE):
            yield _border_tiles(reader, tiles.take(part), serial[part], even=even)
    for part in in_parts(np.flatnonzero(complete), _PIXELS):
        yield _complete_tiles(reader, tiles.take(part))
    for part in in_parts(np.flatnonzero(~complete & (serial < 0)), _PIXELS):
        hits = _scattered_pixels(reader, tiles.take(part))
        if hits.triangle.size:
            yield hits


def _parts_by_triangle(rows: IntArray, triangle: Int32Array) -> Iterator[IntArray]:
    """Microtiles (n,) in parts; those of a triangle that fills many are by themselves.

    What a triangle has one of is one number for all pixels of such a part, and numbers are faster.
    """
    order = np.argsort(triangle, kind="stable")
    start = np.flatnonzero(np.diff(triangle[order], prepend=-1))
    count = np.diff(start, append=order.size)
    many = count >= _MANY
    for first, size in zip(start[many].tolist(), count[many].tolist(), strict=True):
        yield from in_parts(rows[order[first : first + size]], _WHOLE)
    yield from in_parts(rows[np.sort(order[np.repeat(~many, count)])], _WHOLE)


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


def _border_tiles(reader: Reader, tiles: Tiles, serial: IntArray, *, even: bool) -> Hits:
    """As `_filled_tiles`, of microtiles at the border of a facet: only the pixels that the facet owns."""
    hits = _filled_tiles(reader, tiles, serial, even=even)
    pixel, address, inside = owned_pixels(reader.blocks, tiles, np.ones(hits.depth.shape, dtype=np.bool_))
    return replace(hits, places=Places(address, 1), chosen=pixel, inside=inside)


def _filled_tiles(reader: Reader, tiles: Tiles, serial: IntArray, *, even: bool) -> Hits:
    """Hits of all pixels of microtiles (G,) that are filled by one pair each.

    With `even`, each of their triangles has one normal.
    """
    planes, wanted, handed = reader.table.planes, reader.wanted, reader.limits.handed
    rows = reader.table.row_of_serial.take(serial)
    normal: Vectors | None = None
    if even and wanted.normals is not None:
        normal = one_normal(wanted.normals, planes, rows, handed)
        wanted = replace(wanted, normals=None)
    seen = surfaces(planes, rows, wanted, handed, tiles.x, tiles.y)
    if wanted.normals is not None:
        normal = TileVectors(seen.normal.astype(np.float64))
    inverse = grid_values(moved(np.take(planes.inverse, rows, axis=1), tiles.x, tiles.y))
    ray, depth, position = rays_through(reader, tiles)
    depth /= inverse
    weights = None
    if wanted.weights:
        second, third, total = (exact_values(plane) for plane in seen.weights)
        weights = np.stack((second / total, third / total)).astype(np.float32)
    return Hits(
        places=tiles.places(),
        chosen=None,
        facet=tiles.facet,
        triangle=seen.triangle,
        ray=ray,
        depth=depth,
        normal=normal,
        weights=weights,
        position=None if position is None else position / inverse,
        inside=depth.size,
    )


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
