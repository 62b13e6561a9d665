"""The surfaces that are seen: what is linear over the pixels of each visible triangle.

An attribute a of a triangle is Σ aₖEₖ / ΣEₖ, so its numerator is a plane like the edge functions
are. A normal needs no more: its length does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.raster.blocks import SIDE
from quiltcli.raster.hits import Wanted
from quiltcli.raster.planes import Planes, power_of_two


@dataclass(frozen=True)
class Surfaces:
    """Planes (a, b, c) over the pixels of their blocks, of n visible pairs.

    Attributes:
        triangle: (n,) triangle index.
        bounds: (2, n) least and greatest 1/t.
        inverse: (3, n) plane of 1/t.
        normal: (3, 3, n) planes of the normal [axis, coefficient] on the side of the eye, scaled so that
            their values are at most about 1; none unless wanted, (0, 3, n).
        weights: (3, 3, n) planes of the second and third edge function and of the sum of all; none
            unless wanted, (0, 3, n).
    """

    triangle: Int32Array
    bounds: FloatArray
    inverse: FloatArray
    normal: FloatArray
    weights: FloatArray

    @property
    def numbers(self) -> FloatArray:
        """All of it in rows (n, 5 + …), one look-up each, in the order of the attributes."""
        return np.concatenate((self.bounds, self.inverse, *self.normal, *self.weights)).T.copy()


def surfaces(planes: Planes, rows: IntArray, wanted: Wanted, handed: FloatArray) -> Surfaces:
    """The surfaces of some pairs.

    Args:
        planes: the planes of a batch.
        rows: (n,) the pairs.
        wanted: what is asked for.
        handed: (K,) sign of the determinant of every block's matrix.
    """
    edge = np.take(planes.edge, rows, axis=2)
    triangle = planes.triangle.take(rows)
    total = edge[0] + edge[1]
    total += edge[2]
    normal = weights = np.zeros((0, 3, rows.size))
    if wanted.normals is not None:
        facing = _facing(planes, rows, handed)
        total *= facing
        edge *= facing
        normal = _normals(wanted.normals, triangle, total, edge)
    if wanted.weights:
        weights = np.stack((edge[1], edge[2], total))
    return Surfaces(
        triangle=triangle,
        bounds=np.stack((planes.low.take(rows), planes.high.take(rows))),
        inverse=np.take(planes.inverse, rows, axis=1),
        normal=normal,
        weights=weights,
    )


def _facing(planes: Planes, rows: IntArray, handed: FloatArray) -> FloatArray:
    """1 for pairs (n,) whose triangle's front the eye sees, −1 for those it sees from behind."""
    result: FloatArray = planes.turn.take(rows) * -handed.take(planes.block.take(rows))
    return result


def has_one_normal(table: Float32Array, triangle: Int32Array) -> BoolArray:
    """Which triangles (n,) have the same normal at all corners, by the scene's `corner_normals`."""
    return np.asarray(~table.take(triangle, axis=0)[:, 3:9].any(axis=1))


def one_normal(table: Float32Array, planes: Planes, rows: IntArray, handed: FloatArray) -> Float32Array:
    """The normals (3, n, 1), on the side of the eye, of pairs whose triangles have one each."""
    normal = table.take(planes.triangle.take(rows), axis=0).T[0:3] * _facing(planes, rows, handed)
    return normal.astype(np.float32)[:, :, None]


def _normals(table: Float32Array, triangle: Int32Array, total: FloatArray, edge: FloatArray) -> FloatArray:
    """Planes (3, 3, n) of normals, from `total` (3, n) and the edge planes (3, 3, n)."""
    corner = np.ascontiguousarray(table.take(triangle, axis=0).T[:9], dtype=np.float64).reshape(3, 3, 1, -1)
    normal = corner[0] * total
    normal += corner[1] * edge[1]
    normal += corner[2] * edge[2]
    reach = np.abs(normal).max(axis=0)
    reach[:2] *= SIDE
    return np.asarray(normal / power_of_two(np.maximum(reach.max(axis=0), 1e-300)))
