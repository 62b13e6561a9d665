"""An octree over the scene, culled to the facets' cones: what sorting is compared with.

Harish & Narayanan (§4.2, figure 18) build one every frame: space about the triangles is halved three
times along each axis, every triangle goes into all of the 512 leaves that it meets, and a facet is sent
the triangles of the leaves that meet its frustum. Nobody asks whether the triangles themselves do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    Int32Array,
    IntArray,
    cross,
    dot,
    gather_corners,
    offsets,
    segments,
)
from quiltcli.visibility.binning.cones import Cones

DEPTH = 3
"""Halvings along each axis, as in the paper: 8 × 8 × 8 leaves."""

_CHUNK = 1 << 16
_SLACK = 1e-9  # of the tree's size, by which leaves are larger than they need to be: rounding loses nothing


@dataclass(frozen=True)
class Octree:
    """L leaves that hold triangles; the empty ones are left out.

    Attributes:
        centre: (L, 3) middles of the leaves, minus the eye, metres.
        half: (3,) half of their sides, metres.
        start: (L+1,) offsets of every leaf's triangles.
        triangle: (N,) triangle indices, by leaf, then ascending; one that meets several leaves is in all.
    """

    centre: FloatArray
    half: FloatArray
    start: IntArray
    triangle: IntArray


def build_octree(vertices: FloatArray, triangles: Int32Array, drawn: IntArray, depth: int = DEPTH) -> Octree:
    """Put triangles into the leaves that they meet.

    Args:
        vertices: (V, 3) metres.
        triangles: (T, 3).
        drawn: (D,) the triangles that are asked for, ascending.
        depth: halvings along each axis.
    """
    corners = gather_corners(vertices, triangles.take(drawn, axis=0))
    side = 1 << depth
    low, high = (
        (corners.min(axis=(0, 2)), corners.max(axis=(0, 2))) if drawn.size else (np.zeros(3), np.ones(3))
    )
    slack = _SLACK * float((high - low).max()) + np.finfo(np.float64).tiny
    cell = np.maximum((high - low) / side, slack)
    half = cell / 2 + slack
    first, last = (
        np.clip(np.floor((edge - low[:, None]) / cell[:, None]), 0, side - 1).astype(np.int64)
        for edge in (corners.min(axis=0) - slack, corners.max(axis=0) + slack)
    )
    leaf, owner = [], []
    for at in range(0, drawn.size, _CHUNK):
        part = slice(at, at + _CHUNK)
        mine, place = _cells_of(first[:, part], last[:, part])
        middle = low[:, None] + (place + 0.5) * cell[:, None]
        # A triangle whose box lies in one leaf is there; of others each leaf of the box is asked.
        several = np.flatnonzero(np.bincount(mine, minlength=1)[mine] > 1)
        meets = np.ones(mine.size, dtype=np.bool_)
        meets[several] = _meet_box(
            np.take(corners[:, :, part], mine[several], axis=2), middle[:, several], half
        )
        leaf.append((place[0] * side + place[1])[meets] * side + place[2][meets])
        owner.append(mine[meets] + at)
    leaves, owners = (np.concatenate(p) if p else np.zeros(0, np.int64) for p in (leaf, owner))
    order = np.argsort(leaves, kind="stable")
    held, start = np.unique(leaves[order], return_index=True)
    place = np.stack(np.unravel_index(held, (side, side, side)), axis=1)
    return Octree(
        low + (place + 0.5) * cell,
        half,
        np.append(start, order.size).astype(np.int64),
        drawn[owners[order]],
    )


def facet_leaves(tree: Octree, cones: Cones, count: int) -> BoolArray:
    """Which leaves meet the cone of which facet, or may: frusta are culled by their planes alone.

    Args:
        tree: the octree.
        cones: of the lit parts, as the eye sees them.
        count: facets of the display.

    Returns:
        (count, L) whether a facet is sent a leaf.
    """
    result = np.zeros((count, len(tree.centre)), dtype=np.bool_)
    outside = np.zeros((cones.facet.size, len(tree.centre)), dtype=np.bool_)
    for edge in range(cones.planes.shape[1]):
        plane = cones.planes[:, edge]
        # The corner of a leaf that lies farthest on the inner side of a plane.
        outside |= plane @ tree.centre.T + (np.abs(plane) @ tree.half)[:, None] < 0
    np.logical_or.at(result, cones.facet, ~outside)
    return result


def sent(tree: Octree, leaves: BoolArray) -> Iterator[tuple[int, IntArray, int]]:
    """What each facet is sent: its index, the triangles, ascending, each once, and how many with repeats."""
    number = np.diff(tree.start)
    for facet in np.flatnonzero(leaves.any(axis=1)).tolist():
        mine = np.flatnonzero(leaves[facet])
        which, rank = segments(offsets(number[mine]))
        found = tree.triangle.take(tree.start[mine].take(which) + rank)
        yield facet, np.unique(found), found.size


def _cells_of(first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """Every cell of boxes of cells (3, n): the box it is of (N,) and its place (3, N)."""
    extent = last - first + 1
    owner, rank = segments(offsets(extent.prod(axis=0)))
    rest, z = np.divmod(rank, extent[2].take(owner))
    x, y = np.divmod(rest, extent[1].take(owner))
    return owner, np.stack((x, y, z)) + first.take(owner, axis=1)


def _meet_box(corners: FloatArray, middle: FloatArray, half: FloatArray) -> BoolArray:
    """Which triangles meet a box each, if their bounding boxes do.

    What is left of the separating axes of a box and a triangle: the triangle's normal, and the products
    of its edges with the box's (Akenine-Möller, *Fast 3D Triangle-Box Overlap Testing*, 2001).

    Args:
        corners: (3, 3, n) [corner, axis].
        middle: (3, n) middles of the boxes.
        half: (3,) half of their sides.
    """
    points = np.ascontiguousarray((corners - middle).transpose(0, 2, 1))
    edges = np.roll(points, -1, axis=0) - points
    result = np.ones(middle.shape[1], dtype=np.bool_)
    axes = [cross(edges[0], edges[1])]
    for unit in np.eye(3):
        axes += [cross(np.broadcast_to(unit, edge.shape), edge) for edge in edges]
    for axis in axes:
        reach = np.abs(axis) @ half
        along = np.stack([dot(point, axis) for point in points])
        result &= (along.min(axis=0) <= reach) & (along.max(axis=0) >= -reach)
    return result
