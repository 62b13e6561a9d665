"""Nine places of a microtile, the nodes, that tell all 64 pixels of what is smooth in it.

Between the nodes lies a polynomial of second degree in x and in y.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.raster.planes import power_of_two
from quiltcli.raster.vectors import BlockVectors, PointVectors, Vectors

_AT = np.array([0.5, 3.5, 6.5])
_X, _Y = np.tile(_AT, 3)[:, None], np.repeat(_AT, 3)[:, None]
_HALF_TILE = 3.5


def at_nodes(planes: NDArray[Any]) -> FloatArray:
    """Values (..., 9, G) of planes (..., 3, G) at the nodes of microtiles."""
    a, b, c = (planes[..., k, None, :] for k in range(3))
    result: FloatArray = a * _X
    result += b * _Y
    result += c
    return result


def vectors_at_nodes(vectors: Vectors) -> PointVectors:
    """Vectors (3, 9, G) at the nodes; (3, 1, G) where each microtile has one, (3, 1, 1) where all have."""
    if isinstance(vectors, PointVectors):
        return PointVectors(vectors.values.transpose(0, 2, 1))
    return PointVectors(at_nodes(vectors.planes).astype(np.float32))


def centre(vectors: Vectors) -> FloatArray:
    """Vectors (3, G) in the middle of microtiles, or (3, 1) where all have one."""
    if isinstance(vectors, PointVectors):
        return vectors.values[:, :, 0].astype(np.float64)
    return centre_of(vectors.planes)


def centre_of(planes: FloatArray) -> FloatArray:
    """Values (..., G) of planes (..., 3, G) in the middle of microtiles."""
    return np.asarray(planes[..., 2, :] + _HALF_TILE * (planes[..., 0, :] + planes[..., 1, :]))


def reach(vectors: Vectors) -> FloatArray:
    """How far vectors in the middle of microtiles (G,), or (1,) of all, are from others there at most."""
    if isinstance(vectors, PointVectors):
        return np.zeros(1)
    if isinstance(vectors, BlockVectors):
        return _slopes(vectors.matrix).take(vectors.block)
    return _slopes(vectors.planes)


def _slopes(planes: FloatArray) -> FloatArray:
    a, b = np.sqrt((planes[:, :2] ** 2).sum(axis=0))
    return np.asarray(_HALF_TILE * (a + b))


def reach_of(plane: FloatArray) -> FloatArray:
    """How far values of planes (3, G) in the middle of microtiles are from others there (G,) at most."""
    return np.asarray(_HALF_TILE * (np.abs(plane[0]) + np.abs(plane[1])))


def _weights() -> FloatArray:
    """What the value at each node counts at each pixel (9, 64), in whole numbers: times 72²."""
    x = 2 * np.arange(8.0)
    line = np.stack(((x - 7) * (x - 13), -2 * (x - 1) * (x - 13), (x - 1) * (x - 7)))  # Lagrange's, times 72
    return np.asarray((line[:, None, :, None] * line[None, :, None, :]).reshape(9, 64))


_WEIGHTS, _WHOLE = _weights(), 72.0**2
MOST_BETWEEN = float(np.abs(_WEIGHTS).sum(axis=0).max())
"""How many times as great as the greatest of `on_grids` a pixel may be."""


def on_grids(nodes: FloatArray) -> FloatArray:
    """Values (..., 9, G) at the nodes made ready, in place, for `between_nodes`: sums there are exact then.

    The grid's step is 2⁻³⁸ of the greatest value of a microtile; weights and sums have less than 15 bits.
    Values (..., 1, G) that all nodes share stay as they are.
    """
    if nodes.shape[-2] == 1:
        return nodes
    nodes *= 1 / _WHOLE
    greatest = nodes.max(axis=-2, keepdims=True)
    np.maximum(greatest, -nodes.min(axis=-2, keepdims=True), out=greatest)
    rounding = power_of_two(np.maximum(greatest, 1e-300, out=greatest))
    rounding *= 1.5 * 2.0**14
    nodes += rounding
    nodes -= rounding
    return nodes


def between_nodes(values: FloatArray) -> Float32Array:
    """Values (G, 64) at the pixels of microtiles from `on_grids` (9, G); (G, 1) from (1, G)."""
    pixels = values.T if len(values) == 1 else values.T @ _WEIGHTS
    return np.asarray(pixels.astype(np.float32))
