"""How attributes of triangles change from pixel to pixel: what textures are filtered by.

An attribute u of a triangle is U/S, with S the sum of the edge functions and U = Σ uₖEₖ, both planes over
the pixels. So its slopes need no differences: ∂u/∂x = (U_x − u·S_x)/S, and likewise along y.

A sample stands for a part of its pixel, its cell. Attributes are those of the cell's middle, slopes go over
the cell's width and height, so the footprints of a pixel's samples tile that of the pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.visibility.resolve.scattered import values_at
from quiltcli.visibility.setup.grids import grid_values, on_grid
from quiltcli.visibility.setup.planes import LATTICE, Planes, moved, power_of_two

_NEAR = 64.0  # pixels, about as far as a surface's pixels are from where its planes begin
_LEAST = 0.5  # of S at the sample that S in the middle of the cell must be


@dataclass(frozen=True)
class Cells:
    """The parts of pixels that samples stand for, in quilt pixels.

    Attributes:
        offset: (F, 2) from the sample to the middle of the cell, by facet.
        size: (F, 2) width and height of the cell.
    """

    offset: FloatArray
    size: FloatArray


@dataclass(frozen=True)
class Footprint:
    """Two attributes at n groups of k points, and how far they go from one pixel, or cell, to the next.

    Attributes:
        u: (n, k) the first.
        v: (n, k) the second.
        slopes: (4, n, k) ∂u/∂x, ∂u/∂y, ∂v/∂x and ∂v/∂y.
    """

    u: FloatArray
    v: FloatArray
    slopes: Float32Array


class Edges(Protocol):
    """What is known of S triangles and of the points that see them, to work out attributes there."""

    @property
    def kept(self) -> dict[Any, Any]:
        """What was worked out, for those who ask again, by a key of theirs."""

    @property
    def triangle(self) -> Int32Array:
        """(S,) triangle index."""

    def each(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (..., S) of triangles at the groups of points that see them, (..., n, 1)."""

    def footprint(self, corners: FloatArray) -> Footprint:
        """Two attributes from their values (2, 3, S) at the triangles' corners."""

    def weights(self) -> Float32Array:
        """Barycentric weights (2, n, k) of the triangles' second and third corner."""


@dataclass(frozen=True)
class EdgePlanes:
    """Planes of S triangles from places of their own.

    Attributes:
        triangle: (S,) triangle index.
        planes: (3, 3, S) of the sum of the edge functions, of the second and of the third.
        beside: (2, S) from the sample to the middle of its cell; None where they are the same.
        size: (2, S) width and height of the cell; None where it is the pixel.
    """

    triangle: Int32Array
    planes: FloatArray
    beside: FloatArray | None = None
    size: FloatArray | None = None

    def __getitem__(self, part: slice | IntArray) -> EdgePlanes:
        """Those of some triangles."""
        return EdgePlanes(
            self.triangle[part],
            self.planes[:, :, part],
            None if self.beside is None else self.beside[:, part],
            None if self.size is None else self.size[:, part],
        )

    def attributes(self, corners: FloatArray) -> FloatArray:
        """Numerators (2, 3, S) of attributes from their values (2, 3, S) at the corners."""
        total, second, third = self.planes
        first = corners[:, 0, None]
        return np.asarray(
            first * total + (corners[:, 1, None] - first) * second + (corners[:, 2, None] - first) * third
        )

    def at_cells(self, planes: FloatArray) -> FloatArray:
        """Planes (..., 3, S) moved to the middles of the cells."""
        return planes if self.beside is None else moved(*self.beside, out=planes.copy())


def edge_planes_of(
    planes: Planes,
    rows: IntArray,
    x: NDArray[Any],
    y: NDArray[Any],
    cells: Cells | None,
    facet: Int32Array,
) -> EdgePlanes:
    """The edges of pairs.

    Args:
        planes: those of a batch.
        rows: (S,) the pairs.
        x: (S,) columns in the blocks at which the result's planes begin.
        y: (S,) rows.
        cells: the parts of the pixels that are seen; None for all of them.
        facet: (S,) the pairs' facets.
    """
    # Attributes are measured at the place itself; only what covers it is decided on the shifted lattice.
    edge = moved(x - LATTICE[0], y - LATTICE[1], out=np.take(planes.edge, rows, axis=2))
    edge[0] += edge[1]
    edge[0] += edge[2]
    reach = np.abs(edge[0])
    reach[:2] *= _NEAR
    edge /= power_of_two(np.maximum(reach.max(axis=0), 1e-300))
    triangle = planes.triangle.take(rows)
    if cells is None:
        return EdgePlanes(triangle, edge)
    return EdgePlanes(triangle, edge, cells.offset[facet].T, cells.size[facet].T)


@dataclass(frozen=True)
class TileEdges:
    """Edges of triangles each of which fills a square of microtiles.

    Attributes:
        edges: theirs, from the squares' first pixels.
        side: microtiles from side to side.
    """

    edges: EdgePlanes
    side: int
    kept: dict[Any, Any] = field(default_factory=dict)

    def __getitem__(self, part: slice | IntArray) -> TileEdges:
        """Those of some squares."""
        return TileEdges(self.edges[part], self.side)

    @property
    def triangle(self) -> Int32Array:
        """See `Edges`."""
        return self.edges.triangle

    def each(self, values: NDArray[Any]) -> NDArray[Any]:
        """See `Edges`."""
        return values[..., None]

    def footprint(self, corners: FloatArray) -> Footprint:
        """See `Edges`."""
        edges, side = self.edges, self.side
        planes = np.concatenate((edges.attributes(corners), edges.planes[:1]))
        grids = on_grid(edges.at_cells(planes), side)
        u, v, total = (grid_values(plane, side) for plane in grids)
        if edges.beside is not None:
            here = grid_values(on_grid(planes[2], side), side)
            _stay_near(u, v, total, here, (grids - on_grid(planes, side))[:, 2, :, None])
        return _divided(u, v, total, planes[:, :2, :, None], edges.size)

    def weights(self) -> Float32Array:
        """See `Edges`; at the samples themselves."""
        total, second, third = (grid_values(on_grid(p, self.side), self.side) for p in self.edges.planes)
        return np.stack((second / total, third / total)).astype(np.float32)


@dataclass(frozen=True)
class PixelEdges:
    """Edges of triangles that single pixels see.

    Attributes:
        edges: theirs.
        which: (G,) which of them each pixel sees.
        x: (G,) columns of the pixels in their blocks.
        y: (G,) rows.
        x0: (S,) columns at which the planes begin.
        y0: (S,) rows.
    """

    edges: EdgePlanes
    which: IntArray
    x: FloatArray
    y: FloatArray
    x0: Int32Array
    y0: Int32Array
    kept: dict[Any, Any] = field(default_factory=dict)

    @property
    def triangle(self) -> Int32Array:
        """See `Edges`."""
        return self.edges.triangle

    def each(self, values: NDArray[Any]) -> NDArray[Any]:
        """See `Edges`."""
        return values.take(self.which, axis=-1)[..., None]

    def footprint(self, corners: FloatArray) -> Footprint:
        """See `Edges`."""
        edges = self.edges
        planes = np.concatenate((edges.attributes(corners), edges.planes[:1]))
        centred = edges.at_cells(planes)
        u, v, total = self._values(centred)
        if edges.beside is not None:
            here = self._values(planes[2:])[0]
            _stay_near(u, v, total, here, self.each((centred - planes)[:, 2]))
        size = None if edges.size is None else edges.size.take(self.which, axis=1)
        return _divided(u, v, total, self.each(planes[:, :2]), size)

    def weights(self) -> Float32Array:
        """See `Edges`; at the samples themselves."""
        total, second, third = self._values(self.edges.planes)
        return np.stack((second / total, third / total)).astype(np.float32)

    def _values(self, planes: FloatArray) -> NDArray[Any]:
        return values_at(planes, self.which, self.x, self.y, self.x0, self.y0)


@dataclass(frozen=True)
class PointEdges:
    """Points whose weights are known otherwise, with their slopes; one triangle a point.

    Attributes:
        triangle: (P,) triangle index.
        known: (2, P) weights of the second and third corner.
        slopes: (2, 2, P) how these change along x and y [weight, axis].
    """

    triangle: Int32Array
    known: FloatArray
    slopes: FloatArray
    kept: dict[Any, Any] = field(default_factory=dict)

    def each(self, values: NDArray[Any]) -> NDArray[Any]:
        """See `Edges`."""
        return values[..., None]

    def footprint(self, corners: FloatArray) -> Footprint:
        """See `Edges`."""
        second, third = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        u, v = corners[:, 0] + second * self.known[0] + third * self.known[1]
        slopes = second[:, None] * self.slopes[0] + third[:, None] * self.slopes[1]
        return Footprint(u[:, None], v[:, None], slopes.reshape(4, -1, 1).astype(np.float32))

    def weights(self) -> Float32Array:
        """See `Edges`."""
        return self.known.astype(np.float32)[:, :, None]


def _stay_near(u: FloatArray, v: FloatArray, total: FloatArray, here: FloatArray, shift: FloatArray) -> None:
    """Take the sample's own place where the cell's middle is beyond the horizon, or almost there.

    Args:
        u: (n, k) numerator in the middle of the cell.
        v: (n, k) the same of the other attribute.
        total: (n, k) their denominator.
        here: (n, k) denominator at the sample.
        shift: (3, n, 1) what u, v and the denominator have more than at the sample.
    """
    far = total < _LEAST * here
    if far.any():
        for values, more in zip((u, v, total), shift, strict=True):
            values -= np.where(far, more, 0.0)


def _divided(
    u: FloatArray, v: FloatArray, total: FloatArray, steps: FloatArray, size: FloatArray | None
) -> Footprint:
    """Attributes and slopes.

    Args:
        u: (n, k) numerator, that makes way for the attribute.
        v: (n, k) the same of the other.
        total: (n, k) their denominator, that makes way for one over it.
        steps: (3, 2, n, 1) how u, v and the denominator change along x and y.
        size: (2, n) width and height of the cells; None for whole pixels.
    """
    over = np.divide(1.0, total, out=total)
    u *= over
    v *= over
    single = over.astype(np.float32)
    scale = None if size is None else size.astype(np.float32)
    steps = steps.astype(np.float32)
    slopes = np.empty((4, *u.shape), dtype=np.float32)
    for k, values in enumerate((u.astype(np.float32), v.astype(np.float32))):
        for axis in range(2):
            slope = np.multiply(values, -steps[2, axis], out=slopes[2 * k + axis])
            slope += steps[k, axis]
            slope *= single if scale is None else single * scale[axis, :, None]
    return Footprint(u, v, slopes)
