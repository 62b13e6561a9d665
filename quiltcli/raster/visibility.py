"""From a drawn canvas to what each pixel sees.

A microtile that one triangle fills inside a facet is read as a whole: its planes are looked up once
and evaluated over 64 pixels. The pixels of the others are read one by one; where all 64 see
something, they are handed on in runs of neighbours all the same, for those are stored fastest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, OwnerArray, segments
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.hits import BASIS, RUN, Hits, Wanted, exact_values, vector_values
from quiltcli.raster.keys import serial_of
from quiltcli.raster.planes import PlaneTable
from quiltcli.raster.surfaces import has_one_normal, one_normal, surfaces

_WHOLE, _PIXELS = 2048, 256  # microtiles at a time
_DX, _DY = BASIS[0].astype(np.int64), BASIS[1].astype(np.int64)


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
    """

    index: IntArray
    block: IntArray
    x: IntArray
    y: IntArray
    address: IntArray
    stride: IntArray
    facet: Int32Array
    interior: BoolArray

    def take(self, rows: IntArray | BoolArray) -> Tiles:
        """The microtiles with these indices, or where this is true."""
        return Tiles(*(column[rows] for column in vars(self).values()))

    def lines(self) -> IntArray:
        """Quilt addresses (n, 8) of the first pixels of their rows."""
        result: IntArray = self.address[:, None] + self.stride[:, None] * np.arange(8)
        return result

    def local(self, planes: FloatArray) -> FloatArray:
        """Planes (..., 3, n) from the microtiles' first pixels, of planes over their blocks."""
        result = planes.copy()
        result[..., 2, :] += result[..., 0, :] * self.x + result[..., 1, :] * self.y
        return result


@dataclass(frozen=True)
class Reader:
    """What is needed to read a canvas; `read_canvas` says what its attributes are."""

    canvas: Canvas
    table: PlaneTable
    blocks: Blocks
    limits: DepthRange
    owners: OwnerArray
    bits: int
    wanted: Wanted


def read_canvas(
    canvas: Canvas,
    table: PlaneTable,
    blocks: Blocks,
    limits: DepthRange,
    owners: OwnerArray,
    bits: int,
    wanted: Wanted,
) -> Iterator[Hits]:
    """The hits of a drawn canvas, a cache-sized number at a time.

    Args:
        canvas: what was drawn.
        table: the planes of all pairs that were.
        blocks: the blocks.
        limits: how depth is measured, with the rays of the canvas's blocks.
        owners: who owns each quilt pixel; keys outside their facet and its bleed are dropped.
        bits: bits of the serial in a key.
        wanted: what the hits shall tell.
    """
    tiles = _drawn_tiles(canvas, blocks)
    if not tiles.index.size:
        return
    reader = Reader(canvas, table, blocks, limits, owners, bits, wanted)
    serial, complete = _sort_out(reader, tiles)
    whole = np.flatnonzero(serial >= 0)
    is_even = _even(reader, serial[whole])
    for even in (True, False):
        for part in _parts(whole[is_even == even], _WHOLE):
            yield from _whole_tiles(reader, tiles.take(part), serial[part], even=even)
    for part in _parts(np.flatnonzero(complete), _PIXELS):
        yield _complete_tiles(reader, tiles.take(part))
    for part in _parts(np.flatnonzero(~complete & (serial < 0)), _PIXELS):
        hits = _scattered_pixels(reader, tiles.take(part))
        if hits.first.size:
            yield hits


def _parts(rows: IntArray, step: int) -> Iterator[IntArray]:
    for at in range(0, rows.size, step):
        yield rows[at : at + step]


def _drawn_tiles(canvas: Canvas, blocks: Blocks) -> Tiles:
    """The microtiles of a canvas in which anything was drawn."""
    index = np.flatnonzero(canvas.touched | (canvas.filler > 0))
    place, rank = segments(canvas.tile_start)
    place, rank = place[index], rank[index]
    row, column = np.divmod(rank, canvas.tiles_across[place])
    block = canvas.block[place]
    x, y, stride = column * 8, row * 8, blocks.stride[block]
    return Tiles(
        index=index,
        block=place,
        x=x,
        y=y,
        address=blocks.address[block] + y * stride + x,
        stride=stride,
        facet=blocks.facet[block],
        interior=blocks.interior[blocks.tile_start[block] + rank],
    )


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


def _even(reader: Reader, serial: IntArray) -> BoolArray:
    """Which pairs' triangles have one normal all over; none where no normals are wanted."""
    if reader.wanted.normals is None:
        return np.zeros(serial.size, dtype=np.bool_)
    table = reader.table
    triangle = table.planes.triangle.take(table.row_of_serial.take(serial))
    return has_one_normal(reader.wanted.normals, triangle)


def _whole_tiles(reader: Reader, tiles: Tiles, serial: IntArray, *, even: bool) -> Iterator[Hits]:
    """Hits of microtiles (n,) that are filled by one pair each; `even` where each pair has one normal.

    Of microtiles at the border of a facet, only the pixels that the facet owns.
    """
    inner, border = np.flatnonzero(tiles.interior), np.flatnonzero(~tiles.interior)
    if inner.size:
        yield _filled_tiles(reader, tiles.take(inner), serial[inner], even=even)
    if border.size:
        some = tiles.take(border)
        hits = _filled_tiles(reader, some, serial[border], even=even)
        pixel, address, inside = _owned(reader, some, np.ones(hits.depth.shape, dtype=np.bool_))
        if pixel.size:
            yield hits.pixels(pixel, address, inside)


def _filled_tiles(reader: Reader, tiles: Tiles, serial: IntArray, *, even: bool) -> Hits:
    """Hits of all pixels of microtiles (G,) that are filled by one pair each."""
    planes, wanted = reader.table.planes, reader.wanted
    rows = reader.table.row_of_serial.take(serial)
    normal = None
    if even and wanted.normals is not None:
        normal = one_normal(wanted.normals, planes, rows, reader.limits.handed)
        wanted = replace(wanted, normals=None)
    seen = surfaces(planes, rows, wanted, reader.limits.handed)
    if wanted.normals is not None:
        normal = vector_values(tiles.local(seen.normal))
    inverse = exact_values(tiles.local(seen.inverse))
    ray, depth, position = _rays(reader, tiles)
    depth /= inverse
    weights = None
    if wanted.weights:
        second, third, total = (exact_values(plane) for plane in tiles.local(seen.weights))
        weights = np.stack((second / total, third / total)).astype(np.float32)
    return Hits(
        first=tiles.lines().reshape(-1),
        run=RUN,
        facet=tiles.facet,
        triangle=seen.triangle,
        ray=ray,
        depth=depth,
        normal=normal,
        weights=weights,
        position=None if position is None else position / inverse,
        inside=depth.size,
    )


def _rays(reader: Reader, tiles: Tiles) -> tuple[Float32Array, FloatArray, FloatArray | None]:
    """Rays d through the pixels of n microtiles.

    Returns:
        d (3, n, 64) of any length; the depth (n, 64) of the points d; and these points (3, n, 64), the
        eye at the origin, where positions are wanted.
    """
    limits = reader.limits
    matrix = np.ascontiguousarray(limits.rays.transpose(1, 2, 0))
    ray = tiles.local(np.take(matrix, tiles.block, axis=2))
    exact = None
    if limits.radial or reader.wanted.position:
        exact = np.stack([exact_values(plane) for plane in ray])
    if limits.radial and exact is not None:
        depth = np.sqrt(exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2])
    else:
        look = limits.look
        depth = exact_values(look[0] * ray[0] + look[1] * ray[1] + look[2] * ray[2])
    return vector_values(ray), depth, exact if reader.wanted.position else None


def _complete_tiles(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of microtiles in their facets all of whose pixels see something."""
    keys = reader.canvas.keys.take(tiles.index, axis=0).reshape(-1)
    return _pixels(reader, tiles, keys, None, tiles.lines().reshape(-1), keys.size)


def _scattered_pixels(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of those pixels of microtiles that see something and that their facet owns."""
    keys = reader.canvas.keys.take(tiles.index, axis=0)
    pixel, address, inside = _owned(reader, tiles, keys != 0)
    return _pixels(reader, tiles, keys.reshape(-1).take(pixel), pixel, address, inside)


def _owned(reader: Reader, tiles: Tiles, drawn: BoolArray) -> tuple[IntArray, IntArray, int]:
    """Those of the `drawn` pixels (n, 64) of microtiles that lie in their block and that its facet owns.

    Returns:
        the pixels, counted through all microtiles; their quilt addresses; how many are no bleed.
    """
    block = reader.canvas.block[tiles.block]
    drawn &= (reader.blocks.width[block] - tiles.x)[:, None] > _DX
    drawn &= (reader.blocks.height[block] - tiles.y)[:, None] > _DY
    pixel = np.flatnonzero(drawn)
    address = (tiles.lines()[:, :, None] + np.arange(8)).reshape(-1).take(pixel)
    owner = reader.owners.take(address)
    own = np.flatnonzero(np.abs(owner) == tiles.facet.take(pixel >> 6) + 1)
    return pixel.take(own), address.take(own), int(np.count_nonzero(owner.take(own) > 0))


def _pixels(
    reader: Reader, tiles: Tiles, keys: IntArray, pixel: IntArray | None, first: IntArray, inside: int
) -> Hits:
    """Hits of pixels of microtiles, each a group of its own.

    Args:
        reader: the canvas.
        tiles: n microtiles.
        keys: (G,) keys of the pixels.
        pixel: (G,) the pixels, counted through all microtiles; None for all 64·n of them.
        first: addresses of the pixels, or of runs of them where they are all.
        inside: pixels that are not bleed.
    """
    if pixel is None:
        pixel = np.arange(keys.size)
    table = reader.table
    serial, which = _distinct(serial_of(keys, reader.bits), table.row_of_serial.size)
    seen = surfaces(table.planes, table.row_of_serial.take(serial), reader.wanted, reader.limits.handed)
    numbers = seen.numbers.take(which, axis=0)
    x = (tiles.x[:, None] + _DX).reshape(-1).take(pixel).astype(np.float64)
    y = (tiles.y[:, None] + _DY).reshape(-1).take(pixel).astype(np.float64)

    def values(column: int) -> FloatArray:
        result = numbers[:, column] * x
        result += numbers[:, column + 1] * y
        result += numbers[:, column + 2]
        return np.asarray(result[:, None])

    inverse = values(2)
    np.maximum(inverse, numbers[:, 0:1], out=inverse)
    np.minimum(inverse, numbers[:, 1:2], out=inverse)
    ray, depth, position = _rays(reader, tiles)
    normal = weights = None
    if reader.wanted.normals is not None:
        normal = np.stack([values(column).astype(np.float32) for column in (5, 8, 11)])
    if reader.wanted.weights:
        second, third, total = (values(numbers.shape[1] - k) for k in (9, 6, 3))
        weights = np.stack((second / total, third / total)).astype(np.float32)
    return Hits(
        first=first,
        run=RUN if first.size < keys.size else 1,
        facet=tiles.facet.take(pixel >> 6),
        triangle=seen.triangle.take(which),
        ray=ray.reshape(3, -1, 1).take(pixel, axis=1),
        depth=depth.reshape(-1, 1).take(pixel, axis=0) / inverse,
        normal=normal,
        weights=weights,
        position=None if position is None else position.reshape(3, -1, 1).take(pixel, axis=1) / inverse,
        inside=inside,
    )


def _distinct(values: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """The distinct numbers among `values`, all below `count`, and the place of each value among them."""
    there = np.zeros(count, dtype=np.bool_)
    there[values] = True
    distinct = np.flatnonzero(there)
    place = np.empty(count, dtype=np.int64)
    place[distinct] = np.arange(distinct.size)
    return distinct, place.take(values)
