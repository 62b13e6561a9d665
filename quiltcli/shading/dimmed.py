"""Light on its way to a point, dimmed by what it passes.

A surface that blends lets through the share 1 − α of the light that meets it, a mask all or nothing. Their
pictures are looked up at full size, between texels but not averaged: a ray is thin. The shares of all
surfaces are multiplied in the order in which the ray meets them, from the point to the lamp.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, IntArray, cross, dot, slices
from quiltcli.scene import Scene
from quiltcli.shading.opacity import opacity_at
from quiltcli.visibility.rays.blockers import Blockers
from quiltcli.visibility.resolve.footprints import PointEdges
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import PointVectors

_MOST_STEPS = 1000
_AT_ONCE = 1 << 16


def let_through(
    scene: Scene, blockers: Blockers, origin: FloatArray, direction: Float32Array, far: float
) -> Float32Array:
    """The share (N,) of light that reaches points along rays, 0 where something opaque stands in the way.

    Args:
        scene: the scene.
        blockers: what may be in the way.
        origin: (3, N) the points, minus the blockers' middle, metres.
        direction: (3, N) towards the light, of any length; (3, 1) one for all.
        far: multiple of it at which the light is.
    """
    share = (~blockers.hide(origin, direction, far)).astype(np.float32)
    if blockers.soft is None:
        return share
    some = np.flatnonzero(share)
    for part in slices(0, some.size, _AT_ONCE):
        rows = some[part]
        way = direction if direction.shape[1] == 1 else direction.take(rows, axis=1)
        share[rows] = _passed(scene, blockers, origin.take(rows, axis=1).T, way.T.astype(np.float64), far)
    return share


def _passed(
    scene: Scene, blockers: Blockers, origin: FloatArray, direction: FloatArray, far: float
) -> Float32Array:
    """What surfaces that light may pass leave of it (N,), along rays (N, 3)."""
    share = np.ones(len(origin), dtype=np.float32)
    direction = np.broadcast_to(direction, origin.shape)
    length = np.sqrt(dot(direction, direction))
    live, gone, last = np.arange(len(origin)), np.zeros(len(origin)), np.full(len(origin), -1)
    for _ in range(_MOST_STEPS):
        if not live.size:
            break
        way = direction[live]
        start = origin[live] + gone[live, None] * way
        met = blockers.meet_soft(start, way, far - gone[live])
        hit = met >= 0
        live, met, way = live[hit], met[hit], way[hit]
        corners = [scene.vertices[scene.triangles[met, k]] - blockers.middle for k in range(3)]
        normal = cross(corners[1] - corners[0], corners[2] - corners[0])
        slope = dot(normal, way)
        distance = np.divide(
            dot(normal, corners[0] - origin[live]), slope, out=np.zeros(live.size), where=slope != 0
        )
        # In single precision a ray may meet again what it has just passed.
        fresh = np.flatnonzero(met != last[live])
        if fresh.size:
            place = origin[live[fresh]] + distance[fresh, None] * way[fresh]
            few = [corner[fresh] for corner in corners]
            share[live[fresh]] *= np.float32(1) - _opacity(scene, met[fresh], place, few, normal[fresh])
        last[live] = met
        gone[live] = np.maximum(distance, gone[live]) + 2 * blockers.above[met] / length[live]
        live = live[(share[live] > 0) & (gone[live] < far)]
    return share


def _opacity(
    scene: Scene, triangle: IntArray, place: FloatArray, corners: list[FloatArray], normal: FloatArray
) -> Float32Array:
    """The share of light (P,) that triangles (P,) hold up at places (P, 3) on them."""
    a, b, c = corners
    area = np.maximum(dot(normal, normal), 1e-300)
    weights = np.stack(
        (dot(normal, cross(place - a, c - a)) / area, dot(normal, cross(b - a, place - a)) / area)
    )
    number = triangle.astype(np.int32)
    seen = Points(
        triangle=number[:, None],
        ray=PointVectors(np.zeros((3, triangle.size, 1), dtype=np.float32)),
        normal=None,
        weights=weights.astype(np.float32)[:, :, None],
        position=None,
        edges=PointEdges(number, weights, np.zeros((2, 2, triangle.size))),
    )
    return opacity_at(scene, seen).reshape(-1)
