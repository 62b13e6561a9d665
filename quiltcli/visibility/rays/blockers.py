"""What stands in the way of light: a scene's triangles as shadow rays meet them.

Embree is single precision: the triangles are moved to the middle of most of them, and rays start a little
above their own surface. They may differ at grazing rays between families of processors, for which
Embree has code of its own; between threads, processes and divisions of the work they do not.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, slices
from quiltcli.scene import Scene
from quiltcli.visibility.rays.embree import demand_embree, embree_scene, is_hidden

ABOVE = 2.0**-18
"""How far above its surface a ray starts, over how far its triangle reaches from the middle of the scene."""

_SAMPLED = 1 << 16
_AT_ONCE = 1 << 17
_NEED = "lights cast shadows, which are rays cast with Embree (render.shadows: false draws none)"


@dataclass(frozen=True, eq=False)
class Blockers:
    """The triangles of a scene that cast shadows.

    Attributes:
        middle: (3,) where they are moved from, world metres.
        embree: Embree's scene of them.
        above: (T,) how far above each triangle of the scene rays start, metres.
        bent: (T,) triangles whose corners have normals of their own.
        soft: Embree's scene of those that light may pass; None where there are none.
        soft_triangles: (K,) the triangle each of these is.
    """

    middle: FloatArray
    embree: Any
    above: FloatArray
    bent: BoolArray
    soft: Any = None
    soft_triangles: IntArray | None = None

    def hide(self, origin: FloatArray, direction: Float32Array, far: float) -> BoolArray:
        """Whether something lies on the way of rays.

        Args:
            origin: (3, N) where they start, minus `middle`, metres.
            direction: (3, N) where they go, of any length; (3, 1) one for all.
            far: multiple of it at which they end.
        """
        count = origin.shape[1]
        found = np.empty(count, dtype=np.bool_)
        for part in slices(0, count, _AT_ONCE):
            start = np.ascontiguousarray(origin[:, part].T, dtype=np.float32)
            way = direction if direction.shape[1] == 1 else direction[:, part]
            way = np.ascontiguousarray(np.broadcast_to(way.T, start.shape), dtype=np.float32)
            found[part] = is_hidden(self.embree, start, way, np.full(len(start), far, dtype=np.float32))
        return found

    def meet_soft(self, origin: FloatArray, direction: FloatArray, far: FloatArray) -> IntArray:
        """The first triangles (N,) that light may pass on the way of rays, −1 for none.

        Args:
            origin: (N, 3) where they start, minus `middle`, metres.
            direction: (N, 3) where they go, of any length.
            far: (N,) multiples of it at which they end.
        """
        assert self.soft_triangles is not None
        rays = origin.astype(np.float32), direction.astype(np.float32)
        met = self.soft.run(*rays, dists=far.astype(np.float32)).astype(np.int64)
        return np.where(met >= 0, self.soft_triangles.take(np.maximum(met, 0)), -1)


_making = threading.Lock()


def blockers_of(scene: Scene) -> Blockers:
    """The blockers of a scene, worked out once, and kept for the last scenes that were asked about.

    Raises:
        MissingExtraError: there is no Embree on this machine.
    """
    with _making:  # by one thread, whatever others ask meanwhile
        return _made(scene)


def demand_blockers() -> None:
    """Raise where there is nothing that could cast shadows (MissingExtraError)."""
    demand_embree(_NEED)


@lru_cache(maxsize=1)
def _made(scene: Scene) -> Blockers:
    demand_blockers()
    vertices, triangles = scene.vertices, scene.triangles
    some = vertices[:: max(len(vertices) // _SAMPLED, 1)]
    middle: FloatArray = np.median(some, axis=0)
    corners = vertices - middle
    reach = np.abs(corners).max(axis=1)
    far = reach.take(triangles[:, 0])
    for k in (1, 2):
        np.maximum(far, reach.take(triangles[:, k]), out=far)
    cast = np.ones(len(scene.objects), dtype=np.bool_)
    cast[list(scene.lets_light_by)] = False
    blocks = cast.take(scene.object)
    if scene.invisible is not None:
        blocks &= ~scene.invisible
    soft, named = None, None
    if scene.soft is not None and (blocks & scene.soft).any():
        named = np.flatnonzero(blocks & scene.soft)
        soft = embree_scene(corners, triangles.take(named, axis=0))
        blocks &= ~scene.soft
    chosen: IntArray = np.flatnonzero(blocks)
    shown = triangles if chosen.size == len(triangles) else triangles.take(chosen, axis=0)
    bent = np.asarray(scene.corner_normals[:, 3:9].any(axis=1))
    return Blockers(middle, embree_scene(corners, shown), far * ABOVE, bent, soft, named)
