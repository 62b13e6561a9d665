"""The triangles of a glTF file as the faces of a display."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.gltf import read_gltf
from quiltcli.formats.gltf.model import Primitive
from quiltcli.formats.gltf.posing import pieces, placed, placed_triangles, rest_pose
from quiltcli.formats.mesh.mesh import PolygonMesh
from quiltcli.geometry import FloatArray


def read_gltf_mesh(path: Path) -> PolygonMesh:
    """Every triangle that the file's scene shows at rest, in the order of meshes and primitives.

    Copies of one primitive come in the order of their transforms, and mirrored ones are wound so that
    their front stays their front.

    Raises:
        MeshError: the file is wrong, or shows no triangle.
    """
    gltf = read_gltf(path)
    at_rest = rest_pose(gltf)
    vertices: list[FloatArray] = []
    corners, uv = [], []
    base = 0
    for piece in pieces(gltf):
        there = placed(gltf, piece, at_rest)
        # Nodes may be numbered anew by every program that writes the file; where they are stays.
        order = np.lexsort(piece.places(at_rest).reshape(piece.copies, -1).T[::-1])
        triangles = placed_triangles(piece, there.mirrored[order]).ravel()
        vertices.append(there.vertices.reshape(piece.copies, -1, 3)[order].reshape(-1, 3))
        corners.append(triangles + base)
        uv.append(_texture_coordinates(piece.primitive, piece.copies)[triangles])
        base += len(there.vertices)
    count = sum(map(len, corners)) // 3
    if not count:
        raise MeshError(Problem("holds no triangles", str(path)))
    pairs = np.concatenate(uv)
    return PolygonMesh(
        vertices=np.concatenate(vertices),
        corner_start=3 * np.arange(count + 1),
        corners=np.concatenate(corners),
        uv=None if np.isnan(pairs).all() else pairs,
        names=("",) * count,
        lines=np.zeros(count, dtype=np.int64),
        path=str(path),
    )


def _texture_coordinates(primitive: Primitive, copies: int) -> FloatArray:
    """Texture coordinates of all copies' vertices, v up; NaN where there are none."""
    first, second = primitive.uv
    pairs = second if first is None else first
    if pairs is None:
        return np.full((copies * len(primitive.positions), 2), np.nan)
    return np.tile(np.stack((pairs[:, 0], 1 - pairs[:, 1]), axis=1), (copies, 1))
