"""Triangle setup: every test and every value as a plane over the pixels of a block.

In the homogeneous pixels (X, Y, W) of a block, a triangle's three edge functions and its inverse
depth 1/t are linear in the pixel (x, y, 1); no clipping and no division comes before them
(Olano & Greer 1997). Their coefficients are put on grids of powers of two so that
`a·x + b·y + c` is exact in float64 whatever the order of the sums: two triangles that share an edge
then decide every pixel alike, and every machine computes the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray

LATTICE = (7.1e-7, 3.3e-7)
"""Shift of the sample lattice in pixels: no vertex of a tidy model sits on a sample."""

_EXPONENT = np.int64(0x7FF0000000000000)
_TINY = 1e-300


@dataclass(frozen=True)
class Planes:
    """N block pairs ready to be drawn; plane coefficients (a, b, c) come first.

    Attributes:
        triangle: (N,) triangle index.
        block: (N,) place of the block in the batch.
        serial: (N,) rank of the pair by (block, triangle); the lower wins equal depths.
        edge: (3, 3, N) edge functions [edge, coefficient], positive inside, never 0 at a pixel.
        inverse: (3, N) plane of 1/t.
        low: (N,) least 1/t of the triangle's corners; a bound that slivers are held to.
        high: (N,) greatest 1/t of the corners.
        box: (4, N) first and last pixel column, first and last row of the bounding box.
        cut: (N,) triangles that reach beyond the near or far depth.
    """

    triangle: Int32Array
    block: Int32Array
    serial: Int32Array
    edge: FloatArray
    inverse: FloatArray
    low: FloatArray
    high: FloatArray
    box: Int32Array
    cut: BoolArray

    def take(self, rows: IntArray) -> Planes:
        """The block pairs with these indices, in their order."""
        return Planes(
            triangle=self.triangle[rows],
            block=self.block[rows],
            serial=self.serial[rows],
            edge=np.take(self.edge, rows, axis=2),
            inverse=np.take(self.inverse, rows, axis=1),
            low=self.low[rows],
            high=self.high[rows],
            box=np.take(self.box, rows, axis=1),
            cut=self.cut[rows],
        )


def joined(parts: Sequence[Planes]) -> Planes:
    """Several lists of pairs as one, in their order."""
    columns = {field.name: [getattr(part, field.name) for part in parts] for field in fields(Planes)}
    return Planes(**{name: np.concatenate(arrays, axis=-1) for name, arrays in columns.items()})


def project(corners: FloatArray, matrix: FloatArray) -> FloatArray:
    """Homogeneous pixels of triangle corners, each sum in the same order for every triangle.

    Args:
        corners: (3, 3, N) [corner, axis] minus the eye, metres.
        matrix: (3, 3, N) rows give X, Y, W.

    Returns:
        (3, 3, N) [corner, X/Y/W].
    """
    result = np.empty_like(corners)
    for corner in range(3):
        x, y, z = corners[corner]
        for row in range(3):
            m = matrix[row]
            result[corner, row] = m[0] * x + m[1] * y + m[2] * z
    return result


def gather_corners(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """Corners (3, 3, N) [corner, axis] of `triangles` (N, 3), contiguous along N."""
    return np.ascontiguousarray(vertices[triangles].transpose(1, 2, 0))


def pixel_boxes(homogeneous: FloatArray, width: IntArray, height: IntArray) -> Int32Array:
    """Bounding boxes (4, N) first/last column, first/last row of the pixels a triangle may cover.

    A triangle that reaches behind the eye may cover all of the block; one wholly behind it, or
    beside the block, has an empty box (last < first).
    """
    w = homogeneous[:, 2]
    front = w.min(axis=0) > _TINY
    behind = w.max(axis=0) <= 0
    safe = np.where(w > _TINY, w, 1.0)
    box = np.empty((4, w.shape[1]), dtype=np.int32)
    for axis, extent in ((0, width), (1, height)):
        at = homogeneous[:, axis] / safe
        first = np.where(front, np.ceil(at.min(axis=0) - 1e-6), 0.0)
        last = np.where(front, np.floor(at.max(axis=0) + 1e-6), extent - 1.0)
        last[behind] = -1.0
        box[2 * axis] = np.clip(first, 0, extent)
        box[2 * axis + 1] = np.clip(last, -1, extent - 1)
    return box


def edge_planes(homogeneous: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edge functions and inverse depth of triangles in homogeneous pixels.

    Args:
        homogeneous: (3, 3, N) [corner, X/Y/W].

    Returns:
        edge (3, 3, N) [edge, coefficient], edge k opposite to corner k, positive inside;
        inverse (3, N) plane of 1/t; determinant (N,), 0 for a triangle seen edge-on.
    """
    p, q, r = homogeneous
    normal = _cross(q - p, r - p)
    determinant = p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2]
    sign = np.sign(determinant)
    edge = np.stack((_cross(q, r), _cross(r, p), _cross(p, q))) * sign
    for k in range(3):
        _snap_edge(edge[k])
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = normal / determinant
    inverse[:, determinant == 0] = 0
    # Depth is measured at the place itself; only what covers it is decided on the shifted lattice.
    inverse[2] -= LATTICE[0] * inverse[0] + LATTICE[1] * inverse[1]
    _snap_inverse(inverse)
    return edge, inverse, determinant


def depth_bounds(w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest 1/t (N,) of triangles whose corners have these W (3, N)."""
    front = w.min(axis=0) > _TINY
    safe = np.maximum(w, _TINY)
    low = np.where(front, 1.0 / safe.max(axis=0), _TINY)
    high = np.where(front, 1.0 / safe.min(axis=0), 1.0 / _TINY)
    return low, high


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the first axis; trading `a` and `b` negates it exactly."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def _power_of_two(x: FloatArray) -> FloatArray:
    """The largest power of two not above `x` > 0; 0 for 0."""
    return (x.view(np.int64) & _EXPONENT).view(np.float64)


def _snap_edge(plane: FloatArray) -> None:
    """Put an edge plane (3, N) on its dyadic grid and fold the tie rule into c, in place.

    The grid's step is 2⁻³⁴ of the larger slope, so sums over pixels below 2¹³ are exact. The half
    step added to c settles pixels exactly on the edge by the signs of a and b (a top-left rule);
    the neighbour's negated plane gets the negated half step.
    """
    a, b, c = plane
    scale = _power_of_two(np.maximum(np.abs(a), np.abs(b)))
    round_to = scale * (1.5 * 2.0**18)
    for coefficient in (a, b, c):
        coefficient += round_to
        coefficient -= round_to
    c += np.copysign(scale * 2.0**-35, a + b * 2.0**-44)


def _snap_inverse(plane: FloatArray) -> None:
    """Put a plane of 1/t (3, N) on a grid on which sums over a block are exact, in place."""
    a, b, c = plane
    scale = _power_of_two(np.maximum(np.maximum(np.abs(a), np.abs(b)) * 512.0, np.abs(c)))
    round_to = scale * (1.5 * 2.0**3)
    for coefficient in (a, b, c):
        coefficient += round_to
        coefficient -= round_to
