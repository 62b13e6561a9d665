"""Where the outline of a polygon crosses or touches itself."""

from __future__ import annotations

import numpy as np

from quiltcli.formats.mesh.ears import STRAIGHT
from quiltcli.geometry import BoolArray, FloatArray, IntArray


def crossing_edges(points: FloatArray) -> tuple[int, int] | None:
    """First two edges of one polygon that cross, touch or lie on each other, or None.

    Args:
        points: (n, 2) corners; edge k runs from corner k to the next.

    Returns:
        0-based numbers of the edges.
    """
    count = len(points)
    edge = np.roll(points, -1, axis=0) - points
    tolerance = STRAIGHT * float(np.abs(points - points[0]).max())
    for k in range(count):
        after = (k + 1) % count
        if _folds_back(edge[k], edge[after]):
            return min(k, after), max(k, after)
        others = np.arange(k + 2, count if k else count - 1)
        hit = _meet(points, edge, k, others, tolerance)
        if hit.any():
            return k, int(others[np.argmax(hit)])
    return None


def _folds_back(a: FloatArray, b: FloatArray) -> bool:
    turn = a[0] * b[1] - a[1] * b[0]
    scale = np.hypot(a[0], a[1]) * np.hypot(b[0], b[1])
    return bool(abs(turn) <= STRAIGHT * scale and a[0] * b[0] + a[1] * b[1] < 0)


def _meet(points: FloatArray, edge: FloatArray, k: int, others: IntArray, tolerance: float) -> BoolArray:
    """Which of the edges `others` cross edge k or come within `tolerance` of it."""
    p, e = points[k], edge[k]
    q, f = points[others], edge[others]
    start_side, end_side = _side(p, e, q), _side(p, e, q + f)
    from_side, to_side = _side(q, f, p), _side(q, f, p + e)
    proper = (start_side * end_side < 0) & (from_side * to_side < 0)
    gaps = [_gap(p, e, q), _gap(p, e, q + f), _gap(q, f, p), _gap(q, f, p + e)]
    result: BoolArray = proper | (np.min(gaps, axis=0) <= tolerance)
    return result


def _side(origin: FloatArray, direction: FloatArray, point: FloatArray) -> FloatArray:
    local = point - origin
    result: FloatArray = direction[..., 0] * local[..., 1] - direction[..., 1] * local[..., 0]
    return result


def _gap(origin: FloatArray, direction: FloatArray, point: FloatArray) -> FloatArray:
    """Distance of points from segments, either of them one or many."""
    local = point - origin
    along = (local * direction).sum(axis=-1) / np.maximum((direction * direction).sum(axis=-1), 1e-300)
    nearest = np.clip(along, 0, 1)[..., None] * direction
    result: FloatArray = np.hypot(*np.moveaxis(local - nearest, -1, 0))
    return result
