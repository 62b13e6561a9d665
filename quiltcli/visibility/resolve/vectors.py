"""Vectors at the pixels of hits, and their products.

Where a triangle fills a microtile, or a square of `side` by `side` of them, rays and normals are linear
over its pixels. Products of them are planes or quadratics then: a few numbers a square say it all, and no
vector is ever written down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray, IntArray
from quiltcli.visibility.setup.grids import single_values
from quiltcli.visibility.setup.planes import moved


@dataclass(frozen=True)
class PointVectors:
    """Vectors that are known one by one: values (3, G, k) float32, (3, G, 1) one a group, or (3, 1, 1)."""

    values: Float32Array

    def __getitem__(self, part: slice | IntArray) -> PointVectors:
        """Those of some groups."""
        return self if self.values.shape[1] == 1 else PointVectors(self.values[:, part])


@dataclass(frozen=True)
class TileVectors:
    """Vectors that are linear over squares: planes (3, 3, G) [axis, coefficient] from the first pixel."""

    planes: FloatArray
    side: int = 1

    def __getitem__(self, part: slice | IntArray) -> TileVectors:
        """Those of some squares."""
        return TileVectors(self.planes[:, :, part], self.side)


@dataclass(frozen=True)
class BlockVectors:
    """Vectors that are linear over blocks, as rays are, at the pixels of G squares.

    Attributes:
        matrix: (3, 3, K) planes over blocks [axis, coefficient], from their first pixels.
        block: (G,) the block of each square.
        x: (G,) first columns of the squares in their blocks.
        y: (G,) first rows.
        side: how many microtiles are their side.
    """

    matrix: FloatArray
    block: IntArray
    x: IntArray
    y: IntArray
    side: int = 1

    def __getitem__(self, part: slice | IntArray) -> BlockVectors:
        """Those of some squares."""
        return BlockVectors(self.matrix, self.block[part], self.x[part], self.y[part], self.side)

    @cached_property
    def planes(self) -> FloatArray:
        """Planes (3, 3, G) from the squares' first pixels."""
        return moved(self.x, self.y, out=np.take(self.matrix, self.block, axis=2))

    def along(self, direction: Float32Array | FloatArray) -> FloatArray:
        """Planes (3, G) of the products with one direction (3,)."""
        return moved(self.x, self.y, out=sum_of_products(self.matrix, direction).take(self.block, axis=1))

    def onto(self, vectors: Float32Array) -> FloatArray:
        """Planes (3, G) of the products with vectors, (3, G, 1) one a square or (3, 1, 1) one for all."""
        if vectors.shape[1] == 1:
            return self.along(vectors[:, 0, 0])
        part = np.take(self.matrix, self.block, axis=2)
        return moved(self.x, self.y, out=sum_of_products(part, vectors[:, None, :, 0]))

    @cached_property
    def lengths2(self) -> FloatArray:
        """Quadratics (6, G) of the vectors' squared lengths."""
        xx, xy, yy, x, y, one = _quadratic(self.matrix, self.matrix).take(self.block, axis=1)
        one += self.x * (xx * self.x + xy * self.y + x) + self.y * (yy * self.y + y)
        x += 2 * xx * self.x + xy * self.y
        y += 2 * yy * self.y + xy * self.x
        return np.stack((xx, xy, yy, x, y, one))


Vectors: TypeAlias = PointVectors | TileVectors | BlockVectors


def vector_values(vectors: Vectors) -> Float32Array:
    """The vectors (3, G, k), or (3, G, 1) where each group has one."""
    if isinstance(vectors, PointVectors):
        return vectors.values
    form = vectors.planes.transpose(1, 0, 2)  # all axes at once, as so many more squares
    return single_values(form.reshape(3, -1), vectors.side).reshape(3, form.shape[2], -1)


def along(vectors: Vectors, direction: Float32Array) -> Float32Array:
    """Products (G, k) or (G, 1) with one direction (3,)."""
    if isinstance(vectors, PointVectors):
        return sum_of_products(vectors.values, direction)
    if isinstance(vectors, BlockVectors):
        return single_values(vectors.along(direction), vectors.side)
    return single_values(sum_of_products(vectors.planes, direction), vectors.side)


def products(a: Vectors, b: Vectors) -> Float32Array:
    """Products (G, k) or (G, 1) of vectors, pixel by pixel."""
    if isinstance(a, BlockVectors) and a is b:
        return single_values(a.lengths2, a.side)
    if isinstance(a, PointVectors) and isinstance(b, BlockVectors) and a.values.shape[2] == 1:
        return single_values(b.onto(a.values), b.side)
    if not isinstance(a, PointVectors) and not isinstance(b, PointVectors):
        return single_values(_quadratic(a.planes, b.planes), a.side)
    return sum_of_products(vector_values(a), vector_values(b))


def _quadratic(a: FloatArray, b: FloatArray) -> FloatArray:
    """Coefficients (6, G) of x², xy, y², x, y and 1 in the product of two linear vectors (3, 3, G)."""
    p, q, r = (a[:, k] for k in range(3))
    s, t, u = (b[:, k] for k in range(3))
    parts = (p * s, p * t + q * s, q * t, p * u + r * s, q * u + r * t, r * u)
    return np.stack([part[0] + part[1] + part[2] for part in parts])


def sum_of_products(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Products summed along the first axis, in the order x, y, z."""
    result: NDArray[Any] = a[0] * b[0]
    part = a[1] * b[1]
    result += part
    result += np.multiply(a[2], b[2], out=part)
    return result
