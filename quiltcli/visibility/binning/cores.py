"""Cores: the directions that one facet alone can show.

The first pass may settle a triangle when its three vertices fall on the same facet only if no other
lit facet reaches into the triangle: not a neighbour's bleed, and on concave, folded or
self-intersecting displays not another facet in front or behind. So every facet is cut back, plane by
plane, until none of the others' cones meets it. What remains is convex: a triangle with its corners
in it lies in it.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, dot, segments
from quiltcli.visibility.binning.broad import candidate_pairs
from quiltcli.visibility.binning.cones import Cones, by_corner, overlapping
from quiltcli.visibility.binning.cut import cut_polygons

_MARGIN = 1e-5
"""Radians kept free beside another facet's cone; Embree's rays are single precision."""


def facet_cores(cones: Cones) -> tuple[FloatArray, IntArray]:
    """Cut every part back to what no other facet's cone meets.

    Args:
        cones: the lit parts.

    Returns:
        corners (K, n, 3) of the cores minus the eye, short ones repeating their last corner, and
        their numbers (K,), 0 where nothing remains.
    """
    # One cut after the other: in each turn every part that has another plane left is cut once.
    corners = cones.corners
    counts = np.full(cones.facet.size, corners.shape[1])
    part, plane = _dividing_planes(cones, *_conflicts(cones))
    _, rank = segments(np.searchsorted(part, np.arange(cones.facet.size + 1)))
    for turn in range(int(rank.max(initial=-1)) + 1):
        now = np.flatnonzero(rank == turn)
        mine = part[now]
        side = _sides(corners[mine], plane[now])
        cut = (side <= 0).any(axis=1)
        if not cut.any():
            continue
        mine = mine[cut]
        clipped, left = cut_polygons(corners[mine], counts[mine], side[cut])
        # A cut may add a corner.
        wider = clipped.shape[1] - corners.shape[1]
        if wider > 0:
            corners = np.concatenate((corners, np.repeat(corners[:, -1:], wider, axis=1)), axis=1)
        corners = corners.copy()
        corners[mine, : clipped.shape[1]] = clipped
        corners[mine, clipped.shape[1] :] = clipped[:, -1:]
        counts[mine] = left
    return corners, counts


def _conflicts(cones: Cones) -> tuple[IntArray, IntArray]:
    """Parts and the parts of other facets whose grown cones meet them."""
    corners = by_corner(cones.corners)
    first, second = candidate_pairs(corners, cones.grids)
    other = cones.facet[first] != cones.facet[second]
    first, second = first[other], second[other]
    meets = overlapping(corners, cones.planes, cones.wide, first, second)
    return first[meets], second[meets]


def _dividing_planes(cones: Cones, part: IntArray, other: IntArray) -> tuple[IntArray, FloatArray]:
    """Planes that divide parts from others, by part; those that cut away most come first.

    Args:
        cones: the lit parts.
        part: (N,) parts.
        other: (N,) parts that meet them.

    Returns:
        the parts (N,), and planes (N, 3), positive on the side that is kept: of each `other` the edge
        that leaves most.
    """
    centre = cones.corners.mean(axis=1)
    centre /= np.sqrt(dot(centre, centre))[:, None]
    planes = cones.planes[other]
    outside = -dot(planes, centre[part][:, None, :])
    outside[~planes.any(axis=2)] = -np.inf
    best = outside.argmax(axis=1)
    row = np.arange(part.size)
    order = np.lexsort((other, outside[row, best], part))
    return part[order], -planes[row, best][order]


def _sides(polygons: FloatArray, planes: FloatArray) -> FloatArray:
    """How far the corners (N, n) of polygons (N, n, 3) lie beyond the margin of one plane (N, 3) each."""
    length = np.sqrt(dot(polygons, polygons))
    result: FloatArray = dot(polygons, planes[:, None, :]) - _MARGIN * length
    return result
