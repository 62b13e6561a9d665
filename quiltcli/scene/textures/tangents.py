"""Tangents of triangles that normal maps lie on, made from their texture coordinates.

A map's red goes along the picture's u, its green towards its upper edge. At a corner the tangent is the mean,
weighted by angles, of those of all triangles there that see the picture from the same side, made
perpendicular to the shading normal, which is how maps are baked (Mikkelsen 2008, MikkTSpace).

A file that brings tangents of its own is followed: at its vertices they lie turned by some angle from those
made so, seen from the same side or from the other. That does not change as the mesh moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from quiltcli.geometry import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    IntArray,
    cross,
    dot,
    normalized,
)
from quiltcli.scene.normals import corner_sums, face_normals
from quiltcli.scene.scene import Scene
from quiltcli.scene.textures.coordinates import texture_corners


@dataclass(frozen=True)
class Tangents:
    """Tangents of N of a scene's triangles.

    Attributes:
        row: (T,) their row, −1 for triangles without any.
        table: (N, 10) the first corner's unit tangent, what to add for the second and the third corner, and 1
            where the picture is seen as it is or −1 where it is seen mirrored.
    """

    row: Int32Array
    table: Float32Array


@lru_cache(maxsize=1)
def tangents_of(scene: Scene) -> Tangents | None:
    """Tangents of the triangles whose material has a normal map; None where none has."""
    if scene.textures is None or "normal" not in scene.textures.slots:
        return None
    slot = scene.textures.slots["normal"]
    rows = np.flatnonzero(slot.image.take(scene.material) >= 0)
    row = np.full(len(scene.triangles), -1, dtype=np.int32)
    row[rows] = np.arange(rows.size)
    return Tangents(row, _table(scene, rows, slot.lay))


def _table(scene: Scene, rows: IntArray, lay: int) -> Float32Array:
    """The table (N, 10) of these triangles."""
    assert scene.textures is not None
    triangles = scene.triangles[rows].astype(np.int64)
    places = texture_corners(scene, rows, scene.textures.lays[lay])
    normals, corners, handed = _corners(
        scene.vertices, triangles, scene.normals.astype(np.float64), scene.flat[rows], places
    )
    if scene.turns is not None:
        turns = scene.turns.astype(np.float64)[triangles]
        up = cross(normals, corners) * handed[:, None, None]
        corners = corners * turns[..., :1] + up * turns[..., 1:2]
        handed = handed * turns[:, 0, 2]
    # Where shading normals point into the surface, so does what is made of them.
    own = normalized(face_normals(scene.vertices, triangles))
    outward = dot(own, scene.normals[triangles].astype(np.float64).sum(axis=1))
    handed = np.where((outward < 0) & ~scene.flat[rows], -handed, handed)
    first = corners[:, 0]
    table = np.concatenate((first, corners[:, 1] - first, corners[:, 2] - first, handed[:, None]), axis=1)
    return table.astype(np.float32)


def turns_of(
    given: FloatArray, vertices: FloatArray, triangles: IntArray, normals: FloatArray, places: FloatArray
) -> Float32Array:
    """How tangents of a file lie to those that would be made (V, 3): cosine, sine, and 1 or −1 for the side.

    Args:
        given: (V, 4) tangents, and the sign of normal × tangent that is the picture's upper edge.
        vertices: (V, 3).
        triangles: (T, 3).
        normals: (V, 3) of any length.
        places: (2, 3, T) u and v of the corners in the picture, v down.
    """
    result = np.zeros((len(vertices), 3))
    result[:] = (1, 0, 1)
    flat = np.zeros(len(triangles), dtype=np.bool_)
    normal, corners, handed = _corners(vertices, triangles, normalized(normals), flat, places)
    for k in range(3):
        at = triangles[:, k]
        up = cross(normal[:, k], corners[:, k]) * handed[:, None]
        x, y = dot(given[at, :3], corners[:, k]), dot(given[at, :3], up)
        length = np.sqrt(x * x + y * y)
        good = (length > 1e-6) & np.isfinite(length) & (np.abs(given[at, 3]) == 1)
        row = np.flatnonzero(good)
        result[at[row]] = np.stack(
            (x[row] / length[row], y[row] / length[row], given[at[row], 3] * handed[row]), axis=1
        )
    return result.astype(np.float32)


def _corners(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, flat: BoolArray, places: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit normals and tangents (N, 3, 3) at triangles' corners, and the picture's side (N,)."""
    along, handed = _of_faces(vertices, triangles, places)
    # Corners at one vertex that see the picture from one side share a tangent.
    key = 2 * triangles.ravel() + np.repeat(handed > 0, 3)
    _, group = np.unique(key, return_inverse=True)
    sums = corner_sums(group.reshape(-1), vertices, triangles, along)
    own = normalized(face_normals(vertices, triangles))
    found, corners = np.empty((2, len(triangles), 3, 3))
    for k in range(3):
        found[:, k] = np.where(flat[:, None], own, normals[triangles[:, k]])
        mean = np.where(flat[:, None], along, sums[group.reshape(-1, 3)[:, k]])
        corners[:, k] = _beside(found[:, k], mean, along)
    return found, corners, handed


def _of_faces(vertices: FloatArray, triangles: IntArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The unit direction (N, 3) in which u of the picture grows over triangles, and their side of it (N,)."""
    u, v = places
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    # v is down in the picture, and up is where a map's green goes.
    du, dv = (u[1] - u[0], u[2] - u[0]), (v[0] - v[1], v[0] - v[2])
    area = du[0] * dv[1] - du[1] * dv[0]
    along = (b - a) * dv[1][:, None] - (c - a) * dv[0][:, None]
    handed = np.where(area < 0, -1.0, 1.0)
    along = normalized(along * handed[:, None])
    # A picture of which a triangle shows no area has no direction: any will do.
    return np.where(along.any(axis=1, keepdims=True), along, normalized(b - a)), handed


def _beside(normal: FloatArray, mean: FloatArray, along: FloatArray) -> FloatArray:
    """Unit vectors (N, 3) perpendicular to normals, near `mean`, or else near `along`."""
    result = np.zeros_like(normal)
    for wish in (mean, along, cross(normal, along), np.roll(normal, 1, axis=1)):
        flat = wish - normal * dot(normal, wish)[:, None]
        usable = ~result.any(axis=1) & (dot(flat, flat) > 1e-12 * dot(wish, wish))
        result = np.where(usable[:, None], normalized(flat), result)
    return result
