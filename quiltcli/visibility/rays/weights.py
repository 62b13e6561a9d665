"""Where on its triangle a ray's point lies: barycentric weights, and how they change from pixel to pixel."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, cross, dot
from quiltcli.visibility.rays.embree import Target


def barycentric(target: Target, triangle: IntArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Barycentric weights (P,) of the second and third corner at points (P, 3) of triangles (P,)."""
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    normal = target.plane[triangle, :3]
    area = dot(normal, normal)
    second = dot(normal, cross(position - a, c - a)) / area
    return second, dot(normal, cross(b - a, position - a)) / area


def weight_slopes(
    target: Target, triangle: IntArray, matrix: FloatArray, ray: FloatArray, position: FloatArray
) -> FloatArray:
    """How the weights of points change from pixel to pixel (2, 2, P) [weight, axis].

    A point is p = t·d with n·p constant, so along an axis p' = t·(d' − d·(n·d')/(n·d)).

    Args:
        target: the scene.
        triangle: (P,) which triangles.
        matrix: (P, 3, 3) page pixel (x, y, 1) → direction from the eye.
        ray: (P, 3) directions.
        position: (P, 3) points minus where their rays begin. That neighbours may begin beside one another
            is left out: it is little, and textures alone are filtered by it.
    """
    normal = target.plane[triangle, :3]
    along = dot(normal, ray)
    scale = dot(position, ray) / dot(ray, ray)
    a = target.corners[target.triangles[triangle, 0]]
    result = np.empty((2, 2, triangle.size))
    for axis in range(2):
        step = matrix[:, :, axis]
        moved = scale[:, None] * (step - ray * (dot(normal, step) / along)[:, None])
        result[:, axis] = barycentric(target, triangle, a + moved)
    return result
