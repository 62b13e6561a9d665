"""The arbiter: where rays and render disagree, who is right, in double precision.

Embree's rays are single precision, so near an edge it may name the neighbour. For the few pixels in
question all triangles that were named, and all that share a corner with them, are tested with
Möller & Trumbore's intersection (1997) in float64. Its numerators are linear in the direction, so
each also tells how many pixels the centre lies inside or outside the triangle's edge. The test shares
no formula with the rasterizer, which crosses corners, not edges, and never leaves its pixel grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot, segments
from quiltcli.verify.place import Places
from quiltcli.verify.rays import Target, measure_along
from quiltcli.verify.tolerances import BESIDE, CLOSE, depth_tolerance

FAULT, IMPRECISE, CLOSE_BY = 0, 1, 2


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
        which, rank = segments(np.concatenate(([0], np.cumsum(counts))))
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
        inside: (M,) pixels the centre lies inside the triangle, negative outside; −inf where the
            triangle is out of range or not drawn.
    """

    row: IntArray
    triangle: IntArray
    depth: FloatArray
    inside: FloatArray


def intersect(target: Target, pixels: Places, row: IntArray, triangle: IntArray) -> Tests:
    """Test triangles (M,) against the centre rays of the pixels in `row` (M,)."""
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    e1, e2 = b - a, c - a
    # Numerators over the determinant give the weights u and v and the distance t.
    across = cross(e2, e1)
    for_u, for_v = cross(e2, -a), cross(-a, e1)
    matrix = pixels.ray[row]
    x, y = (pixels.x[row] + 0.5)[:, None], (pixels.y[row] + 0.5)[:, None]
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
    viewer = target.viewer
    usable = (t > 0) & (depth >= viewer.near * (1 - 1e-6)) & (depth <= viewer.far * (1 + 1e-6))
    inside[~(usable & target.drawn[triangle])] = -np.inf
    return Tests(row, triangle, depth, inside)


def judge(
    target: Target,
    neighbours: Neighbours,
    pixels: Places,
    named: IntArray,
    drawn: IntArray,
    z: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Who is right in some pixels.

    Args:
        target: the scene from the eye.
        neighbours: the scene's neighbourhoods.
        pixels: N pixels in question.
        named: (k, N) triangles named by rays, negative for none.
        drawn: (N,) triangle that was drawn, −1 where it is not known or there is none.
        z: (N,) depth that was drawn, infinite where nothing was.

    Returns:
        (N,) FAULT, IMPRECISE where the render is right, or CLOSE_BY where it shows one of two
        surfaces as far away as each other; and (N,) the triangle it shows, −1 for none.
    """
    everything = np.concatenate((named, drawn[None]))
    row, column = np.nonzero(everything.T >= 0)
    tests = intersect(target, pixels, *neighbours.around(row, everything.T[row, column]))
    covered = np.isfinite(z)
    if not tests.row.size:
        return np.where(covered, FAULT, IMPRECISE), np.full(z.size, -1)
    shown = _shown(tests, drawn, z)
    seen = shown >= 0
    depth = np.where(seen, tests.depth[shown], np.inf)
    hidden = _hidden(tests, depth, shown)
    first = _at(tests, np.arange(z.size), named[0])
    close = seen & (first >= 0) & (first != shown)
    close &= np.abs(depth - tests.depth[first]) <= CLOSE * np.where(seen, depth, 1.0)
    right_depth = np.abs(np.where(covered, z, 0) - np.where(seen, depth, 0)) <= depth_tolerance(
        np.where(seen, depth, 0)
    )
    right = np.where(covered, seen & ~hidden & right_depth, ~hidden)
    verdict = np.where(right, np.where(close & covered, CLOSE_BY, IMPRECISE), FAULT)
    return verdict, np.where(seen, tests.triangle[shown], -1)


def _shown(tests: Tests, drawn: IntArray, z: FloatArray) -> IntArray:
    """Index (N,) into the tests of the triangle each pixel shows, −1 for none.

    The one that was drawn; where that is not known, the nearest that meets the ray at the depth drawn.
    """
    there = tests.inside >= -BESIDE
    known = drawn[tests.row] == tests.triangle
    fits = np.abs(tests.depth - np.where(np.isfinite(z), z, -1e30)[tests.row])
    guess = (drawn[tests.row] < 0) & (fits <= depth_tolerance(np.abs(tests.depth)))
    candidate = np.flatnonzero(there & (known | guess))
    result = np.full(z.size, -1)
    order = candidate[np.lexsort((fits[candidate], tests.row[candidate]))][::-1]
    result[tests.row[order]] = order  # the last write of a row is its best fit
    return result


def _hidden(tests: Tests, depth: FloatArray, shown: IntArray) -> BoolArray:
    """Pixels (N,) whose ray meets a surface nearer than `depth` (N,).

    A centre inside one triangle meets it; so does one on the edges of two, where they join.
    """
    nearer = tests.depth < depth[tests.row] * (1 - CLOSE)
    nearer &= shown[tests.row] != np.arange(tests.row.size)
    surely = np.bincount(tests.row, weights=nearer & (tests.inside > BESIDE), minlength=depth.size)
    on_edge = np.bincount(tests.row, weights=nearer & (np.abs(tests.inside) <= BESIDE), minlength=depth.size)
    result: BoolArray = (surely >= 1) | (on_edge >= 2)
    return result


def _at(tests: Tests, row: IntArray, triangle: IntArray) -> IntArray:
    """Index (N,) of the test of these rows and triangles where they meet, −1 where they do not."""
    key = tests.row * (tests.triangle.max(initial=0) + 1) + tests.triangle
    wanted = row * (tests.triangle.max(initial=0) + 1) + triangle
    place = np.minimum(np.searchsorted(key, wanted), key.size - 1)
    good = (triangle >= 0) & (key[place] == wanted)
    good &= tests.inside[place] >= -BESIDE
    return np.where(good, place, -1)
