"""Subdivision surfaces: cages refined by the rules of Catmull and Clark (1978).

Creases are those of DeRose, Kass and Truong (Subdivision surfaces in character animation, 1998).

Refining is linear in the points, so it is found once for a cage and costs a sparse product at every time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags, identity, vstack

from quiltcli.formats.corners import Carried, Corners, Dress, Faces
from quiltcli.geometry import BoolArray, FloatArray, IntArray, next_in_row, segments, some_rows

SHARP = np.inf
"""Sharpness of edges that stay sharp at every level."""


@dataclass(frozen=True, eq=False)
class Cage:
    """A mesh of F faces with C corners over V vertices, and how sharp it is.

    Attributes:
        start: (F + 1,) offsets of the faces' corners, three or more each.
        vertex: (C,) the vertex of every corner.
        vertices: V.
        edges: (E, 2) vertices of edges that are sharp.
        sharpness: (E,) of these.
        pinned: (V,) vertices that stay where they are.
        corners_stay: whether a vertex of one face alone, on a border, stays where it is.
    """

    start: IntArray
    vertex: IntArray
    vertices: int
    edges: IntArray
    sharpness: FloatArray
    pinned: BoolArray
    corners_stay: bool = True


@dataclass(frozen=True, eq=False)
class Refined:
    """A cage refined some times, all its faces quadrilaterals.

    Attributes:
        start: (F' + 1,) offsets of its faces' corners.
        vertex: (C',) the vertex of every corner.
        owner: (F',) the face of the cage that each is part of.
        points: (V', V) its vertices from those of the cage.
        values: (C', C) what its corners carry from what those of the cage do, linear along edges and faces.
        variant: (C',) numbers that tell corners of one vertex apart, or None.
    """

    start: IntArray
    vertex: IntArray
    owner: IntArray
    points: csr_matrix
    values: csr_matrix
    variant: IntArray | None


def refined(cage: Cage, levels: int, variant: IntArray | None = None) -> Refined:
    """Refine a cage.

    Args:
        cage: the cage.
        levels: how many times.
        variant: (C,) numbers that tell corners of one vertex apart, or None.
    """
    faces = len(cage.start) - 1
    corners = len(cage.vertex)
    found = Refined(
        cage.start,
        cage.vertex,
        np.arange(faces),
        csr_matrix(identity(cage.vertices)),
        csr_matrix(identity(corners)),
        variant,
    )
    for _ in range(levels):
        cage, step = _step(cage, found.variant)
        row, _ = segments(found.start)
        found = Refined(
            step.start,
            step.vertex,
            # A corner becomes a face.
            found.owner[row],
            csr_matrix(step.points @ found.points),
            csr_matrix(step.values @ found.values),
            step.variant,
        )
    return found


@dataclass(frozen=True, eq=False)
class _Edges:
    """The N edges of a cage.

    Attributes:
        ends: (N, 2) vertices, the lower first.
        of_corner: (C,) the edge from each corner to the next.
        sharpness: (N,), that of borders and of edges of more than two faces SHARP.
    """

    ends: IntArray
    of_corner: IntArray
    sharpness: FloatArray


def _edges(cage: Cage) -> _Edges:
    ahead = cage.vertex[next_in_row(cage.start)]
    count = max(cage.vertices, 1)
    keys = np.minimum(cage.vertex, ahead) * count + np.maximum(cage.vertex, ahead)
    known, of_corner, faces = np.unique(keys, return_inverse=True, return_counts=True)
    sharpness = np.where(faces == 2, 0.0, SHARP)
    given = np.sort(cage.edges, axis=1)
    place = np.searchsorted(known, given[:, 0] * count + given[:, 1])
    place = np.minimum(place, len(known) - 1)
    there = known[place] == given[:, 0] * count + given[:, 1]
    np.maximum.at(sharpness, place[there], cage.sharpness[there])
    return _Edges(np.stack((known // count, known % count), axis=1), of_corner.reshape(-1), sharpness)


def _step(cage: Cage, variant: IntArray | None) -> tuple[Cage, Refined]:
    """One level."""
    edges = _edges(cage)
    row, _ = segments(cage.start)
    faces, corners, count = len(cage.start) - 1, len(cage.vertex), len(edges.ends)
    share = 1 / np.diff(cage.start)[row]
    middle = _sparse(row, cage.vertex, share, (faces, cage.vertices))
    points = csr_matrix(vstack((_vertices(cage, edges, middle), _edge_points(cage, edges, middle), middle)))
    following = next_in_row(cage.start)
    before = np.empty_like(following)
    before[following] = np.arange(corners)
    base = cage.vertices
    quads = np.stack(
        (
            cage.vertex,
            base + edges.of_corner,
            base + count + row,
            base + edges.of_corner[before],
        ),
        axis=1,
    )
    own, half = np.arange(corners), np.full(corners, 0.5)
    values = coo_matrix(
        (
            np.concatenate((np.ones(corners), half, half, half, half)),
            (
                np.concatenate((4 * own, 4 * own + 1, 4 * own + 1, 4 * own + 3, 4 * own + 3)),
                np.concatenate((own, own, following, own, before)),
            ),
        ),
        (4 * corners, corners),
    ).tocsr()
    mean = _sparse(row, own, share, (faces, corners))
    values = values + _sparse(4 * own + 2, row, np.ones(corners), (4 * corners, faces)) @ mean
    step = Refined(
        4 * np.arange(corners + 1),
        quads.ravel(),
        row,
        points,
        csr_matrix(values),
        None if variant is None else _variants(cage, variant, following, before),
    )
    sharp = np.flatnonzero(np.isfinite(edges.sharpness) & (edges.sharpness > 1))
    # Of an edge's halves each is one less sharp; borders are found again.
    halves = np.concatenate([np.stack((edges.ends[sharp, k], base + sharp), axis=1) for k in (0, 1)])
    marked = np.flatnonzero(np.isinf(edges.sharpness))
    halves = np.concatenate(
        (halves, *(np.stack((edges.ends[marked, k], base + marked), axis=1) for k in (0, 1)))
    )
    less = np.concatenate((np.tile(edges.sharpness[sharp] - 1, 2), np.full(2 * len(marked), SHARP)))
    pinned = np.zeros(base + count + faces, np.bool_)
    pinned[:base] = cage.pinned | _lonely(cage)
    return Cage(step.start, step.vertex, base + count + faces, halves, less, pinned, False), step


def _sparse(rows: IntArray, columns: IntArray, values: FloatArray, shape: tuple[int, int]) -> csr_matrix:
    return coo_matrix((values, (rows, columns)), shape).tocsr()


def _lonely(cage: Cage) -> BoolArray:
    """Vertices (V,) of one face alone, where these stay."""
    if not cage.corners_stay:
        return np.zeros(cage.vertices, np.bool_)
    return np.asarray(np.bincount(cage.vertex, minlength=cage.vertices) == 1)


def _edge_points(cage: Cage, edges: _Edges, middle: csr_matrix) -> csr_matrix:
    """A point (N, V) on every edge: between its ends and the middles of its faces, or of its ends alone."""
    count = len(edges.ends)
    own = np.repeat(np.arange(count), 2)
    ends = _sparse(own, edges.ends.ravel(), np.full(2 * count, 0.5), (count, cage.vertices))
    row, _ = segments(cage.start)
    beside = _sparse(edges.of_corner, row, np.full(len(row), 0.25), (count, middle.shape[0])) @ middle
    share = np.minimum(edges.sharpness, 1.0)
    return csr_matrix(_scaled(0.5 * ends + beside, 1 - share) + _scaled(ends, share))


def _vertices(cage: Cage, edges: _Edges, middle: csr_matrix) -> csr_matrix:
    """Where every vertex goes (V, V)."""
    count = cage.vertices
    row, _ = segments(cage.start)
    faces = np.bincount(cage.vertex, minlength=count)
    number = np.maximum(faces, 1)
    ends = np.concatenate((edges.ends, edges.ends[:, ::-1]))
    around = _sparse(ends[:, 0], ends[:, 1], np.ones(len(ends)), (count, count))
    within = _sparse(cage.vertex, row, np.ones(len(row)), (count, middle.shape[0])) @ middle
    still = csr_matrix(identity(count))
    smooth = _scaled(still, (number - 2) / number) + _scaled(around + within, 1 / number**2)

    twice = np.concatenate((edges.sharpness, edges.sharpness))
    sharp = twice > 0
    sharps = np.bincount(ends[sharp, 0], minlength=count)
    capped = np.bincount(ends[sharp, 0], np.minimum(twice[sharp], 1.0), minlength=count)
    share = np.divide(capped, sharps, out=np.zeros(count), where=sharps > 0)
    along = _sparse(ends[sharp, 0], ends[sharp, 1], np.full(sharp.sum(), 0.125), (count, count))
    crease = 0.75 * still + along
    corner = (sharps > 2) | cage.pinned | _lonely(cage) | (faces == 0)
    share = np.where(corner & (cage.pinned | _lonely(cage) | (faces == 0)), 1.0, share)
    on_crease = (sharps == 2) & ~corner
    result = _scaled(smooth, np.where(on_crease | corner, 1 - share, 1.0))
    result = (
        result
        + _scaled(crease, np.where(on_crease, share, 0.0))
        + _scaled(still, np.where(corner, share, 0.0))
    )
    return csr_matrix(result)


def _scaled(matrix: csr_matrix, factors: FloatArray) -> csr_matrix:
    """Rows of a matrix times factors."""
    return csr_matrix(diags(factors) @ matrix)


def _variants(cage: Cage, variant: IntArray, following: IntArray, before: IntArray) -> IntArray:
    """What tells corners of one vertex apart after a step: on edges, what does so at both ends."""
    most = int(variant.max(initial=0)) + 1

    def pair(others: IntArray) -> IntArray:
        # By the order of the vertices, as numbers say nothing across them.
        first = cage.vertex < cage.vertex[others]
        own, other = variant, variant[others]
        return np.asarray(np.where(first, own * most + other, other * most + own))

    keys = np.stack((variant, pair(following), np.zeros_like(variant), pair(before)), axis=1)
    found: IntArray = np.unique(keys.ravel(), return_inverse=True)[1].reshape(-1)
    return found


class Subdivided(NamedTuple):
    """A mesh whose faces are refined: its faces, what their corners carry, and which faces they were.

    Attributes:
        faces: as far as they are shown.
        dress: what their corners carry.
        owner: (F',) row of the face that each is part of.
        points: (V', V) its vertices from those of the cage.
    """

    faces: Faces
    dress: Dress
    owner: IntArray
    points: csr_matrix


def subdivided(
    faces: Faces, dress: Dress, edges: IntArray, sharpness: FloatArray, pinned: IntArray, levels: int
) -> Subdivided:
    """Refine a mesh.

    Args:
        faces: of the cage; those of fewer than three corners are left out.
        dress: what their corners carry, which becomes linear along edges.
        edges: (E, 2) vertices of edges that are sharp.
        sharpness: (E,) of these.
        pinned: vertices that stay where they are.
        levels: how many times.
    """
    some = np.flatnonzero(np.diff(faces.start) >= 3)
    start, place = some_rows(faces.start, some)
    still = np.zeros(faces.corners.vertices, np.bool_)
    still[pinned] = True
    cage = Cage(start, faces.corners.vertex[place], len(still), edges, sharpness, still)
    found = refined(cage, levels, None if dress.variant is None else dress.variant[place])

    def carried(one: Carried | None) -> Carried | None:
        if one is None:
            return None
        values = np.asarray(found.values @ one.at_corners[place])
        return Carried(values, np.arange(len(values)), by_face=True)

    owner = some[found.owner]
    number = faces.number[owner]
    row, _ = segments(found.start)
    corners = len(found.vertex)
    new = Corners(
        found.vertex,
        number[row],
        np.arange(corners),
        found.points.shape[0],
        faces.corners.faces,
        corners,
    )
    worn = Dress(
        (carried(dress.uv[0]), carried(dress.uv[1])),
        carried(dress.color),
        carried(dress.opacity),
        found.variant,
    )
    return Subdivided(Faces(found.start, number, new, faces.key), worn, owner, found.points)
