"""Small geometry on arrays: the vector algebra and transforms every stage shares.

World space is right-handed with Y up, in metres, float64. Facet and quilt pixels are continuous
coordinates, x to the right and y down, the first pixel's centre at (0.5, 0.5).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
Float32Array: TypeAlias = NDArray[np.float32]
IntArray: TypeAlias = NDArray[np.int64]
Int32Array: TypeAlias = NDArray[np.int32]
BoolArray: TypeAlias = NDArray[np.bool_]
OwnerArray: TypeAlias = NDArray[np.int16] | NDArray[np.int32]


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the last axis of (..., 3) arrays.

    Written out because two triangles that share an edge must get exactly negated results when the
    arguments trade places: products commute, and x − y is −(y − x), in IEEE arithmetic.
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Dot product along the last axis of (..., 3) arrays, summed in the order x, y, z."""
    result: FloatArray = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return result


def normalized(v: FloatArray) -> FloatArray:
    """Unit vectors along the last axis of `v` (..., 3); zero vectors stay zero."""
    length = np.sqrt(dot(v, v))[..., None]
    result: FloatArray = np.divide(v, length, out=np.zeros_like(v), where=length > 0)
    return result


def rotation_deg(angles: Sequence[float]) -> FloatArray:
    """Rotation matrix (3, 3) that turns about X, then Y, then Z, by `angles` in degrees."""
    turns = []
    for axis, angle in enumerate(angles):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        turns.append(turn)
    return np.asarray(turns[2] @ turns[1] @ turns[0])


def transform(
    translate: Sequence[float] = (0, 0, 0),
    rotate_deg: Sequence[float] = (0, 0, 0),
    scale: float | Sequence[float] = 1.0,
) -> FloatArray:
    """Affine map (4, 4) that scales, then rotates (X, then Y, then Z), then translates."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_deg(rotate_deg) * np.asarray(scale, dtype=np.float64)
    matrix[:3, 3] = translate
    return matrix


def facet_from_world(origin: FloatArray, du: FloatArray, dv: FloatArray) -> FloatArray:
    """Projective maps (F, 3, 4) from world metres to facet pixels, dropping points onto the plane.

    The steps `du` and `dv` (F, 3) need not be perpendicular: point − origin = i·du + j·dv + something
    normal to both, so (i, j) solve the 2×2 normal equations.
    """
    uu, uv, vv = dot(du, du), dot(du, dv), dot(dv, dv)
    det = (uu * vv - uv * uv)[:, None]
    maps = np.zeros((len(origin), 3, 4))
    maps[:, 0, :3] = (vv[:, None] * du - uv[:, None] * dv) / det
    maps[:, 1, :3] = (uu[:, None] * dv - uv[:, None] * du) / det
    maps[:, 0, 3] = -dot(maps[:, 0, :3], origin)
    maps[:, 1, 3] = -dot(maps[:, 1, :3], origin)
    maps[:, 2, 3] = 1
    return maps


def hull(points: FloatArray) -> IntArray:
    """Corners of the convex hull of points (n, 2), as indices, turning from x to y; collinear ones are none.

    Andrew's monotone chain (1979).
    """
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    x, y = points.T.tolist()

    def chain(sequence: list[int]) -> list[int]:
        found: list[int] = []
        for c in sequence:
            while len(found) > 1:
                a, b = found[-2:]
                if (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]) > 0:
                    break
                found.pop()
            found.append(c)
        return found[:-1]

    return np.array(chain(order) + chain(order[::-1]) or order[:1])


def gather_corners(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """Corners (3, 3, N) [corner, axis] of `triangles` (N, 3), contiguous along N."""
    rows = vertices.take(triangles.T.ravel(), axis=0).reshape(3, -1, 3)
    return np.ascontiguousarray(rows.transpose(0, 2, 1))


def slices(first: int, last: int, step: int) -> Iterator[slice]:
    """Consecutive slices of at most `step` from `first` to `last`."""
    for at in range(first, last, step):
        yield slice(at, min(at + step, last))


def shares(costs: FloatArray | IntArray, most: float) -> Iterator[slice]:
    """Consecutive slices of things with these costs (n,): each costs at most `most`, or is of one thing."""
    total, first = np.cumsum(costs), 0
    while first < total.size:
        done = total[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(total, done + most, side="right")))
        yield slice(first, last)
        first = last


def applied(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Matrices (..., 3, 3) applied to vectors (..., 3): a matrix product, with sums in a fixed order."""
    terms = [vectors[..., k, None] * matrices[..., :, k] for k in range(3)]
    result: FloatArray = terms[0] + terms[1] + terms[2]
    return result


def cofactors(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cofactor matrices (..., 3, 3), which are det · inverse transpose, and determinants (...)."""
    found = cross(np.roll(matrices, -1, axis=-2), np.roll(matrices, -2, axis=-2))
    return found, dot(matrices[..., 0, :], found[..., 0, :])


def offsets(counts: Sequence[int] | NDArray[np.integer[Any] | np.bool_]) -> IntArray:
    """Offsets (n+1,) of the rows of a ragged array from their lengths (n,)."""
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def some_rows(start: IntArray, rows: IntArray) -> tuple[IntArray, IntArray]:
    """Some rows of a ragged array alone: their offsets (m+1,), and where in it their elements are (C,)."""
    own = offsets(np.diff(start)[rows])
    row, rank = segments(own)
    return own, start[rows][row] + rank


def segments(start: IntArray) -> tuple[IntArray, IntArray]:
    """Owner and offset of every element of a ragged array.

    Args:
        start: (n+1,) offsets, element k of row i standing at start[i] + k.

    Returns:
        row (C,) the row each element belongs to, and rank (C,) its place inside the row.
    """
    counts = np.diff(start)
    row = np.repeat(np.arange(counts.size), counts)
    return row, np.arange(start[-1]) - start.take(row)


def next_in_row(start: IntArray) -> IntArray:
    """Index (C,) of every element's successor inside its row, the last one's being the first."""
    row, rank = segments(start)
    counts = np.diff(start)[row]
    result: IntArray = start[row] + (rank + 1) % counts
    return result
