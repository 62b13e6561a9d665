"""Mesh prims at a time: faces, points, and what their corners carry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.formats.corners import Carried, Dress, Faces, dressed, faces_of
from quiltcli.formats.subdivision import SHARP
from quiltcli.formats.usd.primvars import read_normals, read_primvar
from quiltcli.formats.usd.stage import Stage, library
from quiltcli.geometry import FloatArray, IntArray


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
    return faces_of(counts, indices, vertices, holes, left_handed=left)


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
    normals = read_normals(stage, mesh, faces.corners, time)
    return dressed(sets, get(asked.color, 3), get(asked.opacity, 1), normals, moving=moving)


def read_sharpness(
    stage: Stage, mesh: Any, time: Any, vertices: int
) -> tuple[IntArray, FloatArray, IntArray]:
    """Creases of a cage: edges (E, 2), how sharp they are (E,), and vertices that stay where they are.

    Raises:
        MeshError: they do not fit one another or the mesh.
    """
    chain = _whole(mesh.GetCreaseIndicesAttr().Get(time))
    lengths = _whole(mesh.GetCreaseLengthsAttr().Get(time))
    given = mesh.GetCreaseSharpnessesAttr().Get(time)
    sharpness = np.zeros(0) if given is None else np.asarray(given, dtype=np.float64).reshape(-1)
    if (lengths < 2).any() or lengths.sum() != chain.size:
        words = f"sums up to {lengths.sum():,} (expected {chain.size:,} creaseIndices, 2 or more each)"
        raise stage.error(mesh.GetCreaseLengthsAttr(), words)
    first = np.ones(chain.size, np.bool_)
    first[np.cumsum(lengths) - 1] = False
    starts = np.flatnonzero(first)
    edges = np.stack((chain[starts], chain[starts + 1]), axis=1)
    if sharpness.size == lengths.size:
        sharpness = np.repeat(sharpness, lengths - 1)
    if sharpness.size != len(edges):
        words = f"has {sharpness.size:,} values (expected {lengths.size:,} or {len(edges):,})"
        raise stage.error(mesh.GetCreaseSharpnessesAttr(), words)
    corners = _whole(mesh.GetCornerIndicesAttr().Get(time))
    for attribute, rows in ((mesh.GetCreaseIndicesAttr(), chain), (mesh.GetCornerIndicesAttr(), corners)):
        outside = (rows < 0) | (rows >= vertices)
        if outside.any():
            raise stage.error(attribute, f"names point {rows[outside][0]} of {vertices:,}")
    # 10 is sharp for ever, as USD has it.
    return edges, np.where(sharpness >= 10, SHARP, np.maximum(np.nan_to_num(sharpness), 0)), corners


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
    return np.zeros(0, np.int64) if values is None else np.asarray(values, dtype=np.int64).reshape(-1)
