"""Polygons in space as ragged arrays: normals, plane coordinates, shape tests, ear clipping.

Polygons are given as `corners` (C, 3) and `start` (F+1,), as in the display and mesh records.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, cross, dot, next_in_row, normalized, segments

# A turn this much smaller than its two edges is straight: what float64 leaves of a straight line.
_STRAIGHT = 1e-9


def area_vectors(corners: FloatArray, start: IntArray) -> FloatArray:
    """Newell's area vectors (F, 3): along the side the winding faces, as long as twice the area."""
    row, _ = segments(start)
    local = corners - corners[start[:-1]][row]
    result: FloatArray = np.add.reduceat(cross(local, local[next_in_row(start)]), start[:-1], axis=0)
    return result


def diameters(corners: FloatArray, start: IntArray) -> FloatArray:
    """Diagonal (F,) of each polygon's axis-aligned bounding box, the size tolerances refer to."""
    high = np.maximum.reduceat(corners, start[:-1], axis=0)
    extent = high - np.minimum.reduceat(corners, start[:-1], axis=0)
    result: FloatArray = np.sqrt(dot(extent, extent))
    return result


def plane_coordinates(corners: FloatArray, start: IntArray) -> FloatArray:
    """Coordinates (C, 2) in each polygon's plane, counter-clockwise in the order of the winding."""
    row, _ = segments(start)
    normal = normalized(area_vectors(corners, start))
    local = corners - corners[start[:-1]][row]
    # Any axis in the plane does; the world axis farthest from the normal gives the safest one.
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    x = normalized(cross(axis, normal))[row]
    y = cross(normal[row], x)
    return np.stack((dot(local, x), dot(local, y)), axis=1)


def convex(points: FloatArray, start: IntArray, straight: bool = True) -> BoolArray:
    """Whether each polygon (F,) is convex and simple.

    Args:
        points: (C, 2) counter-clockwise plane coordinates.
        start: (F+1,) offsets.
        straight: whether a corner may lie on the line between its neighbours.
    """
    step = next_in_row(start)
    edge = points[step] - points
    after = edge[step]
    turn = edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0]
    ahead = edge[:, 0] * after[:, 0] + edge[:, 1] * after[:, 1]
    scale = np.hypot(edge[:, 0], edge[:, 1]) * np.hypot(after[:, 0], after[:, 1])
    good = turn > _STRAIGHT * scale
    if straight:
        good |= (np.abs(turn) <= _STRAIGHT * scale) & (ahead > 0)
    # All turns to the left could still wind twice, as a pentagram does.
    whole = np.add.reduceat(np.arctan2(turn, ahead), start[:-1])
    result: BoolArray = np.logical_and.reduceat(good, start[:-1]) & (np.abs(whole - 2 * np.pi) < 1)
    return result


def crossing_edges(points: FloatArray) -> tuple[int, int] | None:
    """First two edges of one polygon that cross, touch or lie on each other, or None.

    Args:
        points: (n, 2) corners; edge k runs from corner k to the next.

    Returns:
        0-based numbers of the edges.
    """
    count = len(points)
    edge = np.roll(points, -1, axis=0) - points
    tolerance = _STRAIGHT * float(np.abs(points - points[0]).max())
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
    return bool(abs(turn) <= _STRAIGHT * scale and a[0] * b[0] + a[1] * b[1] < 0)


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


def ear_clip(points: FloatArray) -> list[tuple[int, int, int]]:
    """Cut one simple polygon into n − 2 triangles by cutting off ears (Meisters 1975).

    Of the possible ears the one whose smallest angle is widest goes first, which keeps slivers away.

    Args:
        points: (n, 2) counter-clockwise corners.

    Returns:
        Corner numbers of the triangles, counter-clockwise.
    """
    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        place = _best_ear(points[left])
        if place is None:
            break
        n = len(left)
        triangles.append((left[place - 1], left[place], left[(place + 1) % n]))
        del left[place]
    if len(left) == 3:
        triangles.append((left[0], left[1], left[2]))
    return triangles


def _best_ear(points: FloatArray) -> int | None:
    """Number of the ear whose own smallest angle is widest, or None."""
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    sine = np.min([_corner_sine(before, points, after), _corner_sine(points, after, before),
                   _corner_sine(after, before, points)], axis=0)  # fmt: skip
    for place in np.argsort(-sine, kind="stable"):
        if sine[place] <= _STRAIGHT:
            return None
        if not _holds_corner(points, int(place)):
            return int(place)
    return None


def _corner_sine(before: FloatArray, corner: FloatArray, after: FloatArray) -> FloatArray:
    a, b = corner - before, after - corner
    scale = np.hypot(a[:, 0], a[:, 1]) * np.hypot(b[:, 0], b[:, 1])
    turn: FloatArray = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / np.maximum(scale, 1e-300)
    return turn


def _holds_corner(points: FloatArray, place: int) -> bool:
    """Whether another corner lies in the triangle that would be cut off at `place`."""
    n = len(points)
    a, b, c = points[place - 1], points[place], points[(place + 1) % n]
    others = np.delete(np.arange(n), [(place - 1) % n, place, (place + 1) % n])
    rest = points[others]
    size = float(np.abs(points - points[0]).max()) ** 2 * _STRAIGHT
    outside = (
        (_side(a, b - a, rest) < -size) | (_side(b, c - b, rest) < -size) | (_side(c, a - c, rest) < -size)
    )
    return not bool(outside.all())
