"""Nine places of a square of pixels, the nodes, that tell all of them of what is smooth in it.

Between the nodes lies a polynomial of second degree in x and in y. A square is a microtile, or `side`
microtiles wide and high; it is given by planes from its first pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import BlockVectors, PointVectors, Vectors
from quiltcli.visibility.resolve.whole import WholeTiles
from quiltcli.visibility.setup.planes import power_of_two


@dataclass(frozen=True)
class Nodes:
    """The nodes of squares of `side` microtiles."""

    side: int

    @cached_property
    def _places(self) -> FloatArray:
        """Columns, and rows, of the nodes, counted by halves so that they are whole numbers."""
        return np.array([self.side, 8 * self.side - 1, 15 * self.side - 2])

    @cached_property
    def _x(self) -> FloatArray:
        return np.tile(self._places / 2, 3)[:, None]

    @cached_property
    def _y(self) -> FloatArray:
        return np.repeat(self._places / 2, 3)[:, None]

    @property
    def _half(self) -> float:
        """From the middle to the outermost pixels' centres."""
        return 4.0 * self.side - 0.5

    @property
    def _whole(self) -> float:
        """What the weights are multiplied by to be whole numbers."""
        return (2.0 * (7 * self.side - 1) ** 2) ** 2

    @cached_property
    def _weights(self) -> FloatArray:
        """What the value at each node counts at each pixel (9, 64·side²), in whole numbers."""
        low, middle, high = self._places
        x = 2.0 * np.arange(8 * self.side)
        line = np.stack(((x - middle) * (x - high), -2 * (x - low) * (x - high), (x - low) * (x - middle)))
        # Node row and column, then those of the pixel.
        square: FloatArray = line[:, None, :, None] * line[None, :, None, :]
        return square.reshape(9, -1)

    @cached_property
    def most(self) -> float:
        """How many times as great as the greatest value of `on_grids` a pixel may be."""
        return float(np.abs(self._weights).sum(axis=0).max())

    def at(self, planes: NDArray[Any]) -> FloatArray:
        """Values (..., 9, S) of planes (..., 3, S) at the nodes."""
        a, b, c = (planes[..., k, None, :] for k in range(3))
        result: FloatArray = a * self._x
        result += b * self._y
        result += c
        return result

    def vectors(self, vectors: Vectors) -> PointVectors:
        """Vectors (3, 9, S) at the nodes; (3, 1, S) where each square has one, (3, 1, 1) where all have."""
        if isinstance(vectors, PointVectors):
            return PointVectors(vectors.values.transpose(0, 2, 1))
        return PointVectors(self.at(vectors.planes).astype(np.float32))

    def middle_vectors(self, vectors: Vectors) -> FloatArray:
        """Vectors (3, S) in the middle, or (3, 1) where all squares have one."""
        if isinstance(vectors, PointVectors):
            return vectors.values[:, :, 0].astype(np.float64)
        return self.middle(vectors.planes)

    def middle(self, planes: FloatArray) -> FloatArray:
        """Values (..., S) of planes (..., 3, S) in the middle."""
        return np.asarray(planes[..., 2, :] + self._half * (planes[..., 0, :] + planes[..., 1, :]))

    def vectors_reach(self, vectors: Vectors) -> FloatArray:
        """How far vectors in the middle (S,), or (1,) of all squares, are from the others at most."""
        if isinstance(vectors, PointVectors):
            return np.zeros(1)
        if isinstance(vectors, BlockVectors):
            return self._half * _slopes(vectors.matrix).take(vectors.block)
        return self._half * _slopes(vectors.planes)

    def reach(self, plane: FloatArray) -> FloatArray:
        """How far values of planes (3, S) in the middle are from the others (S,) at most."""
        return np.asarray(self._half * (np.abs(plane[0]) + np.abs(plane[1])))

    def on_grids(self, values: FloatArray, out: FloatArray | None = None) -> FloatArray:
        """Values (..., 9, S) at the nodes made ready for `between`: sums there are exact then.

        The grid's step is the greatest value's of a square, or less, times 2⁻⁵² times what whole weights
        add up to. Values (..., 1, S) that all nodes share stay as they are.
        """
        if values.shape[-2] == 1:
            return values
        values = np.multiply(values, 1 / self._whole, out=out)
        greatest = values.max(axis=-2, keepdims=True)
        np.maximum(greatest, -values.min(axis=-2, keepdims=True), out=greatest)
        rounding = power_of_two(np.maximum(greatest, 1e-300, out=greatest))
        rounding *= 1.5 * 2.0 ** np.ceil(np.log2(self.most))
        values += rounding
        values -= rounding
        return values

    def between(self, values: FloatArray) -> Float32Array:
        """Values (S, 64·side²) at all pixels, row by row, from `on_grids` (9, S); (S, 1) from (1, S)."""
        if len(values) == 1:
            return values.T.astype(np.float32)
        return (values.T @ self._weights).astype(np.float32)


def _slopes(planes: FloatArray) -> FloatArray:
    """The lengths of both slopes (S,) of vectors given as planes (3, 3, S), added."""
    a, b = np.sqrt((planes[:, :2] ** 2).sum(axis=0))
    return np.asarray(a + b)


nodes_of = lru_cache(Nodes)
"""`Nodes` by their side; what they need is computed once."""


def points_at_nodes(squares: WholeTiles) -> Points:
    """What is seen at the nodes of S squares: groups of the same node, (9, S)."""
    nodes = nodes_of(squares.side)
    weights = position = None
    if len(squares.weights):
        second, third, total = nodes.at(squares.weights)
        weights = np.stack((second / total, third / total)).astype(np.float32)
    if squares.rays.placed:
        position = nodes.at(squares.rays.axes) / nodes.at(squares.inverse)
    return Points(
        triangle=squares.triangle[None],
        ray=nodes.vectors(squares.rays.vectors),
        normal=None if squares.normal is None else nodes.vectors(squares.normal),
        weights=weights,
        position=position,
    )


@dataclass(frozen=True)
class NodeColors:
    """Colours at the nodes of S squares.

    Attributes:
        values: grey, or red, green and blue (1 or 3, 9, S), from `Nodes.on_grids`; (1 or 3, 1, S) where no
            pixel differs from another.
        nodes: the nodes.
    """

    values: FloatArray
    nodes: Nodes

    def __getitem__(self, part: slice) -> NodeColors:
        """Those of some squares."""
        return NodeColors(self.values[:, :, part], self.nodes)

    def pixels(self, scale: float = 1.0) -> list[Float32Array]:
        """The colours times `scale` of all pixels, each (S, 64·side²) or (S, 1)."""
        return [self.nodes.between(values * scale) for values in self.values]

    @property
    def most(self) -> float:
        """No pixel has more than this."""
        greatest = float(self.values.max(initial=0.0))
        return greatest if self.values.shape[1] == 1 else greatest * self.nodes.most
