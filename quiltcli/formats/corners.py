"""The corners of a polygon mesh: what they carry, by how files spread values over faces and vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import (
    FloatArray,
    IntArray,
    cross,
    dot,
    next_in_row,
    normalized,
    offsets,
    segments,
    some_rows,
)

BY_FACE = ("uniform", "faceVarying")
"""Interpolations by which corners of one vertex may differ; the others are constant, vertex and varying."""


class CornersError(ValueError):
    """Values that do not fit a mesh; its text says why, as the end of a sentence."""


@dataclass(frozen=True, eq=False)
class Corners:
    """How the corners of a mesh are numbered.

    Attributes:
        vertex: (C,) the vertex of every corner.
        face: (C,) its face, by its number in the file.
        place: (C,) its own number in the file.
        vertices: their number in the file.
        faces: likewise.
        places: likewise.
    """

    vertex: IntArray
    face: IntArray
    place: IntArray
    vertices: int
    faces: int
    places: int

    def rows(self, interpolation: str) -> tuple[IntArray, int]:
        """The row (C,) of an array of this interpolation for each corner, and how many rows it has."""
        if interpolation == "constant":
            return np.zeros(len(self.vertex), np.int64), 1
        if interpolation == "uniform":
            return self.face, self.faces
        if interpolation == "faceVarying":
            return self.place, self.places
        return self.vertex, self.vertices


@dataclass(frozen=True, eq=False)
class Faces:
    """F faces of C corners, those that are holes left out, wound to the right-hand rule.

    Attributes:
        start: (F + 1,) offsets of the faces' corners.
        number: (F,) of each face in the file.
        corners: what the corners are in the file.
        key: equal for equal faces.
    """

    start: IntArray
    number: IntArray
    corners: Corners
    key: bytes


@dataclass(frozen=True, eq=False)
class Carried:
    """Values of a mesh's corners: `values[row]`, (C, n).

    Attributes:
        values: (R, n) as the file lists them.
        row: (C,) of each corner.
        by_face: whether corners of one vertex may have different ones.
    """

    values: FloatArray
    row: IntArray
    by_face: bool

    @property
    def at_corners(self) -> FloatArray:
        """Values (C, n)."""
        return self.values[self.row]


@dataclass(frozen=True, eq=False)
class Dress:
    """What the corners (C,) of a mesh carry beside their normals.

    Attributes:
        uv: (C, 2) texture coordinates of two sets, v up, or None.
        color: (C, 3) linear, or None.
        opacity: (C, 1), or None.
        variant: what tells corners of one vertex apart, or None.
    """

    uv: tuple[Carried | None, Carried | None]
    color: Carried | None
    opacity: Carried | None
    variant: IntArray | None


def faces_of(
    counts: IntArray, indices: IntArray, vertices: int, holes: IntArray, *, left_handed: bool
) -> Faces:
    """Faces by their counts of corners, and the vertices of those.

    Args:
        counts: (F,) corners of each face; not below 0, and as many together as there are indices.
        indices: (C,) vertices, that are there.
        vertices: how many there are.
        holes: faces to be left out.
        left_handed: whether faces are wound clockwise as one sees their front.
    """
    shown = np.ones(counts.size, np.bool_)
    shown[holes[(holes >= 0) & (holes < counts.size)]] = False
    known = b"".join((counts.tobytes(), indices.tobytes(), shown.tobytes(), bytes([left_handed])))
    number = np.flatnonzero(shown)
    start, place = some_rows(offsets(counts), number)
    row, _ = segments(start)
    if left_handed:
        place = place[turned(start)]
    corners = Corners(indices[place], number[row], place, vertices, counts.size, indices.size)
    return Faces(start, number, corners, blake2b(known, digest_size=16).digest())


def turned(start: IntArray) -> IntArray:
    """The corners (C,) of faces the other way round, the first of each its first still."""
    row, rank = segments(start)
    result: IntArray = np.where(rank == 0, start[:-1][row], start[1:][row] - rank)
    return result


def carried(
    values: Any, interpolation: str, corners: Corners, width: int, indices: IntArray | None = None
) -> Carried:
    """Values by their interpolation.

    Args:
        values: (R, width), or flat.
        interpolation: `constant`, `uniform`, `vertex`, `varying` or `faceVarying`.
        corners: of the mesh.
        width: numbers of each value.
        indices: rows of `values`, where there are any.

    Raises:
        CornersError: there are not as many as the interpolation asks for, or indices are wrong.
    """
    array: NDArray[Any] = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.size % width:
        raise CornersError(f"holds no values of {width} number{'s' * (width > 1)}")
    array = array.reshape(-1, width).astype(np.float64)
    row, count = corners.rows(interpolation)
    if indices is not None:
        if indices.size != count:
            raise CornersError(_counts("indices", indices.size, count, interpolation))
        outside = (indices < 0) | (indices >= len(array))
        if outside.any():
            raise CornersError(f"has the index {indices[outside][0]} of {len(array)} values")
        row = indices[row]
    elif len(array) != count:
        raise CornersError(_counts("values", len(array), count, interpolation))
    return Carried(array, row, interpolation in BY_FACE)


def _counts(what: str, found: int, expected: int, interpolation: str) -> str:
    return f"has {found:,} {what} (expected {expected:,}, as it is {interpolation})"


def dressed(
    uv: tuple[Carried | None, Carried | None],
    color: Carried | None,
    opacity: Carried | None,
    normals: Carried | None,
    *,
    moving: bool,
) -> Dress:
    """What corners carry, and what that tells apart; `moving` normals that are alike may become different."""
    apart = [normals.row] if normals is not None and moving and normals.by_face else []
    worn = [one for one in (*uv, color, opacity, None if apart else normals) if one is not None]
    return Dress(uv, color, opacity, _variants(worn, apart))


def same_normals(faces: Faces, normals: Carried) -> IntArray:
    """Numbers (C,) that corners of one vertex and one normal share."""
    return _joined(faces.corners.vertex, _numbered(normals))


def normals_of_groups(points: FloatArray, faces: Faces, group: IntArray) -> FloatArray:
    """Normals (C, 3) of corners: the mean of the faces around, those of a group (C,) having the same.

    Corners are weighted by |a × b| / (|a|² |b|²) of their edges a and b (Max, Weights for computing vertex
    normals from facet normals, 1999), which needs no angles.
    """
    vertex, start = faces.corners.vertex, faces.start
    here = points[vertex]
    after = here[next_in_row(start)]
    before = np.empty_like(here)
    before[next_in_row(start)] = here
    row, _ = segments(start)
    # Twice a polygon's area, in the direction of its normal (Newell).
    own = np.zeros((len(start) - 1, 3))
    np.add.at(own, row, cross(here, after))
    a, b = after - here, before - here
    turn = cross(a, b)
    scale = dot(a, a) * dot(b, b)
    weight = np.divide(np.sqrt(dot(turn, turn)), scale, out=np.zeros_like(scale), where=scale > 0)
    total = np.zeros((int(group.max(initial=-1)) + 1, 3))
    np.add.at(total, group, weight[:, None] * normalized(own)[row])
    return normalized(total)[group]


def _variants(worn: Sequence[Carried], apart: Sequence[IntArray]) -> IntArray | None:
    """What tells corners (C,) of one vertex apart: their values, and numbers (C,); None where nothing may."""
    found: IntArray | None = None
    for numbers in (*(_numbered(one) for one in worn if one.by_face), *apart):
        found = numbers if found is None else _joined(found, numbers)
    return found


def _numbered(one: Carried) -> IntArray:
    """Numbers (C,) that corners of equal values share."""
    # Adding 0 makes one zero of both.
    rows = np.ascontiguousarray(one.values + 0.0)
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).reshape(-1)
    found: IntArray = np.unique(keys, return_inverse=True)[1].reshape(-1).astype(np.int64)
    return found[one.row]


def _joined(a: IntArray, b: IntArray) -> IntArray:
    pairs = a.astype(np.int64) * (int(b.max(initial=0)) + 1) + b
    result: IntArray = np.unique(pairs, return_inverse=True)[1].reshape(-1)
    return result
