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
_EIGHT: FloatArray = np.arange(8.0)[:, None]
_DX: IntArray = np.tile(np.arange(8), 8)[:, None]
_DY: IntArray = np.repeat(np.arange(8), 8)[:, None]


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

    def addresses(self, tile: IntArray) -> IntArray:
        """Quilt addresses (64, G) of the pixels of microtiles (G,)."""
        lines = self.address[tile] + self.stride[tile] * np.arange(8)[:, None]
        return (lines[:, None] + np.arange(8)[:, None]).reshape(64, -1)


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
    for at in range(0, rest.size, _CHUNK // 64):
        tile = rest[at : at + _CHUNK // 64]
        hits = _single_pixels(tile, keys[tile].T.copy(), tiles, rows, rays, owners, bits)
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
    """Hits of microtiles (G,) that are filled by one pair each, a group of 64 pixels for each."""
    numbers = rows.numbers[row].T.copy()
    x, y = tiles.x[tile].astype(np.float64), tiles.y[tile].astype(np.float64)
    inverse = _over_tiles(numbers[9:12], x, y)
    np.clip(inverse, numbers[12], numbers[13], out=inverse)
    b, c = _weights(*(_over_tiles(numbers[k : k + 3], x, y) for k in (0, 3, 6)))
    position = _rays(tile, tiles, rays, x, y)
    position /= inverse
    pixel = tiles.addresses(tile)
    return Hits(pixel, tiles.facet[tile], rows.triangle[row], b, c, position, pixel.size)


def _over_tiles(plane: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Values (64, G) of planes (3, G) at the pixels of microtiles that start at x, y (G,)."""
    a, b, c = plane
    lines = b * _EIGHT
    lines += a * x + b * y + c
    result: FloatArray = (lines[:, None] + a * _EIGHT).reshape(64, -1)
    return result


def _rays(tile: IntArray, tiles: _Tiles, rays: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Eye rays (3, 64, G) through the pixels of microtiles (G,) that start at x, y."""
    matrix = np.ascontiguousarray(rays[tiles.place[tile]].transpose(1, 2, 0))
    return np.stack([_over_tiles(line, x, y) for line in matrix])


def _single_pixels(
    tile: IntArray,
    keys: IntArray,
    tiles: _Tiles,
    rows: _Rows,
    rays: FloatArray,
    owners: OwnerArray,
    bits: int,
) -> Hits:
    """Hits of the drawn pixels of microtiles (M,) with keys (64, M), where their facet owns the pixel."""
    x, y = tiles.x[tile] + _DX, tiles.y[tile] + _DY
    drawn = np.flatnonzero((keys != 0) & (x < tiles.width[tile]) & (y < tiles.height[tile]))
    pixel = tiles.addresses(tile).ravel()[drawn]
    group = drawn % tile.size
    facet = tiles.facet[tile][group]
    owner = owners[pixel]
    own = np.flatnonzero(np.abs(owner) == facet + 1)
    drawn = drawn[own]
    row = rows.of_serial[serial_of(keys.ravel()[drawn], bits)]
    numbers = rows.numbers[row].T.copy()
    fx, fy = x.ravel()[drawn].astype(np.float64), y.ravel()[drawn].astype(np.float64)

    def at_pixels(k: int) -> FloatArray:
        result: FloatArray = numbers[k] * fx + numbers[k + 1] * fy + numbers[k + 2]
        return result

    inverse = np.clip(at_pixels(9), numbers[12], numbers[13])
    b, c = _weights(at_pixels(0), at_pixels(3), at_pixels(6))
    corner = tiles.x[tile].astype(np.float64), tiles.y[tile].astype(np.float64)
    position = _rays(tile, tiles, rays, *corner).reshape(3, -1)[:, drawn]
    position /= inverse
    return Hits(
        pixel=pixel[own][None],
        facet=facet[own],
        triangle=rows.triangle[row],
        b=b[None],
        c=c[None],
        position=position[:, None],
        inside=int(np.count_nonzero(owner[own] > 0)),
    )


def _weights(total: FloatArray, second: FloatArray, third: FloatArray) -> tuple[Float32Array, Float32Array]:
    """Barycentric weights of the second and third corner: their edge functions' shares of the sum."""
    np.reciprocal(total, out=total)
    return (second * total).astype(np.float32), (third * total).astype(np.float32)
