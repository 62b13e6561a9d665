"""A piece of a scene mesh, and how it is put in its place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, IntArray, applied, cofactors
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
        material: name of its material, empty where the file gives none.
        opacities: (V,) alpha, or None.
        turns: (V, 3) how the file's tangents lie (`textures.tangents.turns_of`), or None.
    """

    vertices: FloatArray
    triangles: IntArray
    normals: FloatArray | None
    colors: Float32Array | None
    surface: Surface
    mirrored: bool = False
    uv: FloatArray | None = None
    uv1: FloatArray | None = None
    material: str = ""
    opacities: Float32Array | None = None
    turns: Float32Array | None = None


def placed(part: Part, matrix: FloatArray) -> Part:
    """The part moved by an affine (4, 4) matrix, as `moved`; what mirrors turns its winding inside out."""
    if np.array_equal(matrix, np.eye(4)):
        return part
    vertices, normals = moved(matrix, part.vertices, part.normals)
    mirrored = part.mirrored ^ bool(cofactors(matrix[:3, :3])[1] < 0)
    return replace(part, vertices=vertices, normals=normals, mirrored=mirrored)


def moved(
    matrix: FloatArray, vertices: FloatArray, normals: FloatArray | None
) -> tuple[FloatArray, FloatArray | None]:
    """Vertices (V, 3) moved by an affine (4, 4) matrix, and normals (V, 3) by its inverse transpose.

    A matrix that flattens space leaves no normals; neither do triangles keep any area.
    """
    if np.array_equal(matrix, np.eye(4)):
        return vertices, normals
    rows = matrix[:3, :3]
    turned, det = cofactors(rows)
    if normals is not None:
        normals = None if det == 0 else applied(turned / det, normals)
    return applied(rows, vertices) + matrix[:3, 3], normals
