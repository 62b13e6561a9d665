"""Near and far: which triangles are cut by them, and which of their fragments remain.

A point at t along the ray d reaches t·L, where L is the part of d along the look direction, linear in
the pixel, where near and far are planes, and |d| where they are distances. A fragment is kept where
near ≤ t·L ≤ far, that is near/t ≤ L ≤ far/t: nothing is divided, and triangles wholly inside the range
skip the test. Depth may be measured the other way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot
from quiltcli.viewer.viewer import Viewer


@dataclass(frozen=True)
class DepthRange:
    """The depths that are drawn, with the rays of a batch's blocks.

    Attributes:
        near: metres.
        far: metres.
        by_distance: whether near and far cut by the distance from the eye, not along `look`.
        radial: whether depth is the distance from the eye.
        look: (3,) direction planar depth is measured along.
        rays: (K, 3, 3) block pixels to eye rays.
    """

    near: float
    far: float
    by_distance: bool
    radial: bool
    look: FloatArray
    rays: FloatArray

    @cached_property
    def handed(self) -> FloatArray:
        """Sign (K,) of the determinant of every block's matrix, which tells mirrored blocks from others."""
        u, v, o = self.rays.transpose(2, 0, 1)
        return np.sign(dot(cross(u, v), o))

    def directions(
        self, block: Int32Array, x: FloatArray | IntArray, y: FloatArray | IntArray
    ) -> list[FloatArray]:
        """Eye rays by axis, of pixels given as for `keeps`."""
        m = self.rays[block]
        return [m[..., i, 0] * x + m[..., i, 1] * y + m[..., i, 2] for i in range(3)]

    def keeps(
        self, block: Int32Array, x: FloatArray | IntArray, y: FloatArray | IntArray, inverse: FloatArray
    ) -> BoolArray:
        """Fragments inside the range.

        Args:
            block: (..., N) place of the fragment's block in the batch; the rest broadcast with it.
            x: pixel columns in the block.
            y: pixel rows.
            inverse: 1/t of the fragments, positive.
        """
        ray = self.directions(block, x, y)
        if self.by_distance:
            length = np.sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2])
        else:
            length = self.look[0] * ray[0] + self.look[1] * ray[1] + self.look[2] * ray[2]
        result: BoolArray = (length >= self.near * inverse) & (length <= self.far * inverse)
        return result


def triangles_in_range(
    reach: FloatArray, vertices: FloatArray, triangles: Int32Array, viewer: Viewer
) -> tuple[BoolArray, BoolArray]:
    """Which triangles reach into the depths that are drawn, and which also reach out of them.

    Args:
        reach: (V,) of the vertices, as near and far cut it (`Viewer.reach_of`), metres.
        vertices: (V, 3) world minus eye, metres.
        triangles: (T, 3).
        viewer: near, far, and what they cut.

    Returns:
        inside (T,) and cut (T,); a triangle that is cut needs its fragments tested.
    """
    if viewer.by_distance:
        return _radial_range(reach, vertices, triangles, viewer)
    if reach.size and viewer.near <= reach.min() and reach.max() <= viewer.far:
        return np.ones(len(triangles), dtype=np.bool_), np.zeros(len(triangles), dtype=np.bool_)
    nearest, farthest = _least_and_greatest(reach, triangles)
    inside = (farthest >= viewer.near) & (nearest <= viewer.far)
    return inside, inside & ((nearest < viewer.near) | (farthest > viewer.far))


def _radial_range(
    distance: FloatArray, vertices: FloatArray, triangles: Int32Array, viewer: Viewer
) -> tuple[BoolArray, BoolArray]:
    """`triangles_in_range` for distances: the farthest point is a corner, the nearest need not be."""
    _, farthest = _least_and_greatest(distance, triangles)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = cross(b - a, c - a)
    length = np.maximum(np.sqrt(dot(normal, normal)), np.finfo(np.float64).tiny)
    plane_distance = np.abs(dot(normal, a)) / length
    inside = (farthest >= viewer.near) & (plane_distance <= viewer.far)
    return inside, inside & ((plane_distance < viewer.near) | (farthest > viewer.far))


def _least_and_greatest(values: FloatArray, triangles: Int32Array) -> tuple[FloatArray, FloatArray]:
    """Least and greatest (T,) of the values (V,) at each triangle's corners."""
    a, b, c = (values[triangles[:, k]] for k in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
