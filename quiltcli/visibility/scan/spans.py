"""Where large triangles show: tiles are rejected or hidden as a whole before any pixel is looked at.

    pair                piece                span
    a triangle in       its box cut at       a microtile of 8 × 8
    a block             tiles of 64 × 64     pixels of a piece
                        pixels
    ┌─────────────┐     ┌──────┬──────┐      ┌─┬─┬─┬─┐  · outside:
    │   ╱╲        │     │   ╱╲ │      │      │·│·│╱│╲│    left out
    │  ╱  ╲       │ →   │  ╱  ╲│      │  →   ├─┼─┼─┼─┤  ╱ crossed:
    │ ╱    ╲      │     ├─╱────┼╲─────┤      │·│╱│■│■│    evaluated
    │╱______╲     │     │╱_____│_╲    │      ├─┼─┼─┼─┤  ■ covered:
    └─────────────┘     └──────┴──────┘      │╱│■│■│■│    hides what is behind, and needs
                                             └─┴─┴─┴─┘    no pixels where it is alone

The values of the edge functions at the corners of a tile or microtile tell whether it lies outside, inside,
or on an edge (hierarchical rasterization). A tile that a surface covers completely hides everything farther
away in it (a hierarchical depth test). `large` draws what remains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, offsets, segments, slices
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.setup.blocks import SIDE, Canvas
from quiltcli.visibility.setup.planes import Planes

MICROTILE = 8
TILE = 64
_ACROSS = TILE // MICROTILE
_SIZES = (1, 2, 4, 8)
_CLASS_OF = np.searchsorted(np.asarray(_SIZES), np.arange(_ACROSS + 1))
_CELLS = 1 << 16  # microtiles at a time that pieces are looked at in: their values fit the cache


@dataclass(frozen=True)
class Pieces:
    """Parts of pairs that span at most 8 × 8 microtiles.

    Attributes:
        row: (R,) the pair, a row of `Planes`.
        box: (4, R) first and last microtile column, first and last row in the block.
    """

    row: IntArray
    box: IntArray


@dataclass(frozen=True)
class Spans:
    """S (pair, microtile) combinations that may hold fragments.

    Attributes:
        row: (S,) the pair, a row of `Planes`.
        tile: (S,) the microtile's index in the canvas.
        x: (S,) first pixel column of the microtile in its block.
        y: (S,) first pixel row.
        crossed: (S,) bit k set where edge k crosses the microtile; 0 means fully covered.
        least: (S,) least 1/t in it.
        greatest: (S,) greatest 1/t in it.
    """

    row: IntArray
    tile: IntArray
    x: IntArray
    y: IntArray
    crossed: NDArray[np.uint8]
    least: FloatArray
    greatest: FloatArray

    def __getitem__(self, part: slice) -> Spans:
        """A range of the combinations, as views."""
        return Spans(*(column[part] for column in vars(self).values()))

    def take(self, keep: IntArray) -> Spans:
        """The combinations with these indices."""
        return Spans(*(column.take(keep) for column in vars(self).values()))


def large_spans(planes: Planes, canvas: Canvas, by: BatchOrder | None = None, *, hide: bool = True) -> Spans:
    """The microtiles that pairs of any size may show in.

    Args:
        planes: the pairs.
        canvas: the microtiles.
        by: what to order by instead of 1/t; tiles of pairs that lie behind others are not left out then.
        hide: whether those are left out otherwise.
    """
    return _spans(planes, _pieces(planes, hide and by is None), canvas)


def _pieces(planes: Planes, hide: bool) -> Pieces:
    """The pairs, those that are wider or higher than 8 microtiles cut at the borders of tiles.

    Tiles that a wide pair does not touch are left out, and with `hide` those that lie behind others.
    """
    x0, x1, y0, y1 = box = (planes.box >> 3).astype(np.int64)
    wide = np.maximum(x1 - x0, y1 - y0) >= _ACROSS
    near = np.flatnonzero(~wide)
    if near.size == wide.size:
        return Pieces(near, box)
    # Tiles that lie outside an edge or behind what covers them are left out as wholes.
    row, x, y = _tiles(np.flatnonzero(wide), planes.box[:, wide])
    least, greatest = _extremes(np.take(planes.edge, row, axis=2), x, y)
    covered = np.all(least > 0, axis=0)
    keep = np.all(greatest > 0, axis=0)
    if hide:
        keep &= ~_behind(planes, row, x, y, covered)
    row, x, y = row[keep], x[keep] >> 3, y[keep] >> 3
    # What of the pair's box is in the tile, in microtiles.
    ends = np.stack((x, x + _ACROSS - 1, y, y + _ACROSS - 1))
    cut = box[:, row]
    cut[0::2] = np.maximum(cut[0::2], ends[0::2])
    cut[1::2] = np.minimum(cut[1::2], ends[1::2])
    return Pieces(np.concatenate((near, row)), np.concatenate((box[:, near], cut), axis=1))


def _tiles(rows: IntArray, box: Int32Array) -> tuple[IntArray, IntArray, IntArray]:
    """Row, first column and first row (S,) of all tiles that the pixel boxes (4, R) of rows (R,) touch."""
    x0, x1, y0, y1 = (box // TILE).astype(np.int64)
    across = x1 - x0 + 1
    owner, rank = segments(offsets(across * (y1 - y0 + 1)))
    y, x = np.divmod(rank, across[owner])
    return rows[owner], (x0[owner] + x) * TILE, (y0[owner] + y) * TILE


def _extremes(plane: FloatArray, x: IntArray, y: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest values (..., S) of planes (..., 3, S) at the pixels of tiles at x, y (S,)."""
    a, b, c = plane[..., 0, :], plane[..., 1, :], plane[..., 2, :]
    first = a * x + b * y + c
    reach_x, reach_y = a * (TILE - 1), b * (TILE - 1)
    least = first + np.minimum(reach_x, 0) + np.minimum(reach_y, 0)
    greatest = first + np.maximum(reach_x, 0) + np.maximum(reach_y, 0)
    return least, greatest


def _behind(planes: Planes, row: IntArray, x: IntArray, y: IntArray, covered: BoolArray) -> BoolArray:
    """Which pairs lie, in a tile at x, y (S,), wholly behind one that covers it."""
    least, greatest = _extremes(np.take(planes.inverse, row, axis=1), x, y)
    low, high = planes.low.take(row), planes.high.take(row)
    least, greatest = held(least, low, high), held(greatest, low, high)
    per_block = (SIDE // TILE) ** 2
    place = planes.block.take(row) * np.int64(per_block) + y // TILE * (SIDE // TILE) + x // TILE
    nearest = np.zeros(int(place.max(initial=-1)) + 1)
    covers = np.flatnonzero(covered & ~planes.cut.take(row))
    np.maximum.at(nearest, place[covers], least[covers])
    result: BoolArray = greatest < nearest[place]
    return result


def held(values: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Values of 1/t (S,) held between those of the corners, as they are where they are drawn."""
    return np.minimum(np.maximum(values, low, out=values), high, out=values)


def _spans(planes: Planes, pieces: Pieces, canvas: Canvas) -> Spans:
    """The microtiles of all pieces that lie on the inner side of some pixel of every edge."""
    wide = _CLASS_OF[pieces.box[1] - pieces.box[0] + 1]
    high = _CLASS_OF[pieces.box[3] - pieces.box[2] + 1]
    classes = (high * len(_SIZES) + wide).astype(np.uint16)
    order = np.argsort(classes, kind="stable")
    classes = classes[order]
    bounds = np.flatnonzero(np.diff(classes, prepend=np.uint16(65535), append=np.uint16(65535)))
    found = []
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        shape = _SIZES[classes[first] // len(_SIZES)], _SIZES[classes[first] % len(_SIZES)]
        step = _CELLS // (shape[0] * shape[1])
        for cells in slices(first, last, step):
            part = order[cells]
            found.append(_class_spans(planes, pieces.row[part], pieces.box[:, part], shape, canvas))
    columns = zip(*(vars(spans).values() for spans in found), strict=True)
    return Spans(*(np.concatenate(column) for column in columns)) if found else _no_spans()


def _no_spans() -> Spans:
    """None at all."""
    whole, real = np.zeros(0, dtype=np.int64), np.zeros(0)
    return Spans(whole, whole, whole, whole, np.zeros(0, dtype=np.uint8), real, real)


def _class_spans(
    planes: Planes, row: IntArray, box: IntArray, shape: tuple[int, int], canvas: Canvas
) -> Spans:
    """Spans of n pieces that are looked at in this many (rows, columns) of microtiles."""
    rows, columns = shape
    # Each microtile against each edge: outside if its best pixel is, crossed if its worst is.
    x0, x1, y0, y1 = box
    i, j = np.arange(columns)[:, None], np.arange(rows)[:, None]
    inside = (j <= y1 - y0)[:, None] & (i <= x1 - x0)
    crossed = np.zeros((rows, columns, row.size), dtype=np.uint8)
    for k in range(3):
        values, down, up = _corner_values(np.take(planes.edge[k], row, axis=1), x0, y0, i, j)
        inside &= values > -up
        crossed |= (values <= -down).view(np.uint8) << np.uint8(k)
    # Those that are left, as indices of the canvas's microtiles; facets may own no pixel of some.
    block = planes.block.take(row)
    keep = np.flatnonzero(inside)
    cell, piece = np.divmod(keep, row.size)
    x = x0.take(piece) + cell % columns
    y = y0.take(piece) + cell // columns
    place = block.take(piece)
    tile = canvas.tile_start.take(place) + y * canvas.tiles_across.take(place) + x
    used = np.flatnonzero(canvas.used.take(tile))
    if used.size < tile.size:
        keep, piece, x, y, tile = (values.take(used) for values in (keep, piece, x, y, tile))
    # How near each pair comes there, and how far away it reaches.
    values, down, up = _corner_values(np.take(planes.inverse, row, axis=1), x0, y0, i, j)
    row = row.take(piece)
    values = values.ravel().take(keep)
    low, high = planes.low.take(row), planes.high.take(row)
    return Spans(
        row=row,
        tile=tile,
        x=x * MICROTILE,
        y=y * MICROTILE,
        crossed=crossed.ravel().take(keep),
        least=held(values + down.take(piece), low, high),
        greatest=held(values + up.take(piece), low, high),
    )


def _corner_values(
    plane: FloatArray, x: IntArray, y: IntArray, i: IntArray, j: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values of planes (3, n) at the first pixels of microtiles, and how far others go down and up.

    Args:
        plane: the planes.
        x: (n,) microtile columns to begin at.
        y: (n,) microtile rows to begin at.
        i: (columns, 1) further columns.
        j: (rows, 1) further rows.

    Returns:
        values (rows, columns, n); the most that a pixel of a microtile has less (n,), and more (n,).
    """
    a, b, c = plane
    across, below = a * MICROTILE, b * MICROTILE
    lines = below * (y + j)
    lines += c
    values = lines[:, None] + across * (x + i)
    reach_x, reach_y = a * (MICROTILE - 1), b * (MICROTILE - 1)
    down = np.minimum(reach_x, 0) + np.minimum(reach_y, 0)
    up = np.maximum(reach_x, 0) + np.maximum(reach_y, 0)
    return values, down, up
