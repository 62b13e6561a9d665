"""Ear clipping: one polygon of any outline cut into triangles (Meisters 1975)."""

from __future__ import annotations

import heapq
from itertools import pairwise

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray

STRAIGHT = 1e-9
"""A turn this much smaller than its two edges is straight: what float64 leaves of a straight line."""

# Ears looked at, for every corner, in outlines that touch or cross themselves, before it is given up.
_LAST_RESORTS = 5

Triangle = tuple[int, int, int]


def ear_clip(points: FloatArray) -> list[Triangle]:
    """Cut one polygon into triangles that cover it exactly, using every corner.

    Of the possible ears the one whose smallest angle is widest goes first, which keeps slivers away. A
    polygon may touch itself, as one does that reaches a hole over a bridge and comes back the same way.
    One that crosses itself has no right answer: it gets triangles all the same.

    Args:
        points: (n, 2) counter-clockwise corners.

    Returns:
        Corner numbers of the triangles, counter-clockwise: n − 2 of them, less those without area.
    """
    clipper = _Clipper(points)
    triangles = []
    while clipper.left > 3:
        ear = clipper.best()
        if ear is None:
            # Neither an ear nor a corner that takes no area with it: the outline crosses itself.
            triangles += clipper.fan()
            return triangles
        if clipper.sine[ear] > STRAIGHT:
            triangles.append(clipper.triangle(ear))
        clipper.cut(ear)
    if clipper.left == 3:
        rest = np.flatnonzero(clipper.alive).tolist()
        triangles.append((rest[0], rest[1], rest[2]))
    return triangles


def ear_sines(before: FloatArray, corner: FloatArray, after: FloatArray) -> FloatArray:
    """Sine (n,) of the smallest angle of each triangle, negative for one that turns to the right."""
    sines = [
        corner_sine(before, corner, after),
        corner_sine(corner, after, before),
        corner_sine(after, before, corner),
    ]
    result: FloatArray = np.min(sines, axis=0)
    return result


def corner_sine(before: FloatArray, corner: FloatArray, after: FloatArray) -> FloatArray:
    """Sine (n,) of the turn at each corner (n, 2)."""
    a, b = corner - before, after - corner
    scale = np.hypot(a[:, 0], a[:, 1]) * np.hypot(b[:, 0], b[:, 1])
    turn: FloatArray = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / np.maximum(scale, 1e-300)
    return turn


def sides(triangle: FloatArray, points: FloatArray) -> FloatArray:
    """Least of the three cross products of edges (..., 3, 2) with points (..., 2): negative outside."""
    edge = np.roll(triangle, -1, axis=-2) - triangle
    local = points[..., None, :] - triangle
    result: FloatArray = (edge[..., 0] * local[..., 1] - edge[..., 1] * local[..., 0]).min(axis=-1)
    return result


class _Clipper:
    """A polygon that loses its corners one by one.

    Attributes:
        left: corners that are left.
        alive: (n,) whether a corner is.
        sine: (n,) of the smallest angle of the triangle that cutting each corner off would make.
    """

    def __init__(self, points: FloatArray) -> None:
        count = len(points)
        self.points = points
        self.left = count
        self.alive = np.ones(count, np.bool_)
        self.before = np.roll(np.arange(count), 1)
        self.after = np.roll(np.arange(count), -1)
        self.sine = ear_sines(points[self.before], points, points[self.after])
        self._version = [0] * count
        self._heap = [(-sine, k, 0) for k, sine in enumerate(self.sine.tolist())]
        heapq.heapify(self._heap)
        # Ears in which a corner lies wait until that corner is cut off.
        self._waiting: dict[int, list[int]] = {}
        size = float(np.abs(points - points[0]).max())
        self._area = size * size * STRAIGHT
        self._near = size * STRAIGHT * (size * STRAIGHT)  # infinite where ** would raise
        # Corners by x: only those in an ear's range of x can lie in it.
        self._order = np.argsort(points[:, 0], kind="stable")
        self._x, self._y = points[self._order].T
        self._spikes = self._flat(np.arange(count), back=True)
        self._tries = _LAST_RESORTS * count

    def triangle(self, corner: int) -> Triangle:
        """What cutting off a corner takes away."""
        return int(self.before[corner]), corner, int(self.after[corner])

    def best(self) -> int | None:
        """The corner to cut off: the widest ear, or one that takes no area with it; None without any."""
        # Spikes first: both sides of one lie on the outline, where nothing could tell inside from outside.
        while self._spikes:
            corner = self._spikes.pop()
            if self.alive[corner] and self._flat(np.array([corner]), back=True):
                return corner
        while self._heap and self._heap[0][0] < -STRAIGHT:
            _, corner, version = heapq.heappop(self._heap)
            if not self.alive[corner] or version != self._version[corner]:
                continue
            held = self._held(corner, -self._area)
            if not len(held):
                return corner
            self._waiting.setdefault(int(held[0]), []).append(corner)
        return self._straight() if (touched := self._touched()) is None else touched

    def cut(self, corner: int) -> None:
        """Take a corner out of the polygon."""
        a, _, c = self.triangle(corner)
        self.alive[corner] = False
        self.left -= 1
        self.after[a], self.before[c] = c, a
        around = np.array([a, c])
        self.sine[around] = ear_sines(
            self.points[self.before[around]], self.points[around], self.points[self.after[around]]
        )
        self._spikes += self._flat(around, back=True)
        for changed in (a, c, *self._waiting.pop(corner, ())):
            if self.alive[changed]:
                self._version[changed] += 1
                entry = (-float(self.sine[changed]), changed, self._version[changed])
                heapq.heappush(self._heap, entry)

    def fan(self) -> list[Triangle]:
        """All that is left as a fan."""
        rest = np.flatnonzero(self.alive).tolist()
        return [(rest[0], a, b) for a, b in pairwise(rest[1:])]

    def _held(self, corner: int, margin: float) -> IntArray:
        """Other corners in the triangle of an ear or, by a negative margin, on its outline.

        Corners at the place of one of its own do not count: where the outline touches itself they must
        not, and an edge that leads from there into the triangle has its other end inside as well.
        """
        ear = self.points[list(self.triangle(corner))]
        first = np.searchsorted(self._x, ear[:, 0].min(), "left")
        last = np.searchsorted(self._x, ear[:, 0].max(), "right")
        near = (self._y[first:last] >= ear[:, 1].min()) & (self._y[first:last] <= ear[:, 1].max())
        others = self._order[first:last][near]
        others = others[self.alive[others]]
        others = others[sides(ear, self.points[others]) >= margin]
        step = self.points[others][:, None] - ear
        apart: BoolArray = ((step * step).sum(axis=2) > self._near).all(axis=1)
        return np.sort(others[apart])

    def _touched(self) -> int | None:
        """The widest ear that others touch from outside, when there is no better one."""
        for corner in self._widest():
            self._tries -= 1
            if self._tries < 0:
                return None
            if not len(self._held(corner, self._area)):
                return corner
        return None

    def _flat(self, corners: IntArray, *, back: bool) -> list[int]:
        """Which corners take no area with them; with `back`, only those where the outline turns back."""
        a, b, c = self.points[self.before[corners]], self.points[corners], self.points[self.after[corners]]
        flat = np.abs(corner_sine(a, b, c)) <= STRAIGHT
        if back:
            flat &= ((b - a) * (c - b)).sum(axis=1) <= 0
        found: list[int] = corners[flat].tolist()
        return found

    def _straight(self) -> int | None:
        found = self._flat(np.flatnonzero(self.alive), back=False)
        return found[0] if found else None

    def _widest(self) -> list[int]:
        corners = np.flatnonzero(self.alive & (self.sine > STRAIGHT))
        order: list[int] = corners[np.argsort(-self.sine[corners], kind="stable")].tolist()
        return order
