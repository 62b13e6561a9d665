"""Points that are meant to be one: equal within a millionth of the whole display's size."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray

SAME_POINT = 1e-6  # of the display's size

# One of each pair of opposite neighbours of a grid cell.
_NEIGHBOURS = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)]


def tolerance(points: FloatArray) -> float:
    """Distance under which two points (C, 3) of one display are the same."""
    return SAME_POINT * float(np.linalg.norm(np.ptp(points, axis=0)))


def weld(points: FloatArray) -> IntArray:
    """Number (C,) every point so that points within the tolerance of each other share a number.

    Numbers count up in the order in which their points first appear. Points are sorted into the
    cells of a grid of the tolerance's size; only cells that touch can hold the same point.
    """
    size = tolerance(points)
    cells = np.floor((points - points.min(axis=0)) / (size or 1.0)).astype(np.int64)
    unique, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    label = _join(unique, points[first], size)
    _, where, number = np.unique(first[label][inverse.reshape(-1)], return_index=True, return_inverse=True)
    order = np.argsort(where, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[number.reshape(-1)]


def _join(cells: IntArray, points: FloatArray, size: float) -> IntArray:
    """Least cell number reachable from each of the sorted, distinct `cells` over close neighbours."""
    place = {cell: index for index, cell in enumerate(map(tuple, cells.tolist()))}
    label = np.arange(len(cells))
    pairs = [
        (index, other)
        for (x, y, z), index in place.items()
        for dx, dy, dz in _NEIGHBOURS
        if (other := place.get((x + dx, y + dy, z + dz), -1)) >= 0
    ]
    if not pairs:
        return label
    a, b = np.array(pairs).T
    close = np.linalg.norm(points[a] - points[b], axis=1) <= size
    a, b = a[close], b[close]
    while True:
        joined = label.copy()
        np.minimum.at(joined, a, label[b])
        np.minimum.at(joined, b, label[a])
        if np.array_equal(joined, label):
            return label
        label = joined
