"""From a drawn canvas to what each pixel sees.

A microtile that one triangle fills inside a facet is read as a whole: its planes are looked up once
and evaluated over 64 pixels. The pixels of the others are read one by one; where all 64 see
something, they are handed on in runs of neighbours all the same, for those are stored fastest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, segments
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.hits import RUN, Hits, Places, Wanted
from quiltcli.raster.keys import serial_of
from quiltcli.raster.planes import Planes, PlaneTable
from quiltcli.raster.surfaces import has_one_normal, one_normal, surfaces
from quiltcli.raster.vectors import (
    BASIS,
    BlockVectors,
    PointVectors,
    TileVectors,
    Vectors,
    exact_values,
    grid_values,
    vector_values,
)

_WHOLE, _PIXELS = 2048, 512  # microtiles at a time
_MANY = 512  # microtiles of one triangle that are worth a part of their own
_DX, _DY = BASIS[0].astype(np.float32), BASIS[1].astype(np.float32)


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

    def take(self, rows: IntArray) -> Tiles:
        """The microtiles with these indices."""
        return Tiles(*(column.take(rows) for column in vars(self).values()))

    def lines(self) -> IntArray:
        """Quilt addresses (n, 8) of the first pixels of their rows."""
        step = self.stride[:1, None] if (self.stride == self.stride[:1]).all() else self.stride[:, None]
        result: IntArray = self.address[:, None] + step * np.arange(8)
        return result

    def places(self) -> Places:
        """All of their pixels."""
        return Places(self.lines().reshape(-1), RUN)

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
    bits: int
    wanted: Wanted


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
    tiles = _tiles(canvas, blocks, np.flatnonzero((canvas.touched | (canvas.filler > 0)) & canvas.used))
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
    for part in _parts(whole[inner & ~is_even], _WHOLE):
        yield _filled_tiles(reader, tiles.take(part), serial[part], even=False)
    for even in (True, False):
        for part in _parts(whole[~inner & (is_even == even)], _WHOLE):
            yield _border_tiles(reader, tiles.take(part), serial[part], even=even)
    for part in _parts(np.flatnonzero(complete), _PIXELS):
        yield _complete_tiles(reader, tiles.take(part))
    for part in _parts(np.flatnonzero(~complete & (serial < 0)), _PIXELS):
        hits = _scattered_pixels(reader, tiles.take(part))
        if hits.triangle.size:
            yield hits


def missed_pixels(canvas: Canvas, blocks: Blocks, wanted: BoolArray) -> Iterator[Places]:
    """The pixels of facets at which nothing was drawn.

    Args:
        canvas: what was drawn.
        blocks: the blocks.
        wanted: (K,) the blocks of the canvas that are asked about.
    """
    place, _ = segments(canvas.tile_start)
    bare = np.flatnonzero(canvas.used & (canvas.filler == 0) & ~canvas.full & wanted[place])
    tiles = _tiles(canvas, blocks, bare)
    empty = tiles.interior & ~canvas.touched[bare]
    for part in _parts(np.flatnonzero(empty), _WHOLE):
        yield tiles.take(part).places()
    for part in _parts(np.flatnonzero(~empty), _WHOLE):
        some = tiles.take(part)
        _, address, _ = _owned(blocks, some, canvas.keys.take(some.index, axis=0) == 0)
        yield Places(address, 1)


def _parts(rows: IntArray, step: int) -> Iterator[IntArray]:
    for at in range(0, rows.size, step):
        yield rows[at : at + step]


def _parts_by_triangle(rows: IntArray, triangle: Int32Array) -> Iterator[IntArray]:
    """Microtiles (n,) in parts; those of a triangle that fills many are by themselves.

    What a triangle has one of is one number for all pixels of such a part, and numbers are faster.
    """
    order = np.argsort(triangle, kind="stable")
    start = np.flatnonzero(np.diff(triangle[order], prepend=-1))
    count = np.diff(start, append=order.size)
    many = count >= _MANY
    for first, size in zip(start[many].tolist(), count[many].tolist(), strict=True):
        yield from _parts(rows[order[first : first + size]], _WHOLE)
    yield from _parts(rows[np.sort(order[np.repeat(~many, count)])], _WHOLE)


def _tiles(canvas: Canvas, blocks: Blocks, index: IntArray) -> Tiles:
    """Where the microtiles of a canvas with these indices lie."""
    place, rank = segments(canvas.tile_start)
    place, rank = place[index], rank[index]
    row, column = np.divmod(rank, canvas.tiles_across[place])
    block = canvas.block[place]
    x, y, stride = column * 8, row * 8, blocks.stride[block]
    number = canvas.number[index]
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
    pixel, address, inside = _owned(reader.blocks, tiles, np.ones(hits.depth.shape, dtype=np.bool_))
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
    inverse = grid_values(tiles.local(np.take(planes.inverse, rows, axis=1)))
    ray, depth, position = _rays(reader, tiles)
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


def _rays(reader: Reader, tiles: Tiles) -> tuple[BlockVectors, FloatArray, FloatArray | None]:
    """Rays d through the pixels of n microtiles.

    Returns:
        d, of any length; the depth (n, 64) of the points d; and these points (3, n, 64), the eye at the
        origin, where positions are wanted.
    """
    limits = reader.limits
    matrix = np.ascontiguousarray(limits.rays.transpose(1, 2, 0))
    ray = BlockVectors(matrix, tiles.block, tiles.x, tiles.y)
    exact = None
    if limits.radial or reader.wanted.position:
        exact = np.stack([exact_values(plane) for plane in ray.planes])
    if limits.radial and exact is not None:
        depth = np.sqrt(exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2])
    else:
        depth = exact_values(ray.along(limits.look))
    return ray, depth, exact if reader.wanted.position else None


def _complete_tiles(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of microtiles in their facets all of whose pixels see something."""
    keys = reader.canvas.keys.take(tiles.index, axis=0).reshape(-1)
    return _pixels(reader, tiles, keys, np.arange(keys.size), tiles.places(), keys.size)


def _scattered_pixels(reader: Reader, tiles: Tiles) -> Hits:
    """Hits of those pixels of microtiles that see something and that their facet owns."""
    keys = reader.canvas.keys.take(tiles.index, axis=0)
    pixel, address, inside = _owned(reader.blocks, tiles, keys != 0)
    keys = keys.reshape(-1).take(pixel)
    return _pixels(reader, tiles, keys, pixel, Places(address, 1), inside)


def _owned(blocks: Blocks, tiles: Tiles, drawn: BoolArray) -> tuple[IntArray, IntArray, int]:
    """Those of the `drawn` pixels (n, 64) of microtiles that their facet owns.

    Returns:
        the pixels, counted through all microtiles; their quilt addresses; how many are no bleed.
    """
    owned, inside = (
        np.unpackbits(bits.take(tiles.number, axis=0), axis=1).view(np.bool_)
        for bits in (blocks.owned, blocks.inside)
    )
    drawn &= owned
    inside &= drawn
    pixel = np.flatnonzero(drawn)
    address = tiles.lines().reshape(-1).take(pixel >> 3)
    address += pixel & 7
    return pixel, address, int(np.count_nonzero(inside))


def _pixels(
    reader: Reader, tiles: Tiles, keys: IntArray, pixel: IntArray, places: Places, inside: int
) -> Hits:
    """Hits of pixels of microtiles, each a group of its own.

    Args:
        reader: the canvas.
        tiles: n microtiles.
        keys: (G,) keys of the pixels.
        pixel: (G,) the pixels, counted through all microtiles, ascending.
        places: where they lie in the quilt.
        inside: pixels that are not bleed.
    """
    planes, wanted = reader.table.planes, reader.wanted
    serial, which = _distinct(serial_of(keys, reader.bits), reader.table.row_of_serial.size)
    rows = reader.table.row_of_serial.take(serial)
    x0, y0 = (planes.box[k].take(rows) for k in (0, 2))
    seen = surfaces(planes, rows, wanted, reader.limits.handed, x0, y0)
    complete = pixel.size == tiles.x.size * 64

    def chosen(values: NDArray[Any]) -> NDArray[Any]:
        """Of values (..., n, 64) those of the pixels, (..., G)."""
        values = values.reshape(*values.shape[:-2], -1)
        return values if complete else values.take(pixel, axis=-1)

    x, y = (
        chosen(tiles.x.astype(np.float32)[:, None] + _DX),
        chosen(tiles.y.astype(np.float32)[:, None] + _DY),
    )
    inverse = _inverse(planes, rows, which, x.astype(np.float64), y.astype(np.float64))[:, None]
    ray, depth, position = _rays(reader, tiles)
    normal = weights = None
    if wanted.normals is not None:
        normal = PointVectors(_values(seen.normal, which, x, y, x0, y0))
    if wanted.weights:
        second, third, total = _values(seen.weights, which, x, y, x0, y0)
        weights = np.stack((second / total, third / total)).astype(np.float32)
    return Hits(
        places=places,
        chosen=None,
        facet=chosen(np.broadcast_to(tiles.facet[:, None], (tiles.facet.size, 64))),
        triangle=seen.triangle.take(which),
        ray=PointVectors(chosen(vector_values(ray))[:, :, None]),
        depth=chosen(depth)[:, None] / inverse,
        normal=normal,
        weights=weights,
        position=None if position is None else chosen(position)[:, :, None] / inverse,
        inside=inside,
    )


def _inverse(planes: Planes, rows: IntArray, which: IntArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """1/t (G,), held between the least and the greatest of the triangle's corners.

    Args:
        planes: the planes of a batch.
        rows: (S,) the pairs that are seen.
        which: (G,) which of them each pixel sees.
        x: (G,) columns in the block.
        y: (G,) rows.
    """
    table = np.empty((rows.size, 5))
    for k, column in enumerate((*planes.inverse, planes.low, planes.high)):
        table[:, k] = column.take(rows)
    table = table.take(which, axis=0)
    result = _plane_values(table, x, y, np.empty(x.size))
    np.maximum(result, table[:, 3], out=result)
    np.minimum(result, table[:, 4], out=result)
    return result


def _values(
    planes: NDArray[Any],
    which: IntArray,
    x: Float32Array,
    y: Float32Array,
    x0: Int32Array,
    y0: Int32Array,
) -> NDArray[Any]:
    """Values (n, G, 1) of n planes (n, 3, S) of surfaces.

    Args:
        planes: the planes, from places of their own.
        which: (G,) which surface each pixel sees.
        x: (G,) columns in the block.
        y: (G,) rows.
        x0: (S,) columns at which the planes begin.
        y0: (S,) rows.
    """
    # One look-up of a row takes as long as one of a single number.
    count = 3 * len(planes)
    table = np.empty((x0.size, count + 2), dtype=planes.dtype)
    table[:, :count] = planes.reshape(count, -1).T
    table[:, count], table[:, count + 1] = x0, y0
    table = table.take(which, axis=0)
    x, y = x - table[:, count], y - table[:, count + 1]
    result = np.empty((len(planes), which.size, 1), dtype=planes.dtype)
    for k in range(len(planes)):
        _plane_values(table[:, 3 * k :], x, y, result[k, :, 0])
    return result


def _plane_values(rows: NDArray[Any], x: NDArray[Any], y: NDArray[Any], result: NDArray[Any]) -> NDArray[Any]:
    """Put into `result` (G,) the values of planes given in rows (G, 3 or more)."""
    np.multiply(rows[:, 0], x, out=result)
    result += rows[:, 1] * y
    result += rows[:, 2]
    return result


def _distinct(values: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """The distinct numbers among `values`, all below `count`, and the place of each value among them."""
    there = np.zeros(count, dtype=np.bool_)
    there[values] = True
    distinct = np.flatnonzero(there)
    place = np.empty(count, dtype=np.int64)
    place[distinct] = np.arange(distinct.size)
    return distinct, place.take(values)
