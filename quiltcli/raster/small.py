"""Small triangles: every pixel of the bounding box is a candidate, many triangles at a time.

Triangles are sorted into classes of box sizes; inside a class all boxes have one shape, so the edge
functions of thousands of triangles are evaluated by a few broadcasts over (rows, columns, triangles).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray
from quiltcli.raster.blocks import Canvas
from quiltcli.raster.depth import DepthRange
from quiltcli.raster.keys import make_keys, serial_part
from quiltcli.raster.order import BatchOrder
from quiltcli.raster.planes import Planes

SIZES = (1, 2, 3, 4, 6, 8, 12)
LIMIT = SIZES[-1]
_CANDIDATES = 1 << 15
_CLASS_OF = np.searchsorted(np.asarray(SIZES), np.arange(LIMIT + 1)).astype(np.uint16)


def size_classes(box: Int32Array, cut: BoolArray) -> NDArray[np.uint16]:
    """Class (N,) of every box (4, N): its shape, and whether depth must be tested; boxes ≤ LIMIT only."""
    width = box[1] - box[0] + 1
    height = box[3] - box[2] + 1
    classes: NDArray[np.uint16] = (_CLASS_OF[height] * len(SIZES) + _CLASS_OF[width]) * 2 + cut
    return classes


def draw_small(
    planes: Planes,
    rows: IntArray,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None = None,
) -> int:
    """Draw pairs whose boxes are at most LIMIT pixels wide and high.

    Args:
        planes: pairs.
        rows: those to draw.
        canvas: its keys are raised to the nearest surface.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
        by: what to order by instead of 1/t.

    Returns:
        Number of candidate pixels that were evaluated.
    """
    classes = size_classes(planes.box[:, rows], planes.cut[rows])
    order = np.argsort(classes, kind="stable")
    classes, planes = classes[order], planes.take(rows[order])
    bounds = np.flatnonzero(np.diff(classes, prepend=np.uint16(65535), append=np.uint16(65535)))
    candidates = 0
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        shape, cut = divmod(int(classes[first]), 2)
        height, width = SIZES[shape // len(SIZES)], SIZES[shape % len(SIZES)]
        candidates += (last - first) * width * height
        for part in _slices(first, last, _CANDIDATES // (width * height)):
            _draw_boxes(planes, part, (height, width), canvas, limits if cut else None, bits, by)
    return candidates


def _slices(first: int, last: int, step: int) -> Iterator[slice]:
    """Consecutive slices of at most `step` from `first` to `last`."""
    for at in range(first, last, step):
        yield slice(at, min(at + step, last))


def _draw_boxes(
    planes: Planes,
    part: slice,
    shape: tuple[int, int],
    canvas: Canvas,
    limits: DepthRange | None,
    bits: int,
    by: BatchOrder | None,
) -> None:
    """Draw pairs whose boxes all have this (height, width)."""
    height, width = shape
    block = planes.block[part]
    across = canvas.tiles_across[block]
    down = np.diff(canvas.tile_start)[block] // across
    x = np.minimum(planes.box[0, part], across * 8 - width) + np.arange(width)[:, None]
    y = np.minimum(planes.box[2, part], down * 8 - height) + np.arange(height)[:, None]
    fx, fy = x.astype(np.float64), y.astype(np.float64)
    inside = _evaluate(planes.edge[0, :, part], fx, fy)
    for k in (1, 2):
        np.minimum(inside, _evaluate(planes.edge[k, :, part], fx, fy), out=inside)
    inverse = _evaluate(planes.inverse[:, part], fx, fy)
    np.maximum(inverse, planes.low[part], out=inverse)
    np.minimum(inverse, planes.high[part], out=inverse)
    covered = inside > 0
    if limits is not None:
        covered &= limits.keeps(block, fx[None, :, :], fy[:, None, :], inverse)
    drawn = np.flatnonzero(covered)
    if by is not None:
        inverse = by.values(block, fx[None, :, :], fy[:, None, :], inverse)
    column = x + (x >> 3) * 56
    row = (y >> 3) * (across * 64) + (y & 7) * 8 + canvas.tile_start[block] * 64
    address = row[:, None, :] + column
    keys = make_keys(inverse, serial_part(planes.serial[part], bits), bits)
    np.maximum.at(canvas.keys, address.ravel().take(drawn), keys.ravel().take(drawn))


def _evaluate(plane: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Values (height, width, n) of planes (3, n) at columns x (width, n) and rows y (height, n)."""
    rows = plane[1] * y
    rows += plane[2]
    result: FloatArray = rows[:, None, :] + plane[0] * x
    return result
