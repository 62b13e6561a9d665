"""The surfaces that are seen: what is linear over the pixels of each visible triangle.

An attribute a of a triangle is Σ aₖEₖ / ΣEₖ, so its numerator is a plane like the edge functions
are. A normal needs no more: its length does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.visibility.resolve.hits import Wanted
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.vectors import PointVectors
from quiltcli.visibility.setup.planes import facing, moved, power_of_two

_NEAR = 8.0  # pixels, about as far as a surface's pixels are from where its planes begin


@dataclass(frozen=True)
class Surfaces:
    """Planes (a, b, c) over the pixels about a place of their own, of n visible pairs.

    Attributes:
        triangle: (n,) triangle index.
        normal: (3, 3, n) planes of the normal [axis, coefficient] on the side of the eye, of any length;
            none unless wanted, (0, 3, n).
        weights: (3, 3, n) planes of the second and third edge function and of the sum of all; none
            unless wanted, (0, 3, n).
    """

    triangle: Int32Array
    normal: Float32Array
    weights: FloatArray


def surfaces(reader: Reader, rows: IntArray, wanted: Wanted, x: NDArray[Any], y: NDArray[Any]) -> Surfaces:
    """The surfaces of some pairs.

    Args:
        reader: the canvas they are seen in.
        rows: (n,) the pairs, rows of its planes.
        wanted: what is asked for.
        x: (n,) columns in the blocks at which the planes begin.
        y: (n,) rows.
    """
    planes = reader.table.planes
    triangle = planes.triangle.take(rows)
    normal = np.zeros((0, 3, rows.size), dtype=np.float32)
    weights = np.zeros((0, 3, rows.size))
    if wanted & (Wanted.NORMAL | Wanted.WEIGHTS):
        # The sum of the edge functions in the first's place, then the second and the third.
        edge = moved(x, y, out=np.take(planes.edge, rows, axis=2))
        edge[0] += edge[1]
        edge[0] += edge[2]
        edge *= facing(planes, rows, reader.limits.handed)
        if Wanted.NORMAL in wanted:
            normal = _normals(reader.corner_normals.take(triangle, axis=0), edge)
        if Wanted.WEIGHTS in wanted:
            weights = edge[[1, 2, 0]]
    return Surfaces(triangle, normal, weights)


def has_one_normal(reader: Reader, rows: IntArray) -> BoolArray:
    """Which pairs' triangles (n,) have the same normal at all corners."""
    triangle = reader.table.planes.triangle.take(rows)
    return np.asarray(~reader.corner_normals.take(triangle, axis=0)[:, 3:9].any(axis=1))


def one_normal(reader: Reader, rows: IntArray) -> PointVectors:
    """The normals, on the side of the eye, of pairs (n,) whose triangles have one each.

    Returns:
        (3, n, 1), or (3, 1, 1) where all are the same.
    """
    planes = reader.table.planes
    triangle, side = planes.triangle.take(rows), facing(planes, rows, reader.limits.handed)
    if bool((triangle == triangle[0]).all() and (side == side[0]).all()):
        triangle, side = triangle[:1], side[:1]
    normal = reader.corner_normals.take(triangle, axis=0).T[0:3] * side
    return PointVectors(normal.astype(np.float32)[:, :, None])


def _normals(corners: Float32Array, edge: FloatArray) -> Float32Array:
    """Planes (3, 3, n) of normals.

    Args:
        corners: (n, 12) rows of the scene's `corner_normals`.
        edge: (3, 3, n) planes of the sum of the edge functions, of the second and of the third.
    """
    reach = np.abs(edge[0])
    reach[:2] *= _NEAR
    edge = edge / power_of_two(np.maximum(reach.max(axis=0), 1e-300))
    total, second, third = edge.astype(np.float32)
    corner = np.ascontiguousarray(corners.T[:9]).reshape(3, 3, 1, -1)
    normal: Float32Array = corner[0] * total
    part = corner[1] * second
    normal += part
    normal += np.multiply(corner[2], third, out=part)
    return normal
