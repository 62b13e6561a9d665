"""What the visible pixels see, and planes evaluated over the pixels of microtiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.raster.planes import power_of_two

BASIS: FloatArray = np.stack((np.tile(np.arange(8.0), 8), np.repeat(np.arange(8.0), 8), np.ones(64)))
"""Column, row and 1 (3, 64) of the pixels of a microtile, whose 64 pixels are neighbours in memory."""

RUN = 8
"""Pixels of a microtile that are neighbours in the quilt."""

_BASIS32: Float32Array = BASIS.astype(np.float32)
_ROUND_TO = 6.0  # numbers below 2 that are added to it keep 2⁻²¹ in single precision, 2⁻⁵⁰ in double


@dataclass(frozen=True)
class Wanted:
    """What is asked of hits beside their place, ray and depth.

    Attributes:
        normals: (T, 12) the scene's `corner_normals`, None where no normals are asked for.
        weights: whether barycentric weights are.
        position: whether positions are.
    """

    normals: Float32Array | None = None
    weights: bool = False
    position: bool = False


@dataclass(frozen=True)
class Hits:
    """G groups of k quilt pixels; all pixels of a group see one triangle.

    A group is a microtile of 64 pixels that one triangle fills, or a single pixel: what belongs to
    the triangle is looked up once a group.

    Attributes:
        first: (R,) quilt addresses of the first of `run` neighbouring pixels; R·run = G·k, in their order.
        run: 1, or RUN.
        facet: (G,) facet index.
        triangle: (G,) triangle index.
        ray: (3, G, k) direction from the eye to the point that is seen, world axes, of any length.
        depth: (G, k) the point's depth as the viewer measures it, metres.
        normal: (3, G, k) interpolated normal on the side of the eye, of any length, or (3, G, 1) where
            each group has one; None unless wanted.
        weights: (2, G, k) barycentric weights of the triangle's second and third vertex; None unless wanted.
        position: (3, G, k) the point minus the eye, world axes, metres; None unless wanted.
        inside: how many of the pixels lie in their facet's polygon, not in its bleed.
    """

    first: IntArray
    run: int
    facet: Int32Array
    triangle: Int32Array
    ray: Float32Array
    depth: FloatArray
    normal: Float32Array | None
    weights: Float32Array | None
    position: FloatArray | None
    inside: int

    @property
    def pixel(self) -> IntArray:
        """Quilt addresses (G, k)."""
        result: IntArray = (self.first[:, None] + np.arange(self.run)).reshape(self.depth.shape)
        return result

    def pixels(self, chosen: IntArray, first: IntArray, inside: int) -> Hits:
        """Some of the pixels (P,), counted through all groups, each as a group of its own.

        Args:
            chosen: the pixels.
            first: (P,) their quilt addresses.
            inside: how many of them are not bleed.
        """
        group = chosen // self.depth.shape[1]

        def vectors(values: NDArray[Any] | None) -> Any:
            if values is None:
                return None
            index = group if values.shape[2] == 1 else chosen
            return values.reshape(len(values), -1, 1).take(index, axis=1)

        return Hits(
            first=first,
            run=1,
            facet=self.facet.take(group),
            triangle=self.triangle.take(group),
            ray=vectors(self.ray),
            depth=self.depth.reshape(-1, 1).take(chosen, axis=0),
            normal=vectors(self.normal),
            weights=vectors(self.weights),
            position=vectors(self.position),
            inside=inside,
        )

    def put(self, buffer: NDArray[Any], values: NDArray[Any]) -> None:
        """Write values (G, k), (G, 1) for whole groups, or (1, 1) for all, into a flat buffer of any type."""
        values = values.astype(buffer.dtype, copy=False)
        if values.size == 1:
            values = np.broadcast_to(values, (1, self.run))
        elif values.shape != self.depth.shape:
            values = np.broadcast_to(values, self.depth.shape)
        if self.run == 1:
            buffer[self.first] = values.reshape(-1)
            return
        # As elements of `run` pixels that begin at every address: one write for each run.
        kind = np.dtype((np.void, self.run * buffer.itemsize))
        runs = np.ndarray((buffer.size - self.run + 1,), kind, buffer.data, 0, (buffer.itemsize,))
        runs[self.first] = np.ascontiguousarray(values).reshape(-1, self.run).view(kind)[:, 0]


def point_hits(
    first: IntArray,
    facet: Int32Array,
    triangle: Int32Array,
    position: FloatArray,
    weights: FloatArray,
    depth: FloatArray,
    normals: Float32Array,
    inside: int,
) -> Hits:
    """Hits of P single pixels, from points that are known.

    Args:
        first: (P,) quilt addresses.
        facet: (P,) facet index.
        triangle: (P,) triangle index.
        position: (3, P) points minus the eye, metres.
        weights: (2, P) barycentric weights of the second and third vertex.
        depth: (P,) depth of the points, metres.
        normals: (T, 12) the scene's `corner_normals`.
        inside: pixels that are not bleed.
    """
    rows = normals.take(triangle, axis=0).T
    towards = np.sign(-(rows[9:12] * position).sum(axis=0))
    normal = (rows[0:3] + weights[0] * rows[3:6] + weights[1] * rows[6:9]) * towards
    return Hits(
        first=first,
        run=1,
        facet=facet,
        triangle=triangle,
        ray=position.astype(np.float32)[:, :, None],
        depth=depth[:, None],
        normal=normal.astype(np.float32)[:, :, None],
        weights=weights.astype(np.float32)[:, :, None],
        position=position[:, :, None],
        inside=inside,
    )


def exact_values(plane: FloatArray) -> FloatArray:
    """Values (G, 64) of planes (3, G) at the pixels of microtiles, from their first pixel.

    The planes are rounded to grids on which every sum is exact, so that neither the order of the sums
    nor the machine can be told from the result.
    """
    scale = _scale(plane)
    grid = plane / scale
    grid += _ROUND_TO
    grid -= _ROUND_TO
    grid *= scale
    return np.asarray(grid.T @ BASIS)


def vector_values(planes: FloatArray) -> Float32Array:
    """As `exact_values`, of vectors whose length does not matter: planes (c, 3, G) to (c, G, 64) float32."""
    grid = (planes / _scale(planes)).astype(np.float32)
    grid += np.float32(_ROUND_TO)
    grid -= np.float32(_ROUND_TO)
    return np.asarray(grid.transpose(0, 2, 1) @ _BASIS32)


def _scale(planes: FloatArray) -> FloatArray:
    """The power of two (G,) at or below the greatest value in a microtile of planes (..., 3, G)."""
    reach = np.abs(planes)
    reach[..., :2, :] *= 8.0
    greatest = reach.max(axis=tuple(range(reach.ndim - 1)))
    return power_of_two(np.maximum(greatest, 1e-300, out=greatest))
