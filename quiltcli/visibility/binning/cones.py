"""Facets as convex cones of directions from the eye.

What a facet can show lies in the cone of directions through its polygon. Working with cones, not with
one projection plane, facets on all sides of the viewer and triangles beside or behind the eye need
no special case. Every cone is made a little wider than its facet: by the bleed, and by one pixel that
covers the rounding of the tests.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.display import Facets, convex_parts
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot, hull, offsets
from quiltcli.layout import Layout
from quiltcli.visibility.binning.broad import ConeGrids

_LONGEST_MITRE = 4.0
_AT_ONCE = 1 << 14


@dataclass(frozen=True)
class Parts:
    """K convex pieces of the facets in the world; the corners of short pieces repeat the last one.

    Attributes:
        facet: (K,) facet index.
        corners: (K, n, 3) the piece itself, world metres.
        wide: (K, m, 3) the piece grown by the bleed and a pixel, world metres.
    """

    facet: Int32Array
    corners: FloatArray
    wide: FloatArray


@dataclass(frozen=True)
class Cones:
    """K convex cones of directions from one eye, those of the lit parts.

    Attributes:
        facet: (K,) facet index.
        corners: (K, n, 3) corners of the part minus the eye.
        wide: (K, m, 3) corners of the grown part minus the eye.
        planes: (K, m, 3) planes through the eye and the grown part's edges, positive inside;
            unit length, or zero for a repeated corner.
    """

    facet: Int32Array
    corners: FloatArray
    wide: FloatArray
    planes: FloatArray

    @cached_property
    def whole_facet(self) -> Int32Array:
        """The facet (K,) of parts that are all of their facet, which is convex then; −1 for other parts."""
        several = np.bincount(self.facet, minlength=1)[self.facet] > 1
        return np.where(several, np.int32(-1), self.facet)

    @cached_property
    def grids(self) -> ConeGrids:
        """The grown parts, sorted in for the broad phase."""
        return ConeGrids(self.wide)


def facet_parts(facets: Facets, layout: Layout, bleed: int) -> Parts:
    """The convex pieces of all facets that have a place in the quilt.

    Args:
        facets: the display.
        layout: its places; the pixel a piece grows by is a quilt pixel.
        bleed: pixels drawn past a facet's edge.
    """
    facet, start, corners = convex_parts(facets)
    placed = np.flatnonzero(layout.page[facet] >= 0)
    facet = facet[placed]
    polygons = [facets.corners[corners[start[k] : start[k + 1]]] for k in placed.tolist()]
    basis = np.stack((layout.du, layout.dv), axis=2) @ np.linalg.inv(layout.quilt_from_facet[:, :, :2])
    wide = list(polygons)
    counts = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    for count in np.unique(counts).tolist():
        alike = np.flatnonzero(counts == count).tolist()
        some = np.stack([polygons[k] for k in alike])
        grown = _grow(some, basis[facet[alike]], layout.origin[facet[alike]], bleed + 1.0)
        for k, polygon in zip(alike, grown, strict=True):
            wide[k] = polygon
    return Parts(facet.astype(np.int32), _padded(polygons), _padded(wide))


def lit_cones(parts: Parts, lit: BoolArray, eye: FloatArray) -> Cones:
    """The cones of the parts of lit facets; `lit` (F,), `eye` (3,)."""
    k = np.flatnonzero(lit[parts.facet])
    corners, wide = parts.corners[k] - eye, parts.wide[k] - eye
    return Cones(parts.facet[k], corners, wide, cone_planes(wide))


def cone_planes(corners: FloatArray) -> FloatArray:
    """Inward unit planes (K, m, 3) through the origin and the edges of convex polygons (K, m, 3)."""
    unit = corners / np.sqrt(dot(corners, corners))[..., None]
    planes = cross(unit, np.roll(unit, -1, axis=1))
    length = np.sqrt(dot(planes, planes))[..., None]
    planes = np.divide(planes, length, out=np.zeros_like(planes), where=length > 1e-14)
    side = dot(planes, unit.mean(axis=1)[:, None, :]).sum(axis=1)
    result: FloatArray = planes * np.sign(side)[:, None, None]
    return result


def _grow(polygons: FloatArray, basis: FloatArray, origin: FloatArray, margin: float) -> list[FloatArray]:
    """Convex polygons (m, 3) that contain others, and all within `margin` quilt pixels of them.

    The edges are moved outward; where that would make a long spike, a polygon is widened by a
    square of twice the margin instead. Both hold at least what is asked for.

    Args:
        polygons: (K, n, 3) convex polygons of as many corners each.
        basis: (K, 3, 2) world steps to the next quilt pixel right and down.
        origin: (K, 3) a point of each polygon's plane.
        margin: quilt pixels.
    """
    pixels = (polygons - origin[:, None]) @ np.linalg.pinv(basis).transpose(0, 2, 1)
    x, y = pixels[..., 0], pixels[..., 1]
    area = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    ahead = np.roll(pixels, -1, axis=1) - pixels
    ahead /= np.sqrt((ahead * ahead).sum(axis=2))[..., None]
    outward = np.stack((ahead[..., 1], -ahead[..., 0]), axis=2) * np.sign(area)[:, None, None]
    before = np.roll(outward, 1, axis=1)
    cosine = (outward * before).sum(axis=2)
    blunt = (cosine > 2.0 / _LONGEST_MITRE**2 - 1.0).all(axis=1)
    moved = pixels + margin * (outward + before) / np.where(blunt[:, None], 1.0 + cosine, 1.0)[..., None]
    square = margin * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    grown = [moved[k] if blunt[k] else _around(pixels[k][:, None] + square) for k in range(len(polygons))]
    return [flat @ basis[k].T + origin[k] for k, flat in enumerate(grown)]


def _around(points: FloatArray) -> FloatArray:
    """The convex polygon (m, 2) around points (..., 2)."""
    flat = points.reshape(-1, 2)
    return flat[hull(flat)]


def _padded(polygons: list[FloatArray]) -> FloatArray:
    """Polygons of different lengths as one array (K, m, 3) by repeating last corners."""
    counts = np.array([len(p) for p in polygons], dtype=np.int64)
    result = np.empty((counts.size, int(counts.max(initial=1)), 3))
    if polygons:
        start = offsets(counts)
        rank = np.minimum(np.arange(result.shape[1]), counts[:, None] - 1)
        result[:] = np.concatenate(polygons)[start[:-1, None] + rank]
    return result


def overlapping(
    triangle: FloatArray,
    planes: FloatArray,
    wide: FloatArray,
    first: IntArray,
    second: IntArray,
    few: int = 0,
) -> BoolArray:
    """Which pairs of convex cones have directions in common; touching counts.

    A plane through the eye and an edge of one of the cones that has the other on its outer side
    proves them apart. For cones that lie in one half-space, as the broad phase proposes them, two that
    are apart always have such a plane; beyond that a pair may be kept without need, never lost.

    Args:
        triangle: (n, 3, T) polygons [corner, axis] minus the eye.
        planes: (K, m, 3) inward planes of cones.
        wide: (K, m, 3) corners of those cones.
        first: (N,) indices into `triangle`.
        second: (N,) indices into `planes`.
        few: polygons that so many cones pass with their planes are not tested with their own.
    """
    meets = _within(by_corner(planes), triangle, second, first)
    alive = np.flatnonzero(meets)
    rest = alive[np.bincount(first[alive], minlength=triangle.shape[2])[first[alive]] > few]
    if rest.size:
        used, place = np.unique(first[rest], return_inverse=True)
        own = cone_planes(triangle.take(used, axis=2).transpose(2, 0, 1))
        meets[rest] = _within(by_corner(own), by_corner(wide), place, second[rest])
    return meets


def by_corner(polygons: FloatArray) -> FloatArray:
    """Polygons (N, n, 3) as (n, 3, N), contiguous along N."""
    return np.ascontiguousarray(polygons.transpose(1, 2, 0))


def _within(planes: FloatArray, corners: FloatArray, of_planes: IntArray, of_corners: IntArray) -> BoolArray:
    """The pairs of which no plane has all the corners on its outer side.

    Args:
        planes: (m, 3, K) inward planes.
        corners: (n, 3, T) polygons.
        of_planes: (N,) index into `planes` of each pair.
        of_corners: (N,) index into `corners`.
    """
    result = np.ones(of_planes.size, dtype=np.bool_)
    for at in range(0, of_planes.size, _AT_ONCE):
        part = slice(at, at + _AT_ONCE)
        points, inside = np.take(corners, of_corners[part], axis=2), result[part]
        for edge in planes:
            nx, ny, nz = np.take(edge, of_planes[part], axis=1)
            x, y, z = points[0]
            outside = nx * x + ny * y + nz * z < 0
            for x, y, z in points[1:]:
                outside &= nx * x + ny * y + nz * z < 0
            inside &= ~outside
    return result
