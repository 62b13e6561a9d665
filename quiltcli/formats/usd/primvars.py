"""What a mesh's corners carry: primvars and normals by their interpolation and indices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import MeshError
from quiltcli.formats.usd.stage import Stage
from quiltcli.geometry import FloatArray, IntArray

BY_FACE = ("uniform", "faceVarying")
"""Interpolations by which corners of one vertex may differ."""


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


def read_primvar(stage: Stage, primvar: Any, corners: Corners, width: int, time: Any) -> Carried | None:
    """Values of a primvar; None where it has none.

    Raises:
        MeshError: there are not as many as its interpolation asks for, of that width, or indices are wrong.
    """
    if not primvar or not primvar.HasValue():
        return None
    attribute = primvar.GetAttr()
    values = attribute.Get(time)
    if values is None:
        return None
    indices = primvar.GetIndices(time) if primvar.IsIndexed() else None
    named = None if indices is None else np.asarray(indices, dtype=np.int64).reshape(-1)
    return carried(stage, attribute, values, primvar.GetInterpolation(), corners, width, named)


def carried(
    stage: Stage,
    attribute: Any,
    values: Any,
    interpolation: str,
    corners: Corners,
    width: int,
    indices: IntArray | None = None,
) -> Carried:
    """Values of an attribute by its interpolation; errors as of `read_primvar`."""
    array: NDArray[Any] = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.size % max(width, 1):
        raise _wrong(
            stage, attribute, f"is of type {attribute.GetTypeName()} (expected {width} numbers each)"
        )
    array = array.reshape(-1, width).astype(np.float64)
    row, count = corners.rows(interpolation)
    if indices is not None:
        if indices.size != count:
            raise _wrong(stage, attribute, _counts("indices", indices.size, count, interpolation))
        outside = (indices < 0) | (indices >= len(array))
        if outside.any():
            words = f"has the index {indices[outside][0]} of {len(array)} values"
            raise _wrong(stage, attribute, words)
        row = indices[row]
    elif len(array) != count:
        raise _wrong(stage, attribute, _counts("values", len(array), count, interpolation))
    return Carried(array, row, interpolation in BY_FACE)


def _counts(what: str, found: int, expected: int, interpolation: str) -> str:
    return f"has {found:,} {what} (expected {expected:,}, as it is {interpolation})"


def _wrong(stage: Stage, attribute: Any, message: str) -> MeshError:
    return stage.error(attribute, message)


def variants(carried: list[Carried], moving: list[IntArray]) -> IntArray | None:
    """What tells corners (C,) of one vertex apart; None where nothing may.

    Args:
        carried: what they carry; corners of the same values are alike.
        moving: numbers (C,) of what they carry and what may change.
    """
    found: IntArray | None = None
    for numbers in (*(_numbered(one) for one in carried if one.by_face), *moving):
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
