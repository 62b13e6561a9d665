"""Large triangles: tiles are rejected, hidden or drawn as a whole before any pixel is looked at.

A triangle's box is cut into tiles of 64 pixels, those into microtiles of 8. The values of the edge
functions at a tile's corners tell whether it lies outside, inside, or on an edge; a tile that a
surface covers completely hides everything farther away in it. What remains is evaluated 64 pixels
at a time, one pair a microtile and round, so that no two writes of a round meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, segments
from quiltcli.raster.blocks import SIDE, Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.keys import make_keys, serial_part
from quiltcli.raster.order import BatchOrder
from quiltcli.raster.planes import Planes

MICROTILE = 8
TILE = 64
_ROUND = 512
_EARLY = 3
_X: FloatArray = np.tile(np.arange(8.0), 8)
_Y: FloatArray = np.repeat(np.arange(8.0), 8)
_BASIS = np.stack((_X, _Y, np.ones(64)))


@dataclass(frozen=True)
class Spans:
    """S (pair, tile) combinations that may hold fragments.

    Attributes:
        row: (S,) the pair, a row of `Planes`.
        x: (S,) first pixel column of the tile in its block.
        y: (S,) first pixel row.
        crossed: (S,) bit k set where edge k crosses the tile; 0 means fully covered.
    """

    row: IntArray
    x: IntArray
    y: IntArray
    crossed: IntArray

    def take(self, keep: IntArray) -> Spans:
        """The combinations with these indices."""
        return Spans(self.row[keep], self.x[keep], self.y[keep], self.crossed[keep])


def draw_large(
    planes: Planes, canvas: Canvas, limits: DepthRange, bits: int, by: BatchOrder | None = None
) -> int:
    """Draw pairs of any size; see `small.draw_small` for the arguments.

    Returns:
        Number of pixels that were evaluated.
    """
    width = planes.box[1] - planes.box[0]
    height = planes.box[3] - planes.box[2]
    huge = np.maximum(width, height) >= TILE
    rows = np.flatnonzero(huge)
    tiles = _tile_spans(rows, planes.box[:, rows], TILE)
    tiles = _classify(planes, tiles, TILE)
    if by is None:
        tiles = _hide(planes, tiles, canvas, TILE)
    box = planes.box[:, tiles.row]
    box[0::2] = np.maximum(box[0::2], (tiles.x, tiles.y))
    box[1::2] = np.minimum(box[1::2], (tiles.x + TILE - 1, tiles.y + TILE - 1))
    rows = np.flatnonzero(~huge)
    spans = _merge(
        _tile_spans(tiles.row, box, MICROTILE),
        _tile_spans(rows, planes.box[:, rows], MICROTILE),
    )
    spans = _classify(planes, spans, MICROTILE)
    if by is None:
        spans = _hide(planes, spans, canvas, MICROTILE)
    _draw_rounds(planes, spans, canvas, limits, bits, by)
    return spans.row.size * 64


def _tile_spans(rows: IntArray, box: Int32Array, size: int) -> Spans:
    """All tiles of `size` pixels that the boxes (4, R) of some rows (R,) touch."""
    x0, x1, y0, y1 = (box // size).astype(np.int64)
    across = x1 - x0 + 1
    owner, rank = segments(np.concatenate(([0], np.cumsum(across * (y1 - y0 + 1)))))
    x = (x0[owner] + rank % across[owner]) * size
    y = (y0[owner] + rank // across[owner]) * size
    return Spans(rows[owner], x, y, np.zeros(owner.size, dtype=np.int64))


def _merge(a: Spans, b: Spans) -> Spans:
    """Both lists as one."""
    return Spans(
        np.concatenate((a.row, b.row)),
        np.concatenate((a.x, b.x)),
        np.concatenate((a.y, b.y)),
        np.concatenate((a.crossed, b.crossed)),
    )


def _extremes(plane: FloatArray, spans: Spans, size: int) -> tuple[FloatArray, FloatArray]:
    """Least and greatest value of each span's plane at the pixels of its tile."""
    a, b, c = plane[0, spans.row], plane[1, spans.row], plane[2, spans.row]
    first = a * spans.x + b * spans.y + c
    reach_x, reach_y = a * (size - 1), b * (size - 1)
    least = first + np.minimum(reach_x, 0) + np.minimum(reach_y, 0)
    greatest = first + np.maximum(reach_x, 0) + np.maximum(reach_y, 0)
    return least, greatest


def _classify(planes: Planes, spans: Spans, size: int) -> Spans:
    """Drop spans that lie outside an edge; note which edges cross the others."""
    outside = np.zeros(spans.row.size, dtype=np.bool_)
    crossed = np.zeros(spans.row.size, dtype=np.int64)
    for k in range(3):
        least, greatest = _extremes(planes.edge[k], spans, size)
        outside |= greatest <= 0
        crossed |= (least <= 0).astype(np.int64) << k
    found = Spans(spans.row, spans.x, spans.y, crossed)
    return found.take(np.flatnonzero(~outside))


def _hide(planes: Planes, spans: Spans, canvas: Canvas, size: int) -> Spans:
    """Drop spans that lie wholly behind a surface that covers their tile."""
    least, greatest = _extremes(planes.inverse, spans, size)
    low, high = planes.low[spans.row], planes.high[spans.row]
    least, greatest = np.clip(least, low, high), np.clip(greatest, low, high)
    place = _places(planes, spans, canvas, size)
    nearest = np.zeros(int(place.max(initial=-1)) + 1)
    covers = np.flatnonzero((spans.crossed == 0) & ~planes.cut[spans.row])
    np.maximum.at(nearest, place[covers], least[covers])
    return spans.take(np.flatnonzero(greatest >= nearest[place]))


def _places(planes: Planes, spans: Spans, canvas: Canvas, size: int) -> IntArray:
    """A number for every span's tile: the microtile's index in the canvas, or one of the larger tile."""
    block = planes.block[spans.row]
    if size == TILE:
        return block * np.int64((SIDE // TILE) ** 2) + spans.y // TILE * (SIDE // TILE) + spans.x // TILE
    place: IntArray = canvas.tile_start[block] + (spans.y >> 3) * canvas.tiles_across[block] + (spans.x >> 3)
    return place


def _draw_rounds(
    planes: Planes, spans: Spans, canvas: Canvas, limits: DepthRange, bits: int, by: BatchOrder | None
) -> None:
    """Evaluate the microtiles' pixels, in rounds in which every microtile occurs once."""
    tile = _places(planes, spans, canvas, MICROTILE)
    order = np.argsort(tile, kind="stable")
    tile = tile[order]
    fresh = np.flatnonzero(np.diff(tile, prepend=-1))
    rank = np.arange(tile.size) - np.repeat(fresh, np.diff(fresh, append=tile.size))
    # Few spans are left after the first rounds: there one evaluation for all costs less than several.
    crossed = spans.crossed[order]
    kind = np.where(rank < _EARLY, crossed, np.minimum(crossed, 1))
    by_round = np.lexsort((kind, rank))
    tile, group = tile[by_round], (rank * 8 + kind)[by_round]
    stack = _stack(planes, spans.take(order[by_round]))
    keys = canvas.keys.reshape(-1, 64)
    bounds = np.flatnonzero(np.diff(group, prepend=-1, append=-1))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        for at in range(first, last, _ROUND):
            part = slice(at, min(at + _ROUND, last))
            place = tile[part]
            keys[place] = np.maximum(keys[place], _tile_keys(stack, part, limits, bits, by))


@dataclass(frozen=True)
class _Stack:
    """What S microtiles need to be evaluated, in the order of the rounds.

    Attributes:
        local: (4, S, 3) planes of the three edges and of 1/t, from the microtile's first pixel.
        low: (S, 1) least 1/t.
        high: (S, 1) greatest 1/t.
        serial: (S, 1) serial of the pair.
        cut: (S, 1) pairs that reach beyond near or far.
        block: (S, 1) place of the block in the batch.
        spans: the microtiles.
    """

    local: FloatArray
    low: FloatArray
    high: FloatArray
    serial: Int32Array
    cut: BoolArray
    block: Int32Array
    spans: Spans


def _stack(planes: Planes, spans: Spans) -> _Stack:
    """Gather what the spans need, once for all rounds."""
    row = spans.row
    local = np.empty((4, row.size, 3))
    for k, plane in enumerate((*planes.edge, planes.inverse)):
        a, b = plane[0, row], plane[1, row]
        local[k, :, 0], local[k, :, 1] = a, b
        local[k, :, 2] = a * spans.x + b * spans.y + plane[2, row]
    column = row[:, None]
    return _Stack(
        local=local,
        low=planes.low[column],
        high=planes.high[column],
        serial=planes.serial[column],
        cut=planes.cut[column],
        block=planes.block[column],
        spans=spans,
    )


def _tile_keys(stack: _Stack, part: slice, limits: DepthRange, bits: int, by: BatchOrder | None) -> IntArray:
    """Keys (S, 64) of a slice of microtiles; negative where they are not covered."""
    # Exact whatever the order of the sums: the planes lie on dyadic grids.
    inverse: FloatArray = stack.local[3, part] @ _BASIS
    np.maximum(inverse, stack.low[part], out=inverse)
    np.minimum(inverse, stack.high[part], out=inverse)
    crossed = int(np.bitwise_or.reduce(stack.spans.crossed[part]))
    inside = None
    for k in range(3):
        if crossed >> k & 1:
            edge = stack.local[k, part] @ _BASIS
            inside = edge if inside is None else np.minimum(inside, edge, out=inside)
    x, y, cut = stack.spans.x[part, None] + _X, stack.spans.y[part, None] + _Y, stack.cut[part]
    if cut.any():
        kept = limits.keeps(stack.block[part], x, y, inverse)
        np.negative(inverse, out=inverse, where=~kept & cut)
    if inside is not None:
        np.negative(inverse, out=inverse, where=(inside < 0) & (inverse > 0))
    if by is not None:
        inverse = by.values(stack.block[part], x, y, inverse)
    return make_keys(inverse, serial_part(stack.serial[part], bits), bits)
