"""Blocks: the pieces of the quilt that are rasterized at a time.

A block is a part of one facet's rectangle on its page, at most `SIDE` pixels wide and high, so that
pixel coordinates inside it stay small (edge functions are exact there) and its depth keys fit the
cache. Keys are kept in microtiles: 8 × 8 pixels that are 64 neighbours in memory.

    page                            a block                  its keys
    ┌───────────────────────┐       ┌────┬────┬────┐         0 … 63 | 64 … 127 | 128 … 191
    │   ╱‾‾╲     facet      │       │ 0  │ 1  │ 2  │         └ microtile 0, row by row
    │ ┌╱────╲─┬────┐        │       ├────┼────┼────┤
    │ ╱│     │╲    │        │  →    │ 3  │ 4  │ 5  │         owned: a bit for each pixel that
    │╱_│_____│_╲___│ blocks │       └────┴────┴────┘         is the facet's or its bleed
    └─┴┴─────┴─────┴────────┘        8 × 8 pixels each
      └ a column that is a multiple of 8
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, OwnerArray, offsets, segments
from quiltcli.layout import Layout, quilt_polygons

T = TypeVar("T", bound=np.generic)

SIDE = 512
BATCH_PIXELS = 1 << 21
BATCH_PAIRS = 1 << 17
PATCH_PIXELS = 1 << 19
_LEAST_PIXELS = 1 << 20
_SHARES = 3  # of a worker, if they do not get too small, so that none waits long for the last
_NOT_SEEN = np.float64(np.inf).view(np.int64)
"""A key that nothing lies in front of."""


@dataclass(frozen=True)
class Blocks:
    """B blocks that cover the facets' rectangles, in facet order.

    Attributes:
        start: (F+1,) offsets of every facet's blocks.
        facet: (B,) facet index.
        x0: (B,) page column of the block's first pixel.
        y0: (B,) page row of the block's first pixel.
        width: (B,) columns.
        height: (B,) rows.
        margin: (B,) columns at the left that lie beside the facet's rectangle.
        address: (B,) flat quilt address of the block's first pixel.
        stride: (B,) pixels from one row to the next, the page's width.
        columns: (F,) blocks from left to right in a facet's rectangle.
        tiles_across: (B,) microtiles from left to right in a block.
        tile_start: (B+1,) offsets of every block's microtiles among those of all blocks.
        interior: (microtiles,) those all of whose pixels lie in the block's facet.
        used: (microtiles,) those that have pixels of the facet or its bleed.
        owned: (microtiles, 8) uint8, bits of the pixels that are the facet's or its bleed, row by row.
        inside: (microtiles, 8) uint8, bits of those that lie in the facet.
        flat: how many of the blocks are flat facets'; behind them, each a row of `start` of its own, come the
            patches of curved ones.
    """

    start: IntArray
    facet: Int32Array
    x0: IntArray
    y0: IntArray
    width: IntArray
    height: IntArray
    margin: IntArray
    address: IntArray
    stride: IntArray
    columns: IntArray
    tiles_across: IntArray
    tile_start: IntArray
    interior: BoolArray
    used: BoolArray
    owned: NDArray[np.uint8]
    inside: NDArray[np.uint8]
    flat: int

    def tiles(self, blocks: tuple[int, int]) -> slice:
        """The microtiles of a range of blocks."""
        first, last = blocks
        return slice(int(self.tile_start[first]), int(self.tile_start[last]))

    def any_tile(self, tiles: BoolArray) -> BoolArray:
        """Blocks (B,) that have any of these microtiles (microtiles,)."""
        count = offsets(tiles)
        return np.asarray(np.diff(count.take(self.tile_start)) > 0)


def facet_rectangles(layout: Layout, bleed: int) -> IntArray:
    """Pixel rectangles (F, 4) x0, y0, x1, y1 (exclusive) of the facets with their bleed, cut to the page."""
    # Whole pixels around the polygon and its bleed; a facet without a page has none.
    corners = quilt_polygons(layout)
    low = np.minimum.reduceat(corners, layout.corner_start[:-1], axis=0)
    high = np.maximum.reduceat(corners, layout.corner_start[:-1], axis=0)
    page_size = layout.pages[np.maximum(layout.page, 0)]
    low = np.clip(np.floor(low) - bleed, 0, page_size)
    high = np.clip(np.ceil(high) + bleed, 0, page_size)
    high[layout.page < 0] = low[layout.page < 0]
    return np.concatenate((low, high), axis=1).astype(np.int64)


def cut_blocks(layout: Layout, bleed: int, owners: OwnerArray) -> Blocks:
    """Cut every facet's rectangle, bleed included, into blocks, row by row.

    Blocks begin at page columns that are multiples of 8, so that the rows of microtiles are memory that
    can be written as a whole. What a block has beyond its facet is not the facet's, and never drawn.

    Args:
        layout: the facets' places.
        bleed: pixels drawn past a facet's edge.
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
    """
    # Rectangles from columns that are multiples of 8, cut every SIDE pixels.
    rectangle = facet_rectangles(layout, bleed)
    margin = np.where(rectangle[:, 2] > rectangle[:, 0], rectangle[:, 0] % 8, 0)
    rectangle[:, 0] -= margin
    extent = rectangle[:, 2:] - rectangle[:, :2]
    counts = -(-extent // SIDE)
    start = offsets(counts[:, 0] * counts[:, 1])
    # Where each block lies on its page, and in the flat buffers.
    facet, rank = segments(start)
    columns = np.maximum(counts[:, 0], 1)
    x0 = rectangle[facet, 0] + rank % columns[facet] * SIDE
    y0 = rectangle[facet, 1] + rank // columns[facet] * SIDE
    page = layout.page[facet]
    stride = layout.pages[page, 0].astype(np.int64)
    width = np.minimum(rectangle[facet, 2] - x0, SIDE)
    height = np.minimum(rectangle[facet, 3] - y0, SIDE)
    address = layout.page_offset[page] + y0 * stride + x0
    # Its microtiles, and which of their pixels are the facet's.
    across = -(-width // 8)
    tile_start = offsets(across * -(-height // 8))
    owned, inside = _owned_pixels(facet, width, height, address, stride, owners)
    return Blocks(
        start=start,
        facet=facet.astype(np.int32),
        x0=x0,
        y0=y0,
        width=width,
        height=height,
        margin=np.where(rank % columns[facet] == 0, margin[facet], 0),
        address=address,
        stride=stride,
        columns=columns,
        tiles_across=across,
        tile_start=tile_start,
        interior=(inside == 255).all(axis=1),
        used=np.asarray(owned.any(axis=1)),
        owned=owned,
        inside=inside,
        flat=facet.size,
    )


def window(flat: NDArray[T], address: int, stride: int, width: int, height: int) -> NDArray[T]:
    """A rectangle of a flat page as a view (height, width)."""
    size = flat.itemsize
    steps = (int(stride) * size, size)
    # The array's own buffer: `as_strided` takes ten times as long.
    return np.ndarray((height, width), flat.dtype, flat.data, address * size, steps)


def block_window(flat: NDArray[T], blocks: Blocks, block: int) -> NDArray[T]:
    """The pixels of one block in a flat buffer, as a view (height, width)."""
    rectangle = (a[block] for a in (blocks.address, blocks.stride, blocks.width, blocks.height))
    return window(flat, *(int(number) for number in rectangle))


def _owned_pixels(
    facet: IntArray,
    width: IntArray,
    height: IntArray,
    address: IntArray,
    stride: IntArray,
    owners: OwnerArray,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Which pixels of all blocks' microtiles their facets own, and which of them are no bleed, as bits."""
    owned, inside = [np.zeros((0, 8), dtype=np.uint8)], [np.zeros((0, 8), dtype=np.uint8)]
    for f, w, h, first, step in zip(facet, width, height, address, stride, strict=True):
        # Made up to whole microtiles with pixels of nobody.
        mine = np.zeros((-(-h // 8) * 8, -(-w // 8) * 8), dtype=owners.dtype)
        mine[:h, :w] = window(owners, first, step, w, h)
        polygon = mine == f + 1
        owned.append(tile_bits(polygon | (mine == -f - 1)))
        inside.append(tile_bits(polygon))
    return np.concatenate(owned), np.concatenate(inside)


def tile_bits(mask: BoolArray) -> NDArray[np.uint8]:
    """A mask of whole microtiles as bits (microtiles, 8), row by row."""
    rows = np.packbits(mask, axis=1)
    return rows.reshape(len(mask) // 8, 8, -1).transpose(0, 2, 1).reshape(-1, 8)


def cut_batches(
    pair_counts: IntArray, blocks: Blocks, wanted: BoolArray, workers: int
) -> list[tuple[int, int]]:
    """Group consecutive blocks into batches of bounded work.

    Args:
        pair_counts: (B,) block pairs of each block.
        blocks: the blocks.
        wanted: (B,) the blocks that must be in a batch; others cost nothing.
        workers: how many will share the batches. No pixel depends on which batch it is in.

    Returns:
        Ranges [first, last) of blocks. Their pixels are counted by microtiles that are drawn: the rectangle
        of a triangular facet is half empty.
    """
    # Pixels that are drawn of every block; with several workers, smaller shares for each.
    used = offsets(blocks.used)
    areas = 64 * np.diff(used.take(blocks.tile_start))
    most = BATCH_PIXELS
    if workers > 1:
        most = min(most, max(_LEAST_PIXELS, int(areas[wanted].sum()) // (_SHARES * workers)))
    # A batch ends before the block with which it would be too much.
    area, counts = areas.tolist(), pair_counts.tolist()
    batches = []
    first, begun, pixels, pairs = 0, False, 0, 0
    for block in np.flatnonzero(wanted).tolist():
        full = pixels + area[block] > most or pairs + counts[block] > BATCH_PAIRS
        # What is curved is drawn in another way, with more to remember of each pixel.
        if begun and (
            full or first < blocks.flat <= block or (first >= blocks.flat and pixels > PATCH_PIXELS)
        ):
            batches.append((first, block))
            first, pixels, pairs = block, 0, 0
        begun = True
        pixels += area[block]
        pairs += counts[block]
    if begun:
        batches.append((first, pair_counts.size))
    return batches


@dataclass(frozen=True)
class Canvas:
    """What has been drawn of one batch, microtile by microtile, and where each microtile lies.

    Attributes:
        block: (K,) the batch's blocks, indices into `Blocks`.
        tile_start: (K+1,) offsets of every block's microtiles.
        tiles_across: (K,) microtiles from left to right in a block.
        tiles_down: (K,) from top to bottom.
        place: (M,) every microtile's block, by its place in the batch.
        number: (M,) every microtile's index among those of all blocks.
        owned: (M, 8) uint8, bits of the pixels that are the facet's or its bleed, row by row.
        used: (M,) microtiles that have such pixels; nothing needs to be drawn in others.
        keys: (M, 64) int64 depth keys, 0 where nothing has been drawn.
        touched: (M,) microtiles that have keys.
        full: (M,) those of them whose owned pixels are known to have keys, all of them.
        filler: (M,) one more than the serial of the one pair that shows in a microtile, fills it and
            so needs no keys; 0 where there is none.
    """

    block: IntArray
    tile_start: IntArray
    tiles_across: IntArray
    tiles_down: IntArray
    place: IntArray
    number: IntArray
    owned: NDArray[np.uint8]
    used: BoolArray
    keys: IntArray
    touched: BoolArray
    full: BoolArray
    filler: IntArray

    def drawn(self) -> IntArray:
        """The microtiles, by their place in the canvas, of which pixels see something."""
        return np.flatnonzero((self.touched | (self.filler > 0)) & self.used)


def new_canvas(block: IntArray, blocks: Blocks) -> Canvas:
    """An empty canvas for the blocks with these indices."""
    # The blocks' microtiles one after the other.
    tiles = blocks.tile_start[block + 1] - blocks.tile_start[block]
    tile_start = offsets(tiles)
    count = int(tile_start[-1])
    across = blocks.tiles_across[block]
    place, number = segments(tile_start)
    number += blocks.tile_start[block].take(place)
    return Canvas(
        block=block,
        tile_start=tile_start,
        tiles_across=across,
        tiles_down=tiles // across,
        place=place,
        number=number,
        owned=blocks.owned.take(number, axis=0),
        used=blocks.used.take(number),
        keys=_empty_keys(count),
        touched=np.zeros(count, dtype=np.bool_),
        full=np.zeros(count, dtype=np.bool_),
        filler=np.zeros(count, dtype=np.int64),
    )


class _Spare(threading.local):
    """Keys of an earlier canvas of this thread, all 0: emptying what was drawn is less work than all."""

    keys: IntArray | None = None


_SPARE = _Spare()


def _empty_keys(count: int) -> IntArray:
    """Keys (count, 64) that are 0."""
    # Taken out of the shelf: two canvases of one thread must not have the same.
    keys, _SPARE.keys = _SPARE.keys, None
    return keys[:count] if keys is not None and len(keys) >= count else np.zeros((count, 64), dtype=np.int64)


def give_back(canvas: Canvas) -> None:
    """Keep the memory of a canvas that nobody reads any more for the next one."""
    # What is kept is the whole array, of which this canvas may have been a part.
    canvas.keys[canvas.touched] = 0
    _SPARE.keys = canvas.keys if canvas.keys.base is None else canvas.keys.base


def least_keys(canvas: Canvas, among: BoolArray | None = None) -> IntArray:
    """The least key (M,) at pixels that are the facet's or its bleed, of every microtile.

    Args:
        canvas: what has been drawn.
        among: (M,) the only microtiles that are looked at, None for all; others are told to have 0.
    """
    # Nothing can be in front of microtiles that have no pixels; untouched ones hide nothing.
    least = np.zeros(canvas.touched.size, dtype=np.int64)
    least[~canvas.used] = _NOT_SEEN
    touched = np.flatnonzero(canvas.touched if among is None else canvas.touched & among)
    keys, owned = canvas.keys.take(touched, axis=0), canvas.owned.take(touched, axis=0)
    least[touched] = keys.min(axis=1)
    # The other pixels of a microtile on the facet's edge may well be bare.
    partly = np.flatnonzero((owned != 255).any(axis=1))
    mine = np.unpackbits(owned.take(partly, axis=0), axis=1).view(np.bool_)
    least[touched[partly]] = np.where(mine, keys.take(partly, axis=0), _NOT_SEEN).min(axis=1)
    return least


def ray_matrices(
    eye_from_quilt: FloatArray, blocks: Blocks, block: IntArray, sample: FloatArray | None
) -> FloatArray:
    """Matrices (K, 3, 3) from block pixels, whole numbers at each facet's `sample` (F, 2), to eye rays."""
    # The first pixel's sample is moved to the origin, and pixels are whole numbers from there.
    facet = blocks.facet[block]
    matrix = eye_from_quilt[facet].copy()
    beside = np.zeros((1, 2)) if sample is None else sample[facet]
    x = (blocks.x0[block] + 0.5 + beside[:, 0])[:, None]
    y = (blocks.y0[block] + 0.5 + beside[:, 1])[:, None]
    matrix[:, :, 2] += x * matrix[:, :, 0] + y * matrix[:, :, 1]
    return matrix
