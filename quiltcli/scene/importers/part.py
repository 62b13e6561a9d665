"""A piece of a scene mesh, and how it is put in its place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, IntArray, cross, dot
from quiltcli.scene.materials import Surface


@dataclass(frozen=True)
class Part:
    """A piece of a mesh file that has one surface.

    Attributes:
        vertices: (V, 3) in the space of the file, instances placed.
        triangles: (T, 3) indices.
        normals: (V, 3) as the file gives them, or None.
        colors: (V, 3) linear, or None.
        surface: its material.
        mirrored: whether its placement turned the winding inside out.
        uv: (V, 2) texture coordinates, v up, NaN for a vertex without any, or None.
        uv1: (V, 2) those of the second set, likewise.
    """

    vertices: FloatArray
    triangles: IntArray
    normals: FloatArray | None
    colors: Float32Array | None
    surface: Surface
    mirrored: bool = False
    uv: FloatArray | None = None
    uv1: FloatArray | None = None


def placed(part: Part, matrix: FloatArray) -> Part:
    """The part moved by an affine (4, 4) matrix; normals by its inverse transpose.

    A matrix that flattens space leaves no normals; neither do the triangles keep any area.
    """
    if np.array_equal(matrix, np.eye(4)):
        return part
    rows = matrix[:3, :3]
    # The rows of the cofactor matrix: det · inverse transpose.
    cofactors = cross(np.roll(rows, -1, axis=0), np.roll(rows, -2, axis=0))
    det = float(dot(rows[0], cofactors[0]))
    return replace(
        part,
        vertices=_linear(rows, part.vertices) + matrix[:3, 3],
        normals=None if part.normals is None or det == 0 else _linear(cofactors / det, part.normals),
        mirrored=part.mirrored ^ (det < 0),
    )


def _linear(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """`matrix` applied to every row, in a fixed order of sums: a matrix product has none."""
    columns = (points[:, 0:1] * matrix[:, 0], points[:, 1:2] * matrix[:, 1], points[:, 2:3] * matrix[:, 2])
    result: FloatArray = columns[0] + columns[1] + columns[2]
    return result
