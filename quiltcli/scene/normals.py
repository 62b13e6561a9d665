"""Shading normals: weld, split where the surface has a crease, and average.

Only additions, products, divisions and square roots are used, which IEEE arithmetic defines to the
last bit, so every machine finds the same normals.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, cross, dot, normalized

CREASE_DEG = 40.0


class Smoothed(NamedTuple):
    """Vertices split so that each has one normal.

    Attributes:
        source: (V,) the vertex of the input each one is a copy of.
        triangles: (T, 3) indices into `source`.
        normals: (V, 3) unit normals, float32.
        group: (V,) numbers, below 3T, that vertices of one normal share.
    """

    source: IntArray
    triangles: IntArray
    normals: Float32Array
    group: IntArray


def smoothed(
    vertices: FloatArray, triangles: IntArray, crease_deg: float = CREASE_DEG, *, keep_sources: bool = False
) -> Smoothed:
    """Angle-weighted vertex normals that do not reach across creases.

    Vertices at the same position count as one. The triangles around it are parted along every edge
    that folds by more than the crease angle (or joins triangles of opposite winding), and each part
    gets its own copy of the vertex.

    Args:
        vertices: (V, 3) positions.
        triangles: (T, 3) indices, no triangle of zero area.
        crease_deg: largest fold that is still smooth, degrees; 180 never splits.
        keep_sources: keep copies apart that stem from different input vertices, because those
            carry other attributes.
    """
    welded = weld(vertices)[triangles]
    face = normalized(face_normals(vertices, triangles))
    group = crease_groups(welded, face, math.cos(math.radians(crease_deg)))
    sums = corner_sums(group, vertices, triangles, face)
    source = triangles.ravel()
    if keep_sources:
        _, first, corner = np.unique(
            group * np.int64(len(vertices)) + source, return_index=True, return_inverse=True
        )
    else:
        used = np.zeros(group.size, dtype=np.bool_)
        used[group] = True
        first, corner = np.flatnonzero(used), (np.cumsum(used) - 1)[group]
    normals = normalized(sums[group[first]])
    # Opposed triangles may cancel to nothing; any of their normals is better than none.
    lost = np.flatnonzero(~normals.any(axis=1))
    normals[lost] = face[first[lost] // 3]
    return Smoothed(source[first], corner.reshape(-1, 3), normals.astype(np.float32), group[first])


def face_normals(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Normals (T, 3) of the triangles, as long as twice their area."""
    a = vertices[triangles[:, 0]]
    return cross(vertices[triangles[:, 1]] - a, vertices[triangles[:, 2]] - a)


def weld(vertices: FloatArray) -> IntArray:
    """For every vertex (V,) the lowest index of a vertex at the same position."""
    order = np.lexsort(vertices.T)
    placed = vertices[order]
    start = np.ones(len(order), dtype=np.bool_)
    start[1:] = (placed[1:] != placed[:-1]).any(axis=1)
    result = np.empty(len(order), dtype=np.int64)
    # The sort is stable, so the first of a run is the lowest.
    result[order] = order[start][np.cumsum(start) - 1]
    return result


def crease_groups(triangles: IntArray, face: FloatArray, cosine: float) -> IntArray:
    """For every corner (3T,) the lowest corner that shares its vertex and its normal.

    Args:
        triangles: (T, 3) welded vertex indices.
        face: (T, 3) unit triangle normals.
        cosine: of the crease angle.
    """
    corner = np.arange(triangles.size)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    following = corner + np.where(corner % 3 == 2, -2, 1)
    one, other = _paired_edges(start, end)
    aligned = start[one] == end[other]
    smooth = aligned & (dot(face[one // 3], face[other // 3]) >= cosine)

    creased = np.zeros(int(start.max()) + 1, dtype=np.bool_)
    creased[start[one[~smooth]]] = True
    creased[end[one[~smooth]]] = True
    first = np.full(creased.size, triangles.size)
    np.minimum.at(first, start, corner)
    group: IntArray = np.where(creased[start], corner, first[start])

    one, other = one[smooth], other[smooth]
    left = np.concatenate((one, following[one]))
    right = np.concatenate((following[other], other))
    keep = creased[start[left]]
    return _connected(group, left[keep], right[keep])


def _paired_edges(start: IntArray, end: IntArray) -> tuple[IntArray, IntArray]:
    """Pairs of half-edges (numbered by the corner they start from) that lie on the same edge."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    key = low * np.int64(int(high.max()) + 1) + high
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    return order[same], order[same + 1]


def _connected(label: IntArray, left: IntArray, right: IntArray) -> IntArray:
    """Spread the lowest label along the links left–right until nothing changes."""
    while True:
        lowest = np.minimum(label[left], label[right])
        spread = label.copy()
        np.minimum.at(spread, left, lowest)
        np.minimum.at(spread, right, lowest)
        spread = spread[spread]
        if np.array_equal(spread, label):
            return label
        label = spread


def corner_sums(group: IntArray, vertices: FloatArray, triangles: IntArray, face: FloatArray) -> FloatArray:
    """Sums (3T, 3) of the triangle normals of each group, weighted by the angle at the corner.

    Args:
        group: (3T,) number below 3T of each corner.
        vertices: (V, 3) positions.
        triangles: (T, 3) indices.
        face: (T, 3) unit triangle normals.
    """
    points = vertices[triangles]
    edge = normalized(np.roll(points, -1, axis=1) - points)
    angle = arccos(-dot(edge, np.roll(edge, 1, axis=1))).ravel()
    owner = np.arange(group.size) // 3
    columns = [np.bincount(group, angle * face[owner, k], minlength=group.size) for k in range(3)]
    return np.stack(columns, axis=1)


def arccos(x: FloatArray) -> FloatArray:
    """Angle in radians within 7e-5 (Abramowitz & Stegun, Handbook of Mathematical Functions, 4.4.45)."""
    a = np.minimum(np.abs(x), 1.0)
    near = np.sqrt(1.0 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - a * 0.0187293)))
    negative: BoolArray = x < 0
    result: FloatArray = np.where(negative, math.pi - near, near)
    return result
