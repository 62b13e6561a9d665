"""Normal maps: shading normals that textures bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.geometry import Float32Array
from quiltcli.scene import Scene
from quiltcli.scene.textures.tangents import tangents_of
from quiltcli.shading.textures.lookup import COLOR, texels_at
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import PointVectors, sum_of_products, vector_values

_LEAST_FACING = np.float32(0.1)
"""Least cosine between a bent normal and the direction to the eye, unless the surface itself has less."""
_ONE, _TWO, _TINY = np.float32(1), np.float32(2), np.float32(1e-30)


def bent(scene: Scene, seen: Points) -> Points:
    """The points with their normals as normal maps bend them; the same points where there are none."""
    if scene.textures is None or "normal" not in scene.textures.slots or seen.normal is None:
        return seen
    texels = texels_at(scene, seen, "normal", COLOR, missing=0.5)
    if texels is None:
        return seen
    edges, tangents = seen.edges, tangents_of(scene)
    assert edges is not None
    assert tangents is not None
    slot = scene.textures.slots["normal"]
    material = scene.material.take(edges.triangle)
    strength = edges.each(slot.strength.take(material))
    # The frame: the normal on the side of the eye, the tangent, and where green goes.
    normal = _unit(vector_values(seen.normal))
    rows = edges.each(tangents.table.take(np.maximum(tangents.row.take(edges.triangle), 0), axis=0).T)
    second, third = edges.weights()
    along = rows[0:3] + rows[3:6] * second + rows[6:9] * third
    along = _unit(along - normal * sum_of_products(along, normal))
    up = _cross(normal, along) * rows[9]
    # Seen from behind, a map's hills are hollows.
    own = edges.each(scene.corner_normals.take(edges.triangle, axis=0).T[9:12])
    ray = vector_values(seen.ray)
    side = np.where(sum_of_products(own, ray) > 0, -_ONE, _ONE)
    x, y, z = _TWO * texels - _ONE
    result = _unit(along * (side * strength * x) + up * (strength * y) + normal * z)
    # A slope that is turned away from the eye would be hidden: what is seen there is the rim before it.
    view = _unit(-ray)
    least = np.minimum(sum_of_products(normal, view), _LEAST_FACING)
    result += view * np.maximum(least - sum_of_products(result, view), np.float32(0))
    mapped = edges.each(slot.image.take(material) >= 0)
    return replace(seen, normal=PointVectors(np.where(mapped, result, normal)))


def _unit(vectors: Float32Array) -> Float32Array:
    return np.asarray(vectors / np.sqrt(sum_of_products(vectors, vectors) + _TINY))


def _cross(a: Float32Array, b: Float32Array) -> Float32Array:
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
