"""Which pixels a triangle may show at: boxes around its corners' pixels, wide enough for how edges bend.

The map from points to pixels is smooth; where its second derivative is at most K, a triangle whose longest
edge is L leaves the hull of its corners' pixels by at most K L² / 6. The edge functions of `forms` decide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray
from quiltcli.ring.curve import Curve
from quiltcli.ring.maps import forward
from quiltcli.ring.rays import Window
from quiltcli.ring.rig import Pose

_ROUNDING = 2e-6
_GRID = 6
_STEP = 1e-3


@dataclass(frozen=True)
class Bending:
    """How far the map from points to pixels is from a linear one, in and near a box.

    Attributes:
        most: twice the largest second derivative found, pixels / m².
        front: 1 where triangles that face the viewer are wound as x and y are, −1 where they are not.
    """

    most: float
    front: float


@dataclass(frozen=True)
class Boxes:
    """N triangles that may show, and rectangles of pixels that hold all at which they do.

    Attributes:
        triangle: (N,) numbers.
        x: (N,) first columns.
        y: (N,) first rows.
        width: (N,) pixels, at least 1.
        height: (N,) pixels, at least 1.
    """

    triangle: IntArray
    x: IntArray
    y: IntArray
    width: IntArray
    height: IntArray

    @property
    def window(self) -> Window:
        """The rectangle around all of them."""
        if not self.triangle.size:
            return Window(0, 0, 0, 0)
        x, y = int(self.x.min()), int(self.y.min())
        right, bottom = int((self.x + self.width).max()), int((self.y + self.height).max())
        return Window(x, y, right - x, bottom - y)


def bending(pose: Pose, curve: Curve, least: FloatArray, most: FloatArray) -> Bending:
    """Second differences of `forward` over a box (3,) to (3,) of the frame.

    The largest of a grid is doubled; a test holds boxes against the pixels that triangles cover.
    """
    spans = [np.linspace(low, high, _GRID) for low, high in zip(least, most, strict=True)]
    grid = np.stack(np.meshgrid(*spans, indexing="ij")).reshape(3, -1)
    around = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
    points = np.concatenate([grid + _STEP * np.array(offset)[:, None] for offset in around], axis=1)
    places = np.stack(forward(pose, curve, points)[:2]).reshape(2, 3, 3, 3, -1)
    middle = places[:, 1, 1, 1]
    squares = np.zeros(grid.shape[1])
    for axis in range(3):
        along = np.moveaxis(places, 1 + axis, 1)
        squares += ((along[:, 2, 1, 1] - 2 * middle + along[:, 0, 1, 1]) ** 2).sum(axis=0)
        for other in range(axis):
            both = np.moveaxis(places, (1 + axis, 1 + other), (1, 2))
            mixed = (both[:, 2, 2, 1] - both[:, 2, 0, 1] - both[:, 0, 2, 1] + both[:, 0, 0, 1]) / 4
            squares += 2 * (mixed * mixed).sum(axis=0)
    # f × y = e: corners at a point, beside it and above it face the viewer.
    beside = places[:, 1, 2, 1, 0] - middle[:, 0]
    above = places[:, 1, 1, 2, 0] - middle[:, 0]
    turn = beside[0] * above[1] - beside[1] * above[0]
    return Bending(2 * float(np.sqrt(squares.max())) / _STEP**2, float(np.sign(turn)))


def propose(
    x: FloatArray,
    y: FloatArray,
    triangles: Int32Array,
    square: FloatArray,
    bend: Bending,
    size: tuple[int, int],
    beside: tuple[float, float],
    backface_culling: bool,
) -> Boxes:
    """Boxes of the triangles that may show at a pixel's sample.

    Args:
        x: (V,) pixels of the vertices.
        y: (V,).
        triangles: (3, T) vertices of the corners.
        square: (T,) squared longest edges, m².
        bend: how the map bends.
        size: width and height of the picture.
        beside: of the samples, pixels from the centres.
        backface_culling: leave out what clearly faces away; pixels decide where it is not clear.
    """
    ax, bx, cx = (x.take(corner) for corner in triangles)
    ay, by, cy = (y.take(corner) for corner in triangles)
    margin = square * (bend.most / 6)
    margin += _ROUNDING
    columns = _range(ax, bx, cx, margin, beside[0], size[0])
    rows = _range(ay, by, cy, margin, beside[1], size[1])
    shown: BoolArray = (columns[1] >= columns[0]) & (rows[1] >= rows[0])
    if backface_culling:
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        reach = np.abs(bx - ax) + np.abs(by - ay) + np.abs(cx - ax) + np.abs(cy - ay)
        shown &= area * bend.front > -4 * margin * (reach + margin)
    kept = np.flatnonzero(shown)
    left, right, top, bottom = (values.take(kept).astype(np.int64) for values in (*columns, *rows))
    return Boxes(kept, left, top, right - left + 1, bottom - top + 1)


def _range(
    a: FloatArray, b: FloatArray, c: FloatArray, margin: FloatArray, beside: float, size: int
) -> tuple[FloatArray, FloatArray]:
    """First and last pixel (T,) whose samples lie between the least and the greatest of three numbers."""
    shift = 0.5 + beside
    least = np.minimum(a, b)
    np.minimum(least, c, out=least)
    least -= margin
    least -= shift
    np.ceil(least, out=least)
    most = np.maximum(a, b)
    np.maximum(most, c, out=most)
    most += margin
    most -= shift
    np.floor(most, out=most)
    np.maximum(least, 0, out=least)
    np.minimum(most, size - 1, out=most)
    return least, most
