"""The share of light that points hold up: alpha of materials, vertices and pictures, by what it means."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import Float32Array, Int32Array
from quiltcli.scene import Scene
from quiltcli.scene.scene import ALPHAS
from quiltcli.shading.materials import albedo_wants, alpha_at, at_materials
from quiltcli.visibility.draw import Wanted
from quiltcli.visibility.resolve.hits import Points

_ONE = np.float32(1)
OPAQUE, MASK = ALPHAS.index("opaque"), ALPHAS.index("mask")


def opacity_at(scene: Scene, seen: Points) -> Float32Array:
    """The share of light (n, k) that points hold up."""
    alpha, means, cutoff = alpha_of(scene, seen)
    alpha = np.where(means == MASK, (alpha >= cutoff).astype(np.float32), alpha)
    alpha = np.where(means == OPAQUE, _ONE, alpha)
    return np.asarray(np.minimum(np.maximum(alpha, np.float32(0)), _ONE), dtype=np.float32)


def alpha_of(scene: Scene, seen: Points) -> tuple[Float32Array, Int32Array, Float32Array]:
    """Alpha (n, k) of points, what it means (n, k), an index into `ALPHAS`, and the least a mask shows."""
    table = scene.materials
    assert table.opacity is not None
    assert table.alpha is not None
    assert table.cutoff is not None
    (alpha,) = at_materials(scene, table.opacity[:, None], seen.triangle)
    alpha = alpha * alpha_at(scene, seen)
    if scene.corner_opacities is not None:
        assert seen.weights is not None
        first, second, third = scene.corner_opacities.take(seen.triangle, axis=0).transpose(2, 0, 1)
        alpha = alpha * (first + seen.weights[0] * second + seen.weights[1] * third)
    means = table.alpha.take(scene.material.take(seen.triangle))
    cutoff = table.cutoff.take(scene.material.take(seen.triangle))
    return np.asarray(np.broadcast_to(alpha, means.shape)), means, cutoff


def opacity_wants(scene: Scene) -> Wanted:
    """What `opacity_at` asks of hits."""
    wanted = Wanted.NOTHING if scene.corner_opacities is None else Wanted.WEIGHTS
    return wanted | albedo_wants(scene)
