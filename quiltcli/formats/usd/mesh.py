"""Mesh prims at a time: faces, points, and what their corners carry."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np

from quiltcli.formats.usd.primvars import Carried, Corners, carried, read_primvar, variants
from quiltcli.formats.usd.stage import Stage, library
from quiltcli.geometry import FloatArray, IntArray, offsets, segments, some_rows

_WHOLE = np.int64


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


@dataclass(frozen=True)
class Asked:
    """Names of the primvars that a mesh's material looks up, empty for none.

    Attributes:
        uv: texture coordinates of the two sets.
        color: colours.
        opacity: opacities.
    """

    uv: tuple[str, str] = ("", "")
    color: str = ""
    opacity: str = ""


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


def read_faces(stage: Stage, mesh: Any, time: Any) -> Faces:
    """The faces of a mesh prim.

    Raises:
        MeshError: counts and indices do not fit one another, or name points that are not there.
    """
    counts = _whole(mesh.GetFaceVertexCountsAttr().Get(time))
    indices = _whole(mesh.GetFaceVertexIndicesAttr().Get(time))
    if counts.size and counts.min() < 0:
        raise stage.error(
            mesh.GetFaceVertexCountsAttr(), f"has the count {counts.min()} (expected 0 or more)"
        )
    if counts.sum() != indices.size:
        words = f"has {indices.size:,} indices (expected {counts.sum():,}, the sum of faceVertexCounts)"
        raise stage.error(mesh.GetFaceVertexIndicesAttr(), words)
    points = mesh.GetPointsAttr().Get(time)
    vertices = 0 if points is None else len(points)
    outside = (indices < 0) | (indices >= vertices)
    if outside.any():
        words = f"names point {indices[outside][0]} of {vertices:,} (expected 0 to {vertices - 1:,})"
        raise stage.error(mesh.GetFaceVertexIndicesAttr(), words)
    holes = _whole(mesh.GetHoleIndicesAttr().Get(time))
    left = mesh.GetOrientationAttr().Get(time) == "leftHanded"
    known = b"".join((counts.tobytes(), indices.tobytes(), holes.tobytes(), bytes([left])))
    key = blake2b(known, digest_size=16).digest()
    shown = np.ones(counts.size, np.bool_)
    shown[holes[(holes >= 0) & (holes < counts.size)]] = False
    number = np.flatnonzero(shown)
    start, place = some_rows(offsets(counts), number)
    row, _ = segments(start)
    if left:
        place = place[turned(start)]
    corners = Corners(indices[place], number[row], place, vertices, counts.size, indices.size)
    return Faces(start, number, corners, key)


def turned(start: IntArray) -> IntArray:
    """The corners (C,) of faces the other way round, the first of each its first still."""
    row, rank = segments(start)
    result: IntArray = np.where(rank == 0, start[:-1][row], start[1:][row] - rank)
    return result


def read_points(stage: Stage, mesh: Any, time: Any, expected: int) -> FloatArray:
    """Points (V, 3) of a mesh prim.

    Raises:
        MeshError: there are not as many as expected.
    """
    found = mesh.GetPointsAttr().Get(time)
    points = np.zeros((0, 3)) if found is None else np.asarray(found, dtype=np.float64).reshape(-1, 3)
    if len(points) != expected:
        words = f"has {len(points):,} points at time code {time} (expected {expected:,})"
        raise stage.error(mesh.GetPointsAttr(), words)
    return points


def read_normals(stage: Stage, mesh: Any, corners: Corners, time: Any) -> Carried | None:
    """Normals of a mesh's corners, those of the primvar before those of the schema; None without any."""
    pxr = library()
    primvar = pxr.UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    found = read_primvar(stage, primvar, corners, 3, time)
    if found is not None:
        return found
    values = mesh.GetNormalsAttr().Get(time)
    if values is None or not len(values):
        return None
    return carried(stage, mesh.GetNormalsAttr(), values, mesh.GetNormalsInterpolation(), corners, 3)


def read_dress(stage: Stage, mesh: Any, faces: Faces, asked: Asked, time: Any, *, moving: bool) -> Dress:
    """What the corners of a mesh carry.

    Args:
        stage: its stage.
        mesh: its prim.
        faces: its faces.
        asked: what its material looks up.
        time: when.
        moving: whether its normals change: corners that are alike may become different then.

    Raises:
        MeshError: values do not fit the mesh.
    """
    api = library().UsdGeom.PrimvarsAPI(mesh)

    def get(name: str, width: int) -> Carried | None:
        # Of prims above as well, as constants are inherited.
        primvar = api.FindPrimvarWithInheritance(name) if name else None
        return read_primvar(stage, primvar, faces.corners, width, time)

    sets = get(asked.uv[0], 2), get(asked.uv[1], 2)
    color, opacity = get(asked.color, 3), get(asked.opacity, 1)
    normals = read_normals(stage, mesh, faces.corners, time)
    apart = [] if normals is None or not moving or not normals.by_face else [normals.row]
    worn = [one for one in (*sets, color, opacity, None if apart else normals) if one is not None]
    return Dress(sets, color, opacity, variants(worn, apart))


def subset_rows(stage: Stage, subsets: list[tuple[Any, int]], faces: Faces) -> IntArray:
    """The material (F,) of every face.

    Args:
        stage: the mesh's stage.
        subsets: the subsets of faces that have materials of their own, and those; 0 is that of all others.
        faces: its faces.

    Raises:
        MeshError: a subset names a face that is not there.
    """
    result = np.zeros(faces.corners.faces, dtype=np.int64)
    for subset, own in subsets:
        attribute = subset.GetIndicesAttr()
        rows = _whole(attribute.Get(library().Usd.TimeCode.EarliestTime()))
        outside = (rows < 0) | (rows >= len(result))
        if outside.any():
            raise stage.error(attribute, f"names face {rows[outside][0]} of {len(result):,}")
        result[rows] = own
    return result[faces.number]


def _whole(values: Any) -> IntArray:
    return np.zeros(0, _WHOLE) if values is None else np.asarray(values, dtype=_WHOLE).reshape(-1)
