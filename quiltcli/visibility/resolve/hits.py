"""What the visible pixels see, and its way into the quilt's buffers."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Flag, auto
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.visibility.resolve.footprints import Edges, PointEdges
from quiltcli.visibility.resolve.vectors import PointVectors, Vectors

RUN = 8
"""Pixels of a microtile that are neighbours in the quilt."""


class Wanted(Flag):
    """What is asked of hits beside their place, triangle, ray and depth."""

    NOTHING = 0
    NORMAL = auto()
    """Interpolated normals."""
    WEIGHTS = auto()
    """Barycentric weights."""
    POSITION = auto()
    """Points, minus the eye."""
    EDGES = auto()
    """What attributes and their slopes are worked out by."""


def _none() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Places:
    """P quilt pixels: runs of neighbours, and single ones behind them.

    Attributes:
        first: (R,) quilt addresses of the first pixels of the runs.
        run: pixels of a run, a multiple of RUN.
        single: (S,) quilt addresses of the others; R·run + S = P, in their order.
    """

    first: IntArray
    run: int
    single: IntArray = field(default_factory=_none)

    @property
    def pixel(self) -> IntArray:
        """Quilt addresses (P,)."""
        runs = (self.first[:, None] + np.arange(self.run)).reshape(-1)
        return np.concatenate((runs, self.single))

    def put(self, buffer: NDArray[Any], values: NDArray[Any]) -> None:
        """Write values of the buffer's type, (P,) or (1,) for all, into a flat buffer."""
        if self.single.size:
            buffer[self.single] = values if values.size == 1 else values[-self.single.size :]
        if not self.first.size:
            return
        # As elements of `run` pixels: one write for each run.
        size = buffer.itemsize
        kind = np.dtype((np.void, self.run * size))
        count = self.first.size * self.run
        runs = np.repeat(values, self.run) if values.size == 1 else np.ascontiguousarray(values[:count])
        # Elements that begin at every address take three times as long.
        step = 1 if self._counted is None else RUN
        places = ((buffer.size - self.run) // step + 1,)
        elements = np.ndarray(places, kind, buffer.data, 0, (step * size,))
        elements[self.first if self._counted is None else self._counted] = runs.view(kind)

    @cached_property
    def _counted(self) -> IntArray | None:
        """Addresses of the runs counted in RUNs; None where they do not begin at multiples of them."""
        if np.bitwise_or.reduce(self.first) & (RUN - 1):
            return None
        return self.first >> RUN.bit_length() - 1


def single_places(address: IntArray) -> Places:
    """Pixels (P,) anywhere."""
    return Places(_none(), RUN, address)


@dataclass(frozen=True)
class Points:
    """What shading has to know of n groups of k points that are seen; or of one group, where n is 1.

    Attributes:
        triangle: triangle index, (n, 1) where a group sees one, (1, k) where all groups see the same k.
        ray: directions from the eye to the points, world axes, of any length.
        normal: interpolated normals on the side of the eye, of any length.
        weights: (2, n, k) barycentric weights of the triangle's second and third vertex, or None.
        position: (3, n, k) the points minus the eye, world axes, metres, or None.
        edges: what attributes and their slopes are worked out by, or None.
    """

    triangle: Int32Array
    ray: Vectors
    normal: Vectors | None
    weights: Float32Array | None
    position: FloatArray | None
    edges: Edges | None = None


@dataclass(frozen=True)
class Hits:
    """What is seen at the pixels of G groups of k; all of a group see one triangle.

    A group is a microtile, or a square of them, that one triangle fills, or a single pixel: what belongs
    to the triangle is looked up once a group. P of the G·k pixels are to be drawn.

    Attributes:
        places: where the P pixels that are drawn lie in the quilt.
        chosen: (P,) these pixels, counted through all groups; None where all are drawn.
        facet: (G,) facet index.
        triangle: (G,) triangle index.
        ray: directions from the eye to the points that are seen, world axes, of any length.
        depth: (G, k) the point's depth as the viewer measures it, metres.
        normal: interpolated normals on the side of the eye, of any length; None unless wanted.
        weights: (2, G, k) barycentric weights of the triangle's second and third vertex; None unless wanted.
        position: (3, G, k) the point minus the eye, world axes, metres; None unless wanted.
        inside: how many of the drawn pixels lie in their facet's polygon, not in its bleed.
        edges: what attributes and their slopes are worked out by; None unless wanted.
    """

    places: Places
    chosen: IntArray | None
    facet: Int32Array
    triangle: Int32Array
    ray: Vectors
    depth: FloatArray
    normal: Vectors | None
    weights: Float32Array | None
    position: FloatArray | None
    inside: int
    edges: Edges | None = None

    @property
    def points(self) -> Points:
        """What shading has to know of them."""
        return Points(self.triangle[:, None], self.ray, self.normal, self.weights, self.position, self.edges)

    @property
    def pixel(self) -> IntArray:
        """Quilt addresses (P,)."""
        return self.places.pixel

    def drawn(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (P,) of the drawn pixels, of values (G, k), (G, 1) for whole groups, or (1, 1) for all."""
        k = self.depth.shape[1]
        if values.size == 1:
            values = np.broadcast_to(values, (len(self.depth), 1))
        index = self.chosen
        if values.shape[1] < k and index is None:
            return np.broadcast_to(values, (len(values), k)).reshape(-1)
        if values.shape[1] < k:
            index = index // k
        flat = values.reshape(-1)
        return flat if index is None else np.asarray(flat.take(index))

    def put(self, buffer: NDArray[Any], values: NDArray[Any], some: IntArray | None = None) -> None:
        """Write values (G, k), (G, 1) for whole groups, or (1, 1) for all, into a flat buffer of any type.

        Args:
            buffer: written to.
            values: the values.
            some: the only pixels written to, of all that are drawn; None for all.
        """
        values = values.astype(buffer.dtype, copy=False)
        if some is not None:
            buffer[self.pixel[some]] = self.drawn(values)[some]
            return
        self.places.put(buffer, values.reshape(-1) if values.size == 1 else self.drawn(values))


def point_hits(
    first: IntArray,
    facet: Int32Array,
    triangle: Int32Array,
    position: FloatArray,
    weights: FloatArray,
    depth: FloatArray,
    normals: Float32Array,
    inside: int,
    slopes: FloatArray | None = None,
    ray: FloatArray | None = None,
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
        slopes: (2, 2, P) how the weights change from pixel to pixel [weight, axis], where that is wanted.
        ray: (3, P) rays that end in the points, of any length; None where they come from the eye.
    """
    ray = position if ray is None else ray
    rows = normals.take(triangle, axis=0).T
    towards = np.sign(-(rows[9:12] * ray).sum(axis=0))
    normal = (rows[0:3] + weights[0] * rows[3:6] + weights[1] * rows[6:9]) * towards
    return Hits(
        places=single_places(first),
        chosen=None,
        facet=facet,
        triangle=triangle,
        ray=PointVectors(ray.astype(np.float32)[:, :, None]),
        depth=depth[:, None],
        normal=PointVectors(normal.astype(np.float32)[:, :, None]),
        weights=weights.astype(np.float32)[:, :, None],
        position=position[:, :, None],
        inside=inside,
        edges=None if slopes is None else PointEdges(triangle, weights, slopes),
    )
