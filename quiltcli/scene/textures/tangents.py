"""Tangents of triangles that normal maps lie on, made from their texture coordinates.

A map's red goes along the picture's u, its green towards its upper edge. At a corner the tangent is the mean,
weighted by angles, of those of all triangles there that see the picture from the same side, made
perpendicular to the shading normal, which is how maps are baked (Mikkelsen 2008, MikkTSpace).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray, cross, dot, normalized
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
    triangles = scene.triangles[rows].astype(np.int64)
    along, handed = _of_faces(scene, rows, triangles, lay)
    # Corners at one vertex that see the picture from one side share a tangent.
    key = 2 * triangles.ravel() + np.repeat(handed > 0, 3)
    _, group = np.unique(key, return_inverse=True)
    sums = corner_sums(group.reshape(-1), scene.vertices, triangles, along)
    own = normalized(face_normals(scene.vertices, triangles))
    flat = scene.flat[rows]
    corners = np.empty((rows.size, 3, 3))
    for k in range(3):
        normal = np.where(flat[:, None], own, scene.normals[triangles[:, k]].astype(np.float64))
        mean = np.where(flat[:, None], along, sums[group.reshape(-1, 3)[:, k]])
        corners[:, k] = _beside(normal, mean, along)
    # Where shading normals point into the surface, so does what is made of them.
    outward = dot(own, scene.normals[triangles].astype(np.float64).sum(axis=1))
    handed = np.where((outward < 0) & ~flat, -handed, handed)
    first = corners[:, 0]
    table = np.concatenate((first, corners[:, 1] - first, corners[:, 2] - first, handed[:, None]), axis=1)
    return table.astype(np.float32)


def _of_faces(scene: Scene, rows: IntArray, triangles: IntArray, lay: int) -> tuple[FloatArray, FloatArray]:
    """The unit direction (N, 3) in which u of the picture grows over triangles, and their side of it (N,)."""
    assert scene.textures is not None
    u, v = texture_corners(scene, rows, scene.textures.lays[lay])
    a, b, c = (scene.vertices[triangles[:, k]] for k in range(3))
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
