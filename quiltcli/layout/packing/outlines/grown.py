"""Outlines grown by a square."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from quiltcli.formats.mesh.crossings import crossing_edges
from quiltcli.geometry import FloatArray

_SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Corners of the square of half side 1: number k is furthest in directions from k to k + 1 quarter turns."""

_CLOSE = 1e-9


def grown_by_square(polygon: FloatArray, half: float) -> FloatArray:
    """The outline of all points within `half` of a polygon, in x and in y: its sum with a square.

    Along a corner that points outwards lie those corners of the square that are furthest between the
    normals of its sides; at one that points inwards the moved sides meet. Where that makes sides
    cross, as in a notch that growing closes, the convex hull is grown instead.

    Args:
        polygon: (n, 2) corners of a simple polygon, either way round.
        half: half of the square's side.

    Returns:
        (m, 2) corners, turning from x to y.
    """
    polygon = polygon[np.abs(polygon - np.roll(polygon, 1, axis=0)).max(axis=1) > _CLOSE]
    if _twice_area(polygon) < 0:
        polygon = polygon[::-1]
    grown = np.array(list(_corners(polygon, half)))
    if crossing_edges(grown) is not None:
        grown = np.array(list(_corners(hull(polygon), half)))
    return grown


def _corners(polygon: FloatArray, half: float) -> Iterator[FloatArray]:
    before, after = polygon - np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0) - polygon
    for corner, a, b in zip(polygon, before, after, strict=True):
        turn = math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b))
        normal = math.atan2(-a[0], a[1]) / (math.pi / 2)
        if turn >= 0:
            last = math.ceil(normal + turn / (math.pi / 2) - _CLOSE)
            for quarter in range(math.floor(normal + _CLOSE), max(last, math.floor(normal + _CLOSE) + 1)):
                yield corner + half * _SQUARE[quarter % 4]
        else:
            yield corner + half * _meeting(a, b)


def _meeting(a: FloatArray, b: FloatArray) -> FloatArray:
    """Where sides along `a` and `b` meet after they were moved out by the square of half side 1."""
    normals = np.array([[a[1], -a[0]], [b[1], -b[0]]])
    result: FloatArray = np.linalg.solve(normals, np.abs(normals).sum(axis=1))
    return result


def hull(points: FloatArray) -> FloatArray:
    """Corners (m, 2) of the convex hull, turning from x to y (Andrew 1979)."""
    ordered = np.unique(points, axis=0)
    chains = []
    for run in (ordered, ordered[::-1]):
        chain: list[FloatArray] = []
        for point in run:
            while len(chain) > 1 and _twice_area(np.array([*chain[-2:], point])) <= 0:
                chain.pop()
            chain.append(point)
        chains += chain[:-1]
    return np.array(chains)


def _twice_area(polygon: FloatArray) -> float:
    x, y = polygon.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
