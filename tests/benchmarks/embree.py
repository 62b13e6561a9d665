"""Embree: one ray a pixel, on one thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from quiltcli.geometry import Float32Array
from quiltcli.visibility.draw import Sight


def caster(sight: Sight, rays: Sequence[Float32Array]) -> Callable[[], int]:
    """A function that casts rays made beforehand and counts hits; the tree is built before it returns.

    Args:
        sight: the scene from the eye.
        rays: arrays (n, 3) of directions from the eye.
    """
    scene = EmbreeScene()
    TriangleMesh(scene, sight.vertices.astype(np.float32), sight.triangles)
    origin = np.zeros((max(map(len, rays)), 3), dtype=np.float32)
    scene.run(origin[:1], np.ones((1, 3), dtype=np.float32))

    def cast() -> int:
        return sum(int(np.count_nonzero(scene.run(origin[: len(part)], part) >= 0)) for part in rays)

    return cast
