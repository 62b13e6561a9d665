"""From depth keys to what each pixel sees.

A microtile that one triangle fills inside a facet is read as a whole: its planes are looked up once
and evaluated over 64 pixels by broadcasting. Only the pixels of the others are read one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray, OwnerArray, segments
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.hits import Hits
from quiltcli.raster.keys import serial_of
from quiltcli.raster.planes import Planes

_CHUNK = 1 << 14
_X: FloatArray = np.arange(8.0)
_Y: FloatArray = np.arange(8.0)[:, None]


@dataclass(frozen=True)
class _Tiles:
    """Where the M microtiles of a canvas lie.

    Attributes:
        place: (M,) place of the block in the batch.
        x: (M,) first column in the block.
        y: (M,) first row in the block.
        address: (M,) quilt address of the first pixel.
        stride: (M,) pixels from one row of the page to the next.
        facet: (M,) facet index.
        width: (M,) columns of the block.
        height: (M,) rows of the block.
    """

    place: IntArray
    x: IntArray
    y: IntArray
    address: IntArray
    stride: IntArray
    facet: Int32Array
    width: IntArray
    height: IntArray


@dataclass(frozen=True)
class _Rows:
    """The planes of a batch in rows, one look-up each.

    Attributes:
        of_serial: (S,) row of every serial.
        numbers: (N, 14) planes of the sum of the edges, the second and the third edge, and 1/t, and
            the bounds of 1/t.
        triangle: (N,) triangle index.
    """

    of_serial: IntArray
    numbers: FloatArray
    triangle: Int32Array


def read_canvas(
    canvas: Canvas, chunks: list[Planes], blocks: Blocks, rays: FloatArray, owners: OwnerArray, bits: int
) -> Iterator[Hits]:
    """The hits of a drawn canvas, a cache-sized number at a time.

    Args:
        canvas: keys of the batch.
        chunks: its planes.
        blocks: the blocks.
        rays: (K, 3, 3) from pixels of the batch's blocks to rays.
        owners: who owns each quilt pixel; keys outside their facet and its bleed are dropped.
        bits: bits of the serial in a key.
    """
    keys = canvas.keys.reshape(-1, 64)
    drawn = np.flatnonzero(keys.any(axis=1))
    if not drawn.size:
        return
    tiles = _tiles(canvas, blocks)
    rows = _rows(chunks)
    whole = _filled_by_one(keys, drawn, bits) & blocks.interior[blocks_tiles(canvas, blocks)[drawn]]
    full = drawn[whole]
    for at in range(0, full.size, _CHUNK // 64):
        tile = full[at : at + _CHUNK // 64]
        yield _whole_tiles(tile, rows.of_serial[serial_of(keys[tile, 0], bits)], tiles, rows, rays)
    rest = drawn[~whole]
    local = np.flatnonzero(keys[rest])
    address = rest[local >> 6] * 64 + (local & 63)
    for at in range(0, address.size, _CHUNK):
        part = address[at : at + _CHUNK]
        row = rows.of_serial[serial_of(canvas.keys[part], bits)]
        hits = _single_pixels(part, row, tiles, rows, rays, owners)
        if hits.pixel.size:
            yield hits


def blocks_tiles(canvas: Canvas, blocks: Blocks) -> IntArray:
    """Index (M,) of every microtile of a canvas among those of all blocks."""
    place, rank = segments(canvas.tile_start)
    result: IntArray = blocks.tile_start[canvas.block[place]] + rank
    return result


def _filled_by_one(keys: IntArray, drawn: IntArray, bits: int) -> BoolArray:
    """Which of the `drawn` microtiles hold one serial in all their pixels."""
    some = keys if drawn.size == len(keys) else keys[drawn]
    differences = np.bitwise_or.reduce(some ^ some[:, :1], axis=1)
    result: BoolArray = (differences & np.int64((1 << bits) - 1)) == 0
    return result


def _tiles(canvas: Canvas, blocks: Blocks) -> _Tiles:
    """The microtiles of a canvas."""
    place, rank = segments(canvas.tile_start)
    row, column = np.divmod(rank, canvas.tiles_across[place])
    block = canvas.block[place]
    x, y, stride = column * 8, row * 8, blocks.stride[block]
    address = blocks.address[block] + y * stride + x
    return _Tiles(
        place, x, y, address, stride, blocks.facet[block], blocks.width[block], blocks.height[block]
    )


def _rows(chunks: list[Planes]) -> _Rows:
    """The planes of a batch as rows."""
    serial = np.concatenate([c.serial for c in chunks])
    of_serial = np.zeros(int(serial.max()) + 1, dtype=np.int64)
    of_serial[serial] = np.arange(serial.size)
    numbers = np.empty((serial.size, 14))
    first = 0
    for c in chunks:
        part = numbers[first : first + c.serial.size]
        part[:, 0:3] = (c.edge[0] + c.edge[1] + c.edge[2]).T
        part[:, 3:6], part[:, 6:9], part[:, 9:12] = c.edge[1].T, c.edge[2].T, c.inverse.T
        part[:, 12], part[:, 13] = c.low, c.high
        first += c.serial.size
    return _Rows(of_serial, numbers, np.concatenate([c.triangle for c in chunks]))


def _whole_tiles(tile: IntArray, row: IntArray, tiles: _Tiles, rows: _Rows, rays: FloatArray) -> Hits:
    """Hits of microtiles (R,) that are filled by one pair each, a row of 64 pixels for each."""
    numbers = rows.numbers[row].T.copy()
    x, y = tiles.x[tile].astype(np.float64), tiles.y[tile].astype(np.float64)
    count = tile.size

    def over_tile(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
        lines = b[:, None, None] * _Y + (a * x + b * y + c)[:, None, None]
        result: FloatArray = (lines + a[:, None, None] * _X).reshape(count, 64)
        return result

    inverse = over_tile(*numbers[9:12])
    np.clip(inverse, numbers[12, :, None], numbers[13, :, None], out=inverse)
    b, c = _weights(over_tile(*numbers[0:3]), over_tile(*numbers[3:6]), over_tile(*numbers[6:9]))
    matrix = rays[tiles.place[tile]].transpose(1, 2, 0)
    position = np.stack([over_tile(*matrix[i]) for i in range(3)])
    position /= inverse
    offset = tiles.stride[tile][:, None, None] * np.arange(8)[:, None] + np.arange(8)
    pixel = (tiles.address[tile][:, None, None] + offset).reshape(count, 64)
    return Hits(pixel, tiles.facet[tile], rows.triangle[row], b, c, position, pixel.size)


def _single_pixels(
    address: IntArray, row: IntArray, tiles: _Tiles, rows: _Rows, rays: FloatArray, owners: OwnerArray
) -> Hits:
    """Hits of single pixels at these canvas addresses, where their facet owns the pixel."""
    tile = address >> 6
    dx, dy = address & 7, address >> 3 & 7
    x, y = tiles.x[tile] + dx, tiles.y[tile] + dy
    pixel = tiles.address[tile] + dy * tiles.stride[tile] + dx
    facet = tiles.facet[tile]
    there = np.flatnonzero((x < tiles.width[tile]) & (y < tiles.height[tile]))
    owner = owners[pixel[there]]
    own = np.flatnonzero(np.abs(owner) == facet[there] + 1)
    inside = int(np.count_nonzero(owner[own] > 0))
    own = there[own]
    numbers = rows.numbers[row[own]].T.copy()
    fx, fy = x[own].astype(np.float64), y[own].astype(np.float64)

    def at_pixel(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
        result: FloatArray = a * fx + b * fy + c
        return result

    inverse = np.clip(at_pixel(*numbers[9:12]), numbers[12], numbers[13])
    b, c = _weights(at_pixel(*numbers[0:3]), at_pixel(*numbers[3:6]), at_pixel(*numbers[6:9]))
    matrix = np.ascontiguousarray(rays[tiles.place[tile[own]]].transpose(1, 2, 0))
    position = np.stack([at_pixel(*matrix[i]) for i in range(3)])
    position /= inverse
    return Hits(
        pixel[own][:, None],
        facet[own],
        rows.triangle[row[own]],
        b[:, None],
        c[:, None],
        position[..., None],
        inside,
    )


def _weights(total: FloatArray, second: FloatArray, third: FloatArray) -> tuple[Float32Array, Float32Array]:
    """Barycentric weights of the second and third corner: their edge functions' shares of the sum."""
    np.reciprocal(total, out=total)
    return (second * total).astype(np.float32), (third * total).astype(np.float32)
