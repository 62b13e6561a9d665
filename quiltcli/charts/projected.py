"""Points of a screen that a projector's pixels light, and the first points that its rays meet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.charts.grids import Grid
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot

_SMALL = 32  # pixels across and down of boxes that are looked at many at a time
_AT_A_TIME = 1 << 20  # places
_BEHIND = 1e-9  # of the farthest depth


@dataclass(frozen=True, eq=False)
class Projected:
    """The shape of a projector's picture on a screen.

    Between pixel centres points go on by cubic curves; normals are those of the nearest pixel.

    Attributes:
        grid: a point for each pixel.
        upright: (3, H, W) unit normals of the screen on the projector's side.
    """

    grid: Grid
    upright: FloatArray

    @property
    def known(self) -> BoolArray:
        """See `Shape.known`."""
        return self.grid.known

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.at`."""
        return self.grid.at(s, t)

    def normal(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """Unit normals (3, ...) on the projector's side."""
        _, height, width = self.upright.shape
        column = np.clip(np.floor(np.asarray(s) * width), 0, width - 1).astype(np.int64)
        row = np.clip(np.floor(np.asarray(t) * height), 0, height - 1).astype(np.int64)
        place = row * width + column
        return np.stack([axis.reshape(-1).take(place) for axis in self.upright])


def first_met(corners: FloatArray, size: tuple[int, int]) -> tuple[Int32Array, FloatArray]:
    """The triangle that the ray through each pixel's centre meets first, from either side.

    A pixel is in a triangle where the three edge functions of homogeneous pixels agree in sign: nothing is
    clipped at the projector (Olano and Greer, *Triangle scan conversion using 2D homogeneous coordinates*,
    1997). On an edge both triangles have it; the nearer one is taken, and of equals the first.

    Args:
        corners: (T, 3, 3) homogeneous pixels of corners: x·w, y·w and the depth w.
        size: width and height of the picture.

    Returns:
        (P,) triangles by pixel, row by row, −1 for none, and (P,) depths w, infinite there.
    """
    width, height = size
    found, depth = np.full(width * height, -1, dtype=np.int32), np.full(width * height, np.inf)
    a, b, c = (corners[:, k] for k in range(3))
    edges = np.stack((cross(b, c), cross(c, a), cross(a, b)), axis=1)
    volume = dot(a, edges[:, 0])
    edges = edges * np.sign(volume)[:, None, None]
    volume = np.abs(volume)
    low, high = _boxes(corners, size)
    used = np.flatnonzero((volume > 0) & (high >= low).all(axis=1) & (corners[:, :, 2] > 0).any(axis=1))
    for some, x0, y0, wide, tall in _batches(used, low, high):
        x = (x0[:, None] + np.arange(wide) + 0.5)[:, None, :]
        y = (y0[:, None] + np.arange(tall) + 0.5)[:, :, None]
        e = edges[some][..., None, None]
        inner = [e[:, k, 0] * x + e[:, k, 1] * y + e[:, k, 2] for k in range(3)]
        total = inner[0] + inner[1] + inner[2]
        inside = (inner[0] >= 0) & (inner[1] >= 0) & (inner[2] >= 0) & (total > 0)
        inside &= (x < width) & (y < height)
        which, row, column = np.nonzero(inside)
        away = volume[some[which]] / total[which, row, column]
        pixel = (row + y0[which]) * width + column + x0[which]
        # Nearest first, then the first triangle: of those at one pixel the first stays.
        order = np.lexsort((some[which], away, pixel))
        pixel, away, triangle = pixel[order], away[order], some[which][order]
        first = np.append(True, pixel[1:] != pixel[:-1]) if pixel.size else np.zeros(0, dtype=np.bool_)
        pixel, away, triangle = pixel[first], away[first], triangle[first]
        nearer = (away < depth[pixel]) | ((away == depth[pixel]) & (triangle < found[pixel]))
        depth[pixel[nearer]], found[pixel[nearer]] = away[nearer], triangle[nearer]
    return found, depth


def _boxes(corners: FloatArray, size: tuple[int, int]) -> tuple[IntArray, IntArray]:
    """First and last pixel (T, 2) of triangles in the picture; all of it where one reaches behind."""
    w = corners[..., 2:]
    ahead = (w > _BEHIND * np.abs(w).max(initial=0)).all(axis=(1, 2))
    place = corners[..., :2] / np.where(ahead[:, None, None], w, 1.0)
    last = np.array(size) - 1
    low = np.where(ahead[:, None], np.ceil(np.clip(place.min(axis=1), -1e9, 1e9) - 0.5), 0)
    high = np.where(ahead[:, None], np.floor(np.clip(place.max(axis=1), -1e9, 1e9) - 0.5), last)
    return np.maximum(low, 0).astype(np.int64), np.minimum(high, last).astype(np.int64)


def _batches(
    used: IntArray, low: IntArray, high: IntArray
) -> Iterator[tuple[IntArray, IntArray, IntArray, int, int]]:
    """Triangles whose boxes are alike, with corners x0, y0 (n,), width and height of what is looked at."""
    side = (high - low + 1)[used]
    small = side.max(axis=1, initial=0) <= _SMALL
    rounded = 1 << np.ceil(np.log2(np.maximum(side, 1))).astype(np.int64)
    key = rounded[:, 0] * (2 * _SMALL) + rounded[:, 1]
    for kind in np.unique(key[small]).tolist():
        mine = used[small & (key == kind)]
        wide, tall = divmod(kind, 2 * _SMALL)
        step = max(_AT_A_TIME // (wide * tall), 1)
        for first in range(0, mine.size, step):
            some = mine[first : first + step]
            yield some, low[some, 0], low[some, 1], wide, tall
    for triangle in used[~small].tolist():
        (x0, y0), (x1, y1) = low[triangle], high[triangle]
        step = max(_AT_A_TIME // int(x1 - x0 + 1), 1)
        for y in range(int(y0), int(y1) + 1, step):
            tall = min(step, int(y1) + 1 - y)
            yield np.array([triangle]), np.array([x0]), np.array([y]), int(x1 - x0 + 1), tall
