"""Which pixels of its raster a shape touches, row by row, in every quarter turn and mirror.

A shape is described from outside: the first and last pixel it touches in each row of pixels, and
everything between counts as touched. For a convex facet that is exact; a notch that opens up or down
counts as filled. A pixel is touched when the polygon reaches further than 0.01 pixel into it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray, next_in_row, offsets, segments
from quiltcli.layout.layout import PIXEL_TOLERANCE
from quiltcli.layout.packing.model import PackInput

NOWHERE = 1 << 28
"""Stands for the left end of a row that nothing touches: nothing is ever in its way."""


@dataclass(frozen=True)
class Shapes:
    """n shapes in O orientations: 0 to 3 quarter turns, then the same after mirroring.

    Row y of shape i in orientation o has the index `start[i, o] + y`.

    Attributes:
        size: (n, O, 2) width and height of the turned raster.
        start: (n, O) index of the first row.
        left: first touched pixel of each row, `NOWHERE` in rows that are not touched.
        right: one past the last touched pixel, −`NOWHERE` in rows that are not touched.
        area: (n,) touched pixels.
    """

    size: Int32Array
    start: IntArray
    left: Int32Array
    right: Int32Array
    area: IntArray

    @cached_property
    def taken(self) -> IntArray:
        """Sum (n, O) of the left ends of a shape's rows, of those that are touched."""
        order = np.argsort(self.start, axis=None)
        left = np.where(self.left < NOWHERE, self.left, 0).astype(np.int64)
        sums = np.zeros(self.start.size, dtype=np.int64)
        sums[order] = np.add.reduceat(left, self.start.ravel()[order])
        return sums.reshape(self.start.shape)

    @cached_property
    def first_alike(self) -> IntArray:
        """For every shape (n,) the first one that is the same, pixel by pixel, standing and lying."""
        first: dict[tuple[bytes, ...], int] = {}
        looks = (
            tuple(
                side[self.rows(shape, turn)].tobytes() for turn in (0, 1) for side in (self.left, self.right)
            )
            for shape in range(len(self.size))
        )
        return np.array([first.setdefault(look, shape) for shape, look in enumerate(looks)])

    def rows(self, shape: int, orientation: int) -> slice:
        """The rows of a shape in one orientation."""
        start = int(self.start[shape, orientation])
        return slice(start, start + int(self.size[shape, orientation, 1]))


def all_rectangles(wanted: PackInput) -> bool:
    """Whether every facet touches every pixel of its raster, by its rows and by its columns."""
    shapes = facet_shapes(wanted)
    whole = wanted.size.astype(np.int64).prod(axis=1)
    columns = [shapes.rows(shape, 1) for shape in range(len(wanted.size))]
    lying = [int(np.maximum(shapes.right[rows] - shapes.left[rows], 0).sum()) for rows in columns]
    return bool((shapes.area == whole).all() and (np.array(lying) == whole).all())


def facet_shapes(wanted: PackInput) -> Shapes:
    """Shapes of facets, in four orientations, or eight when they may be mirrored."""
    shape, _ = segments(wanted.corner_start)
    ends = wanted.polygon[next_in_row(wanted.corner_start)]
    return shapes_of_edges(wanted.size, shape, wanted.polygon, ends, wanted.mirror)


def shapes_of_edges(
    size: Int32Array, shape: IntArray, start: FloatArray, end: FloatArray, mirror: bool = False
) -> Shapes:
    """Shapes from the edges of their outlines.

    Args:
        size: (n, 2) raster width and height.
        shape: (E,) shape each edge belongs to.
        start: (E, 2) where edges begin, raster pixels.
        end: (E, 2) where they end.
        mirror: whether to describe the mirrored orientations too.
    """
    left, right = _extents(size, shape, start, end)
    top, bottom = _extents(size[:, ::-1], shape, start[:, ::-1], end[:, ::-1])
    row, y = segments(offsets(size[:, 1]))
    column, x = segments(offsets(size[:, 0]))
    width, height = size[row, 0], size[column, 1]
    area = np.zeros(len(size), dtype=np.int64)
    np.add.at(area, row, np.maximum(right - left, 0))
    back_y, back_x = _reversed(row, y, size[:, 1]), _reversed(column, x, size[:, 0])
    # Mirroring swaps the sides of rows, and the order of columns.
    upright, lying = (left, right), (top, bottom)
    tables = [
        upright,
        _flipped(lying, height),
        _at(_flipped(upright, width), back_y),
        _at(lying, back_x),
    ]
    if mirror:
        tables += [
            _flipped(upright, width),
            _at(_flipped(lying, height), back_x),
            _at(upright, back_y),
            lying,
        ]
    sizes = np.stack([size[:, :: -1 if turn % 2 else 1] for turn in range(len(tables))], axis=1)
    steps = [offsets(sizes[:, turn, 1]) for turn in range(len(tables))]
    base = np.cumsum([0, *(int(step[-1]) for step in steps)])
    starts = np.stack([step[:-1] + base[turn] for turn, step in enumerate(steps)], axis=1)
    lefts, rights = (np.concatenate(side) for side in zip(*tables, strict=True))
    return Shapes(sizes, starts, lefts, rights, np.maximum(area, 1))


_Sides = tuple[Int32Array, Int32Array]


def _reversed(owner: IntArray, rank: IntArray, count: Int32Array) -> IntArray:
    """Index (N,) of the row that takes each row's place when every shape is put upside down."""
    index = np.arange(owner.size)
    result: IntArray = index - rank + (count[owner] - 1 - rank)
    return result


def _at(sides: _Sides, index: IntArray) -> _Sides:
    return sides[0][index], sides[1][index]


def _flipped(sides: _Sides, width: Int32Array) -> _Sides:
    """Sides of rows after flipping them; rows that nothing touches stay so."""
    low, high = sides
    none = low >= NOWHERE
    return (
        np.where(none, NOWHERE, width - high).astype(np.int32),
        np.where(none, -NOWHERE, width - low).astype(np.int32),
    )


def _extents(size: Int32Array, shape: IntArray, start: FloatArray, end: FloatArray) -> _Sides:
    """First touched pixel and one past the last, for all rows of all shapes one after another."""
    down = (start[:, 1] <= end[:, 1])[:, None]
    upper, lower = np.where(down, start, end), np.where(down, end, start)
    limit = size[shape]
    first = np.clip(np.floor(upper[:, 1] + PIXEL_TOLERANCE), 0, limit[:, 1]).astype(np.int64)
    last = np.clip(np.ceil(lower[:, 1] - PIXEL_TOLERANCE), first, limit[:, 1]).astype(np.int64)
    edge, rank = segments(offsets(last - first))
    y = first[edge] + rank
    run = lower - upper
    slope = np.divide(run[:, 0], run[:, 1], out=np.zeros(len(run)), where=run[:, 1] > 0)[edge]
    # The piece of the edge between the upper and the lower end of the row of pixels.
    from_top = np.clip(y - upper[edge, 1], 0, run[edge, 1])
    to_bottom = np.clip(y + 1 - upper[edge, 1], 0, run[edge, 1])
    a, b = upper[edge, 0] + from_top * slope, upper[edge, 0] + to_bottom * slope
    flat = (run[:, 1] == 0)[edge]
    b = np.where(flat, lower[edge, 0], b)
    width = limit[edge, 0]
    low = np.clip(np.floor(np.minimum(a, b) + PIXEL_TOLERANCE), 0, width).astype(np.int32)
    high = np.clip(np.ceil(np.maximum(a, b) - PIXEL_TOLERANCE), 0, width).astype(np.int32)
    offset = offsets(size[:, 1])
    at = offset[shape[edge]] + y
    left = np.full(int(offset[-1]), NOWHERE, dtype=np.int32)
    right = np.full(int(offset[-1]), -NOWHERE, dtype=np.int32)
    np.minimum.at(left, at, low)
    np.maximum.at(right, at, high)
    none = right <= left
    left[none], right[none] = NOWHERE, -NOWHERE
    return left, right
