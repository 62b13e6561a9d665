"""Where the corners of triangles lie in pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import FloatArray, Int32Array, IntArray
from quiltcli.scene.scene import Scene
from quiltcli.scene.textures.pool import Lay

FARTHEST = 2.0**40
"""Pictures away from the first, beyond which there is none."""


def corner_coordinates(
    scene: Scene, triangle: Int32Array | IntArray, uv_set: NDArray[Any] | int
) -> FloatArray:
    """Texture coordinates (2, 3, S) of the corners of triangles (S,), v up; 0 where there are none."""
    corner = scene.triangles.take(triangle, axis=0)
    result = np.zeros((*corner.shape, 2))
    for number, uv in enumerate((scene.uv, scene.uv1)):
        rows = np.flatnonzero(np.broadcast_to(uv_set == number, triangle.shape))
        if uv is not None and rows.size:
            result[rows] = np.nan_to_num(uv.take(corner[rows], axis=0), nan=0.0)
    return np.ascontiguousarray(result.transpose(2, 1, 0))


def texture_corners(scene: Scene, triangle: Int32Array | IntArray, lay: Lay) -> FloatArray:
    """Places (2, 3, S) of the corners of triangles (S,) in the pictures that lie on them so, v down."""
    material = scene.material.take(triangle)
    u, v = corner_coordinates(scene, triangle, lay.uv_set.take(material))
    v = 1.0 - v
    rows = lay.matrix.take(material, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        found = np.stack([rows[:, k, 0] * u + rows[:, k, 1] * v + rows[:, k, 2] for k in range(2)])
        # Places so far away are no places: no texel could be told from the next.
        nowhere = ~(np.abs(found) < FARTHEST)
    return np.where(nowhere, 0.0, found) if nowhere.any() else found
