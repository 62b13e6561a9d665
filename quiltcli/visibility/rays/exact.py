"""Rays and triangles in double precision: Embree's rays are single, and near an edge may name the neighbour.

Triangles are tested with Möller & Trumbore's intersection (1997) in float64. Its numerators are linear
in the direction, so each also tells how many pixels the sample lies inside or outside the triangle's
edge. The test shares no formula with the rasterizer, which crosses corners, not edges, and never
leaves its pixel grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray, cross, dot, offsets, segments
from quiltcli.visibility.rays.embree import Target, measure_along, reach_along
from quiltcli.visibility.rays.pixels import Places


@dataclass(frozen=True)
class Neighbours:
    """Which triangles touch which: corners at the same place count as one, whatever their index."""

    vertices: FloatArray
    triangles: Int32Array

    @cached_property
    def _table(self) -> tuple[IntArray, IntArray, IntArray]:
        """Corner numbers (T, 3), offsets (U+1,) and triangles (3T,) of every corner."""
        _, number = np.unique(self.vertices, axis=0, return_inverse=True)
        corner = number.reshape(-1)[self.triangles]
        order = np.argsort(corner.reshape(-1), kind="stable")
        start = np.searchsorted(corner.reshape(-1)[order], np.arange(corner.max(initial=-1) + 2))
        return corner, start, order // 3

    def around(self, row: IntArray, triangle: IntArray) -> tuple[IntArray, IntArray]:
        """Rows and triangles (M,): those given (N,) and all that touch them, each once a row."""
        corner, start, touching = self._table
        at = corner[triangle].reshape(-1)
        counts = start[at + 1] - start[at]
        which, rank = segments(offsets(counts))
        key = row.repeat(3)[which] * len(self.triangles) + touching[start[at][which] + rank]
        key = np.unique(key)
        return key // len(self.triangles), key % len(self.triangles)


@dataclass(frozen=True)
class Tests:
    """Triangles tested against the rays of pixels, by row.

    Attributes:
        row: (M,) which pixel.
        triangle: (M,).
        depth: (M,) depth of the triangle's plane along the ray, metres.
        distance: (M,) how far from the eye that is; what is nearer hides what is farther.
        inside: (M,) pixels the centre lies inside the triangle, negative outside; −inf where the
            triangle is out of range or not drawn.
    """

    row: IntArray
    triangle: IntArray
    depth: FloatArray
    distance: FloatArray
    inside: FloatArray


def intersect(
    target: Target,
    pixels: Places,
    row: IntArray,
    triangle: IntArray,
    beside: tuple[float, float] = (0.0, 0.0),
) -> Tests:
    """Test triangles (M,) against rays of the pixels in `row` (M,), `beside` their centres in pixels."""
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    begin = pixels.from_eye(row)
    if begin is not None:
        a, b, c = a - begin, b - begin, c - begin
    e1, e2 = b - a, c - a
    # Numerators over the determinant give the weights u and v and the distance t.
    across = cross(e2, e1)
    for_u, for_v = cross(e2, -a), cross(-a, e1)
    matrix = pixels.ray[row]
    x, y = (pixels.x[row] + 0.5 + beside[0])[:, None], (pixels.y[row] + 0.5 + beside[1])[:, None]
    du, dv = matrix[:, :, 0], matrix[:, :, 1]
    ray = du * x + dv * y + matrix[:, :, 2]
    det = dot(across, ray)
    inside = np.full(row.size, np.inf)
    for numerator in (for_u, for_v, across - for_u - for_v):
        slope = np.hypot(dot(numerator, du), dot(numerator, dv))
        value = dot(numerator, ray) * np.sign(det)
        inside = np.minimum(
            inside, np.divide(value, slope, out=np.where(value < 0, -np.inf, np.inf), where=slope > 0)
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        t = dot(e2, cross(-a, e1)) / det
        depth = t * measure_along(target.viewer, ray)
        distance = t * np.sqrt(dot(ray, ray))
        reach = t * reach_along(target.viewer, ray)
    viewer = target.viewer
    usable = (t > 0) & (reach >= viewer.near * (1 - 1e-6)) & (reach <= viewer.far * (1 + 1e-6))
    inside[~(usable & target.drawn[triangle])] = -np.inf
    return Tests(row, triangle, depth, distance, inside)
