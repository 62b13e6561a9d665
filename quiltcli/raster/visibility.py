"""From depth keys to what each pixel sees."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray, OwnerArray, segments
from quiltcli.raster.blocks import Blocks, Canvas
from quiltcli.raster.hits import Hits
from quiltcli.raster.keys import serial_of
from quiltcli.raster.planes import Planes

_CHUNK = 1 << 15


def read_canvas(
    canvas: Canvas,
    chunks: list[Planes],
    blocks: Blocks,
    rays: FloatArray,
    owners: OwnerArray,
    bits: int,
) -> Iterator[Hits]:
    """The hits of a drawn canvas, a cache-sized number at a time.

    Args:
        canvas: keys of the batch.
        chunks: its planes, by ascending serial ranges.
        blocks: the blocks.
        rays: (K, 3, 3) from pixels of the batch's blocks to rays.
        owners: who owns each quilt pixel; keys outside their facet and its bleed are dropped.
        bits: bits of the serial in a key.
    """
    drawn = np.flatnonzero(canvas.keys)
    if not drawn.size:
        return
    tiles = _tile_table(canvas, blocks)
    table = _gather_table(chunks)
    for at in range(0, drawn.size, _CHUNK):
        address = drawn[at : at + _CHUNK]
        hits = _hits(
            address, serial_of(canvas.keys[address], bits), tiles, table, canvas, blocks, rays, owners
        )
        if hits.pixel.size:
            yield hits


def _tile_table(canvas: Canvas, blocks: Blocks) -> IntArray:
    """Of every microtile (4, M): block's place in the batch, first column and row, quilt address."""
    place, rank = segments(canvas.tile_start)
    across = canvas.tiles_across[place]
    x, y = rank % across * 8, rank // across * 8
    block = canvas.block[place]
    return np.stack((place, x, y, blocks.address[block] + y * blocks.stride[block] + x))


def _gather_table(chunks: list[Planes]) -> tuple[IntArray, FloatArray, Int32Array]:
    """Row of each serial, the rows' 14 numbers (edges, inverse, bounds), and their triangles."""
    serial = np.concatenate([c.serial for c in chunks])
    row_of = np.zeros(int(serial.max()) + 1, dtype=np.int64)
    row_of[serial] = np.arange(serial.size)
    columns = [
        np.concatenate((c.edge.reshape(9, -1), c.inverse, c.low[None], c.high[None])).T for c in chunks
    ]
    return row_of, np.concatenate(columns), np.concatenate([c.triangle for c in chunks])


def _hits(
    address: IntArray,
    serial: IntArray,
    tiles: IntArray,
    table: tuple[IntArray, FloatArray, Int32Array],
    canvas: Canvas,
    blocks: Blocks,
    rays: FloatArray,
    owners: OwnerArray,
) -> Hits:
    """The hits at these canvas addresses, where their facet owns the pixel."""
    place, x, y, first = np.take(tiles, address >> 6, axis=1)
    dx, dy = address & 7, address >> 3 & 7
    x, y = x + dx, y + dy
    block = canvas.block[place]
    pixel = first + dy * blocks.stride[block] + dx
    facet = blocks.facet[block]
    inside = np.flatnonzero((x < blocks.width[block]) & (y < blocks.height[block]))
    own = inside[np.abs(owners[pixel[inside]]) == facet[inside] + 1]
    row_of, numbers, triangle = table
    row = row_of[serial[own]]
    planes = numbers[row].T.copy()
    fx, fy = x[own].astype(np.float64), y[own].astype(np.float64)
    b, c = _barycentric(planes, fx, fy)
    inverse = np.clip(planes[9] * fx + planes[10] * fy + planes[11], planes[12], planes[13])
    matrix = rays[place[own]]
    ray = np.stack([matrix[:, i, 0] * fx + matrix[:, i, 1] * fy + matrix[:, i, 2] for i in range(3)])
    return Hits(pixel[own], facet[own], triangle[row], b, c, ray / inverse)


def _barycentric(planes: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights of the second and third corner: each edge function over the sum of all three."""
    e = [planes[3 * k] * x + planes[3 * k + 1] * y + planes[3 * k + 2] for k in range(3)]
    total = e[0] + e[1] + e[2]
    return e[1] / total, e[2] / total
