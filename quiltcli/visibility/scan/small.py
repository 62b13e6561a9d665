"""Small triangles: every pixel of the bounding box is a candidate, many triangles at a time.

Triangles are sorted into classes of box sizes; inside a class all boxes have one shape, so the edge
functions of thousands of triangles are evaluated by a few broadcasts over (rows, columns, triangles).

    boxes of three pairs        their class, 4 × 3          keys of the block
    ┌─────┐ ┌───┐ ┌───────┐     ┌───────┐  x, y begin       ┌───────┬───────┐
    │  ╱╲ │ │╲  │ │╱‾‾‾‾‾╱│  →  │· ■ ■ ·│  at each pair's   │       │  ■ ■  │  the greatest
    │ ╱__╲│ │_╲ │ │____╱  │     │■ ■ ■ ■│  own first pixel  │     ■ │■ ■ ■  │  stays, whoever
    └─────┘ └───┘ └───────┘     │■ ■ ■ ·│               →   └───────┴───────┘  comes first
                                └───────┘

Those that face the eye come first. Most of the others lie behind them, which one look at the
microtiles under their boxes tells, before their planes are made.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, IntArray, slices
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.keys import make_keys, serial_part
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.setup.blocks import Canvas, least_keys
from quiltcli.visibility.setup.planes import Planes, PlaneTable, Warped, depth_bounds

SIZES = (2, 3, 4, 6, 8, 12)
LIMIT = SIZES[-1]
Candidates: TypeAlias = tuple[IntArray, IntArray]
"""Addresses and depth keys of fragments."""
_RUN = 1 << 16
_CANDIDATES = 1 << 16
_SHAPES = len(SIZES) ** 2
_SOME = 8  # of so many microtiles one has to be covered for a look at all pairs to be worth its time


def _class_of(sizes: tuple[int, ...]) -> NDArray[np.uint16]:
    """For a length (LIMIT + 1,) the place in SIZES of the least of these that holds it."""
    least = np.asarray(sizes)[np.searchsorted(np.asarray(sizes), np.arange(LIMIT + 1))]
    return np.searchsorted(np.asarray(SIZES), least).astype(np.uint16)


# A class of few pairs takes as long as one of many: fewer classes then, and larger boxes. Up to a
# microtile wide stays so, for no block is less.
_CLASSES = ((1 << 14, _class_of(SIZES)), (1 << 12, _class_of((2, 4, 8, 12))), (0, _class_of((4, 8, 12))))


def size_classes(pairs: Warped, rows: IntArray) -> NDArray[np.uint16]:
    """Class (R,) of the boxes of some pairs: their shape, and whether depth must be tested."""
    first_x, last_x, first_y, last_y = np.take(pairs.box, rows, axis=1)
    class_of = next(table for least, table in _CLASSES if rows.size >= least)
    classes: NDArray[np.uint16] = class_of.take(last_y - first_y + 1) * np.uint16(len(SIZES))
    classes += class_of.take(last_x - first_x + 1)
    classes += pairs.cut.take(rows) * np.uint16(_SHAPES)
    return classes


def seen_from_behind(corners: FloatArray, handed: FloatArray) -> BoolArray:
    """Which triangles' winding the eye sees clockwise; only the order of drawing depends on it.

    Args:
        corners: (3, 3, N) homogeneous pixels [corner, X/Y/W].
        handed: (N,) sign of the determinant of the blocks' matrices.
    """
    (x0, y0, w0), (x1, y1, w1), (x2, y2, w2) = corners
    determinant = x0 * (y1 * w2 - w1 * y2)
    determinant += y0 * (w1 * x2 - x1 * w2)
    determinant += w0 * (x1 * y2 - y1 * x2)
    determinant *= handed
    result: BoolArray = determinant > 0
    return result


def draw_small(
    pairs: Warped,
    rows: IntArray,
    table: PlaneTable,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None = None,
    covering: IntArray | None = None,
    *,
    culled: bool = False,
) -> int:
    """Draw pairs whose boxes are at most LIMIT pixels wide and high.

    Args:
        pairs: all pairs of the batch.
        rows: those to draw.
        table: is given their planes.
        canvas: its keys are raised to the nearest surface.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
        by: what to order by instead of 1/t.
        covering: (M,) keys that every pixel of a microtile will have at least; pairs behind are left out;
            None with `by`.
        culled: whether none of them faces away.

    Returns:
        Number of candidate pixels that were evaluated.
    """
    # What surely lies behind a larger triangle need not be set up.
    if covering is not None and np.count_nonzero(covering) * _SOME > covering.size:
        rows = rows[~_hidden(pairs, rows, covering, canvas, bits)]
    # Fronts first: the backs of closed bodies, and more besides, are hidden by them then.
    front, back = rows, rows[:0]
    if not culled:
        behind = seen_from_behind(pairs.corners, limits.handed.take(pairs.block)).take(rows)
        front, back = rows[~behind], rows[behind]
    candidates = _draw(pairs, front, table, canvas, limits, bits, by)
    if back.size and by is None:
        back = back[~_hidden(pairs, back, least_keys(canvas), canvas, bits)]
    return candidates + _draw(pairs, back, table, canvas, limits, bits, by)


def candidates_of(
    pairs: Warped,
    rows: IntArray,
    table: PlaneTable,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None,
) -> list[Candidates]:
    """Addresses and keys of all fragments of pairs that lie before what is drawn; the canvas stays as it is.

    Arguments as for `draw_small`.
    """
    found: list[Candidates] = []
    if rows.size:
        _draw(pairs, rows, table, canvas, limits, bits, by, found)
    return found


def _draw(
    pairs: Warped,
    rows: IntArray,
    table: PlaneTable,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None,
    into: list[Candidates] | None = None,
) -> int:
    """Draw pairs by classes, or gather their fragments; the number of candidate pixels."""
    # Classes side by side, and a run of them set up at a time: its planes stay in the cache.
    classes = size_classes(pairs, rows)
    order = np.argsort(classes, kind="stable")
    candidates = 0
    for part in slices(0, order.size, _RUN):
        run = order[part]
        candidates += _draw_run(table.add(pairs, rows[run]), classes[run], canvas, limits, bits, by, into)
    return candidates


def _hidden(pairs: Warped, rows: IntArray, nearest: IntArray, canvas: Canvas, bits: int) -> BoolArray:
    """Which pairs (R,) lie behind everything that is drawn in the microtiles under their boxes.

    Args:
        pairs: the pairs.
        rows: those asked about.
        nearest: (M,) least key of every microtile.
        canvas: the microtiles.
        bits: bits of the serial in a key.
    """
    block = pairs.block.take(rows)
    # Boxes that lie on at most four microtiles, and so have one under each corner, can be told.
    x0, x1, y0, y1 = (np.take(pairs.box, rows, axis=1) >> 3).astype(np.int64)
    across, start = canvas.tiles_across.take(block), canvas.tile_start.take(block)
    # The nearest a pair can be, with the best serial: a key that none of its pixels exceeds.
    _, high = depth_bounds(np.stack([corner[2].take(rows) for corner in pairs.corners]))
    front = high.view(np.int64) | np.int64((1 << bits) - 1)
    upper, lower = start + y0 * across, start + y1 * across
    least = np.minimum(nearest.take(upper + x0), nearest.take(upper + x1))
    np.minimum(least, nearest.take(lower + x0), out=least)
    np.minimum(least, nearest.take(lower + x1), out=least)
    result: BoolArray = (front < least) & (x1 - x0 < 2) & (y1 - y0 < 2)
    return result


def _draw_run(
    planes: Planes,
    classes: NDArray[np.uint16],
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None,
    into: list[Candidates] | None,
) -> int:
    """Draw pairs sorted by class (N,); the number of candidate pixels."""
    # A number that is no class begins and ends the row, so that every class has two bounds.
    bounds = np.flatnonzero(np.diff(classes, prepend=np.uint16(65535), append=np.uint16(65535)))
    candidates = 0
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        cut, shape = divmod(int(classes[first]), _SHAPES)
        height, width = SIZES[shape // len(SIZES)], SIZES[shape % len(SIZES)]
        candidates += (last - first) * width * height
        for part in slices(first, last, _CANDIDATES // (width * height)):
            _draw_boxes(planes[part], (height, width), canvas, limits if cut else None, bits, by, into)
    return candidates


def _draw_boxes(
    planes: Planes,
    shape: tuple[int, int],
    canvas: Canvas,
    limits: DepthRange | None,
    bits: int,
    by: BatchOrder | None,
    into: list[Candidates] | None,
) -> None:
    """Draw pairs whose boxes all have this (height, width), or gather their fragments."""
    height, width = shape
    block = planes.block
    # Numbers of 32 bits are enough for addresses in a batch, and half the memory.
    across, down, start = (
        column.astype(np.int32).take(block)
        for column in (canvas.tiles_across, canvas.tiles_down, canvas.tile_start)
    )
    # A box smaller than its class is widened, to the left or up at the block's far edges.
    x = np.minimum(planes.box[0], across * 8 - width) + np.arange(width, dtype=np.int32)[:, None]
    y = np.minimum(planes.box[2], down * 8 - height) + np.arange(height, dtype=np.int32)[:, None]
    fx, fy = x.astype(np.float64), y.astype(np.float64)
    # Inside is where the least of three edge functions is positive.
    inside = _evaluate(planes.edge[0], fx, fy)
    for k in (1, 2):
        np.minimum(inside, _evaluate(planes.edge[k], fx, fy), out=inside)
    # A sliver's plane of 1/t is steep: off its corners' range it would be noise.
    inverse = _evaluate(planes.inverse, fx, fy)
    np.maximum(inverse, planes.low, out=inverse)
    np.minimum(inverse, planes.high, out=inverse)
    covered = inside > 0
    if limits is not None:
        covered &= limits.keeps(block, fx[None, :, :], fy[:, None, :], inverse)
    drawn = np.flatnonzero(covered)
    if by is not None:
        inverse = by.values(block, fx[None, :, :], fy[:, None, :], inverse)
    # Within a row of microtiles the next one is 64 keys on, not 8; the row below begins after all of them.
    column = x + (x >> 3) * 56
    row = (y >> 3) * (across * 64) + (y & 7) * 8 + start * 64
    address = (row[:, None, :] + column).ravel().take(drawn).astype(np.int64)
    keys = make_keys(serial_part(planes.serial, bits), bits, out=inverse).ravel().take(drawn)
    if into is not None:
        front = keys > np.maximum(canvas.keys.reshape(-1).take(address), 0)
        into.append((address[front], keys[front]))
        return
    np.maximum.at(canvas.keys.reshape(-1), address, keys)
    canvas.touched[address >> 6] = True


def _evaluate(plane: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Values (height, width, n) of planes (3, n) at columns x (width, n) and rows y (height, n)."""
    # What depends on the row alone is summed first, in the order in which sums are exact.
    rows = plane[1] * y
    rows += plane[2]
    result: FloatArray = rows[:, None, :] + plane[0] * x
    return result
