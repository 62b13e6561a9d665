"""Points on the facets, each standing for the piece of area around it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.charts import Chart
from quiltcli.charts.lattice import surface_lattice
from quiltcli.charts.measure import measure
from quiltcli.display import Facets, convex_parts
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot, next_in_row

_ROOMY = 4  # times as many points as asked for are fine; then a part is one point


@dataclass(frozen=True)
class Samples:
    """S points on enabled facets.

    Attributes:
        facet: (S,) 0-based facet.
        point: (S, 3) world metres.
        normal: (S, 3) unit normal of the facet, out of its lit side.
        area: (S,) the area a point stands for, square metres.
        both_sides: whether facets are lit on both sides, all or (S,) each; curved ones never are.
    """

    facet: Int32Array
    point: FloatArray
    normal: FloatArray
    area: FloatArray
    both_sides: bool | BoolArray


def sample_facets(facets: Facets, count: int) -> Samples:
    """About `count` points spread evenly over the enabled facets, at least one on each.

    A convex part is a fan of triangles about its middle, a triangle a lattice of points that holds its
    edges and corners: distortion is greatest there, and a display's symmetries are those of the points.
    Displays of very many facets get the middle of each part alone. Surfaces get lattices of rows and columns.
    """
    if facets.charts:
        return _with_curved(facets, count)
    return _sample_flat(facets, count)


def _with_curved(facets: Facets, count: int) -> Samples:
    """Samples of a display with curved facets, which get as many of them as their area asks for."""
    curved = np.flatnonzero(facets.curved & facets.enabled).tolist()
    flat = replace(facets, enabled=facets.enabled & ~facets.curved, charts=())
    areas = {row: measure(_chart(facets, row)).area for row in curved}
    rest = float(_areas(_fans(flat)[0]).sum())
    whole = rest + sum(areas.values())
    found: list[Samples] = []
    if flat.enabled.any():
        found.append(_sample_flat(flat, max(1, round(count * rest / whole))))
    for row, area in areas.items():
        lattice = surface_lattice(_chart(facets, row), max(9, round(count * area / whole)))
        owner = np.full(len(lattice.area), row, dtype=np.int32)
        found.append(Samples(owner, lattice.point, lattice.normal, lattice.area, False))
    return Samples(
        facet=np.concatenate([one.facet for one in found]),
        point=np.concatenate([one.point for one in found]),
        normal=np.concatenate([one.normal for one in found]),
        area=np.concatenate([one.area for one in found]),
        both_sides=np.concatenate([np.full(len(one.facet), one.both_sides) for one in found]),
    )


def _chart(facets: Facets, row: int) -> Chart:
    chart = facets.charts[row]
    assert chart is not None
    return chart


def _sample_flat(facets: Facets, count: int) -> Samples:
    """The same of a display of flat facets."""
    fans, part, part_facet = _fans(facets)
    area = _areas(fans)
    if len(fans) > _ROOMY * count:
        point, owner = fans[np.unique(part, return_index=True)[1], 0], part_facet
        weight = _sums(part, area)
    else:
        # Rounded, so that areas equal but for their last bit are divided alike.
        wanted = np.round(np.sqrt(2 * count * area / area.sum()), 6)
        point, owner, weight = _merged(*_lattices(fans, part_facet[part], area, np.rint(wanted)))
    owner = owner.astype(np.int32)
    return Samples(owner, point, facets.normal[owner], weight, facets.both_sides)


def _fans(facets: Facets) -> tuple[FloatArray, IntArray, Int32Array]:
    """Triangles (T, 3, 3) from the middles of convex parts, their parts (T,), and the parts' facets (K,)."""
    part_facet, start, corner = convex_parts(facets)
    keep = facets.enabled[part_facet]
    part = np.repeat(np.arange(len(part_facet)), np.diff(start))
    points = facets.corners[corner]
    middle = np.add.reduceat(points, start[:-1], axis=0) / np.diff(start)[:, None]
    fans = np.stack((middle[part], points, points[next_in_row(start)]), axis=1)
    number = np.cumsum(keep) - 1
    mine = keep[part]
    return fans[mine], number[part[mine]], part_facet[keep]


def _areas(fans: FloatArray) -> FloatArray:
    """Areas (T,) of triangles (T, 3, 3)."""
    double = cross(fans[:, 1] - fans[:, 0], fans[:, 2] - fans[:, 0])
    result: FloatArray = np.sqrt((double**2).sum(axis=1)) / 2
    return result


def _lattices(
    fans: FloatArray, facet: Int32Array, area: FloatArray, wanted: FloatArray
) -> tuple[FloatArray, Int32Array, FloatArray]:
    """Points, facets and areas of triangles divided `wanted` times a side, once at least."""
    found: list[tuple[FloatArray, Int32Array, FloatArray]] = []
    divisions = np.maximum(wanted, 1).astype(np.int64)
    for side in np.unique(divisions).tolist():
        mine = divisions == side
        place, share = _lattice(side)
        points = np.einsum("lc,tcx->tlx", place, fans[mine])
        weights = area[mine, None] * share
        found.append((points.reshape(-1, 3), np.repeat(facet[mine], len(share)), weights.reshape(-1)))
    points, owners, weights = (np.concatenate(column) for column in zip(*found, strict=True))
    return points, owners, weights


def _lattice(side: int) -> tuple[FloatArray, FloatArray]:
    """Barycentric places (L, 3) of a triangle's lattice, and the share (L,) of the area about each."""
    i, j = (index.reshape(-1) for index in np.mgrid[: side + 1, : side + 1])
    i, j = i[i + j <= side], j[i + j <= side]
    index = np.stack((i, j, side - i - j), axis=1)
    borders = (index == 0).sum(axis=1)
    # Of the side² small triangles six meet inside, three on a border, one at a corner.
    share = np.array([6, 3, 1])[borders] / (3 * side**2)
    return index / side, share


def _merged(
    point: FloatArray, facet: Int32Array, weight: FloatArray
) -> tuple[FloatArray, Int32Array, FloatArray]:
    """The same without doubles, which neighbouring triangles of a facet have along their sides."""
    key = np.column_stack((facet, np.rint(point * 1e9))) + 0.0
    _, first, which = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return point[first], facet[first], _sums(which.reshape(-1), weight)


def _sums(row: IntArray, value: FloatArray) -> FloatArray:
    """Sums of the values (n,) of each row (n,)."""
    return np.bincount(row, value).astype(np.float64)


def middle(samples: Samples) -> FloatArray:
    """Centre of area (3,) of the samples."""
    result: FloatArray = (samples.point * samples.area[:, None]).sum(axis=0) / samples.area.sum()
    return result


def heights(samples: Samples, place: FloatArray) -> FloatArray:
    """Distances (S,) of a place (3,) from the facets' planes, negative where it sees their dark side."""
    height = dot(place - samples.point, samples.normal)
    return np.where(samples.both_sides, np.abs(height), height)
