"""How triangles move from one frame to the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.scene.scene import Scene, corner_table


def followed(now: Scene, then: Scene) -> tuple[Scene, tuple[str, ...]]:
    """A scene that knows how its triangles move until it is another.

    Args:
        now: the scene.
        then: the same objects later.

    Returns:
        the scene with its `corner_motion`, and the names of objects whose triangles are others then.
    """
    if then.vertices is now.vertices and then.triangles is now.triangles:
        return (now if now.corner_motion is None else replace(now, corner_motion=None)), ()
    if then.triangles is now.triangles:
        table = corner_table((then.vertices - now.vertices).astype(np.float32), now.triangles)
        return _knowing(now, table), ()
    table = np.full((len(now.triangles), 9), np.nan, dtype=np.float32)
    lost = []
    for index, name in enumerate(now.objects):
        mine, theirs = (np.flatnonzero(scene.object == index) for scene in (now, then))
        triangles, others = now.triangles[mine], then.triangles[theirs]
        if not _same_triangles(now.vertices, triangles, then.vertices, others):
            lost.append(name)
            continue
        # Corner by corner: vertices may be parted at other creases.
        place = np.arange(3 * len(mine), dtype=np.int32).reshape(-1, 3)
        moves = then.vertices[others.ravel()] - now.vertices[triangles.ravel()]
        table[mine] = corner_table(moves.astype(np.float32), place)
    return _knowing(now, table), tuple(lost)


def _knowing(scene: Scene, table: Float32Array) -> Scene:
    """The scene with another table of motion, and all else that is known of it."""
    tables = {name: value for name, value in vars(scene).items() if name in _KEPT}
    return replace(scene, corner_motion=table).knowing(**tables)


_KEPT = ("planes", "facing", "corner_normals", "corner_colors", "soft", "corner_opacities")


def _same_triangles(a: FloatArray, some: Int32Array, b: FloatArray, others: Int32Array) -> bool:
    """Whether triangles of vertices `a` meet one another at the same corners as those of `b`."""
    if len(some) != len(others):
        return False
    if np.array_equal(some - some.min(initial=0), others - others.min(initial=0)):
        return True
    return np.array_equal(_meetings(a, some), _meetings(b, others))


def _meetings(vertices: FloatArray, triangles: Int32Array) -> IntArray:
    """For each corner (3T,) the first that lies at its place, however vertices are parted there."""
    corners = vertices[triangles.ravel()]
    _, first, place = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first[place.reshape(-1)])
