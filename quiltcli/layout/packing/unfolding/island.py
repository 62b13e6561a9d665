"""An island: facets laid out flat beside each other, in pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, next_in_row, segments
from quiltcli.layout.packing.model import PackInput

GRID = 2.0**-16
"""Pixels to which corners are rounded, so that common corners are the same to the last bit."""

_CLOSE = 0.002  # pixels within which a corner of the same mesh vertex is the same corner
_SHRUNK = 1e-6  # a facet is this much smaller, in parts of itself, when it is held against others
_LEAST_FILL = 0.5  # of its box an island of more than a few facets must cover
_FEW = 4


@dataclass(frozen=True)
class Island:
    """Facets that hang together.

    Attributes:
        corner: (N,) corners of the packing's input, facet after facet.
        position: (N, 2) where they lie.
        following: (N, 2) where the next corner of the same facet lies.
        facet: (N,) facet of each corner.
        area: pixels the facets cover.
        most: width and height of the page, which bound the island's.
    """

    corner: IntArray
    position: FloatArray
    following: FloatArray
    facet: IntArray
    area: float
    most: tuple[int, int]

    @staticmethod
    def of(wanted: PackInput, corner: IntArray, position: FloatArray) -> Island:
        """One facet, whose corners are these, or several."""
        facet_of, _ = segments(wanted.corner_start)
        facet = facet_of[corner]
        first = np.flatnonzero(np.diff(facet, prepend=-1))
        following = position[next_in_row(np.append(first, len(facet)))]
        cross = position[:, 0] * following[:, 1] - position[:, 1] * following[:, 0]
        area = float(np.abs(np.add.reduceat(cross, first)).sum() / 2)
        return Island(corner, position, following, facet, area, wanted.page)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in whole pixels of an island that starts at 0."""
        width, height = np.ceil(self.position.max(axis=0) - 0.01).astype(int)
        return max(int(width), 1), max(int(height), 1)

    def edge(self, corner: int) -> tuple[FloatArray, FloatArray]:
        """Where the edge that starts at a corner begins and ends."""
        at = int(np.flatnonzero(self.corner == corner)[0])
        return self.position[at], self.following[at]

    def welded(self, wanted: PackInput, corner: IntArray, position: FloatArray) -> FloatArray:
        """Positions of new corners, taken from the island where it has the same corner of the mesh."""
        assert wanted.vertex is not None
        same = wanted.vertex[corner][:, None] == wanted.vertex[self.corner]
        away = np.abs(position[:, None] - self.position).max(axis=2)
        away[~same] = np.inf
        nearest = away.argmin(axis=1)
        close = away[np.arange(len(corner)), nearest] <= _CLOSE
        return np.where(close[:, None], self.position[nearest], position)

    def plus(self, wanted: PackInput, corner: IntArray, position: FloatArray) -> Island | None:
        """The island with one more facet, unless that lies on another or makes it sparse or too large."""
        facet = Island.of(wanted, corner, position)
        if self._overlaps(facet):
            return None
        both = Island(
            np.concatenate((self.corner, facet.corner)),
            np.concatenate((self.position, facet.position)),
            np.concatenate((self.following, facet.following)),
            np.concatenate((self.facet, facet.facet)),
            self.area + facet.area,
            self.most,
        )
        width, height = np.ptp(both.position, axis=0)
        large = (np.sort((width, height)) > np.sort(self.most)).any()
        sparse = len(both.corner) > _FEW * len(corner) and both.area < _LEAST_FILL * width * height
        return None if large or sparse else both

    def _overlaps(self, facet: Island) -> bool:
        """Whether a facet lies on part of the island; edges may touch."""
        centre = facet.position.mean(axis=0)
        a = centre + (facet.position - centre) * (1 - _SHRUNK)
        b = centre + (facet.following - centre) * (1 - _SHRUNK)
        low, high = a.min(axis=0), a.max(axis=0)
        near = (np.maximum(self.position, self.following) >= low).all(axis=1)
        near &= (np.minimum(self.position, self.following) <= high).all(axis=1)
        if _cross(a, b, self.position[near], self.following[near]):
            return True
        first = np.flatnonzero(np.diff(self.facet, prepend=-1))
        middles = np.add.reduceat(self.position, first) / np.diff(np.append(first, len(self.facet)))[:, None]
        if _inside(middles, a, b).any():
            return True
        inside = _inside_each(centre, self.position, self.following, first)
        return bool(inside.any())


def _cross(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Whether any segment a–b (n, 2) crosses any segment c–d (m, 2)."""
    a, b = a[:, None], b[:, None]
    one = _side(a, b, c) * _side(a, b, d) < 0
    other = _side(c, d, a) * _side(c, d, b) < 0
    return bool((one & other).any())


def _side(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    result: FloatArray = np.sign(
        (b[..., 0] - a[..., 0]) * (p[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (p[..., 0] - a[..., 0])
    )
    return result


def _passes(points: FloatArray, a: FloatArray, b: FloatArray) -> np.ndarray:
    """Which edges a–b lie to the right of which points, on their level."""
    x, y = points[..., 0], points[..., 1]
    level = (a[:, 1] <= y) != (b[:, 1] <= y)
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    return np.asarray(level & (x < a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])))


def _inside(points: FloatArray, a: FloatArray, b: FloatArray) -> np.ndarray:
    """Which points (n, 2) lie inside one polygon of edges a–b."""
    return np.asarray(_passes(points[:, None], a, b).sum(axis=1) % 2 == 1)


def _inside_each(point: FloatArray, a: FloatArray, b: FloatArray, first: IntArray) -> np.ndarray:
    """Which of the polygons that begin at `first` a point lies in."""
    return np.asarray(np.add.reduceat(_passes(point, a, b).astype(np.int64), first) % 2 == 1)


def least_box(island: Island) -> Island:
    """The island turned so that its box is smallest, lying at the origin on the grid.

    One of the box's sides lies along an edge (Freeman & Shapira 1975, for convex hulls).
    """
    run = island.following - island.position
    angles = np.append(0, np.unique(np.round(np.arctan2(run[:, 1], run[:, 0]) % (np.pi / 2), 6)))
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = island.position[:, :1], island.position[:, 1:]
    sides = np.stack((np.ptp(x * cos + y * sin, axis=0), np.ptp(y * cos - x * sin, axis=0)))
    # As it lies it fits the page; a smaller box may be too long.
    large = (np.sort(sides, axis=0) > np.sort(island.most)[:, None]).any(axis=0)
    box = np.where(large, np.inf, np.round(sides[0] * sides[1], 3))
    best = int(np.argmin(np.append(sides[0, 0] * sides[1, 0], box[1:])))
    c, s = cos[best], sin[best]

    def turned(points: FloatArray) -> FloatArray:
        result: FloatArray = np.stack(
            (points[:, 0] * c + points[:, 1] * s, points[:, 1] * c - points[:, 0] * s), axis=1
        )
        return result

    low = turned(island.position).min(axis=0)
    position = np.rint((turned(island.position) - low) / GRID) * GRID
    following = np.rint((turned(island.following) - low) / GRID) * GRID
    return Island(island.corner, position, following, island.facet, island.area, island.most)
