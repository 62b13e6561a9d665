"""Parts of a scene from a polygon mesh: triangles, vertices parted where their corners differ, surfaces.

Kd and Ke of MTL are linear, as numbers in a file are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.mesh.coverage import Coverage, coverage
from quiltcli.formats.mesh.mtl import MeshMaterial, MeshTexture
from quiltcli.formats.mesh.polygons import Triangles, plane_coordinates, triangulate
from quiltcli.geometry import BoolArray, FloatArray, IntArray, some_rows
from quiltcli.scene.importers.part import Part
from quiltcli.scene.materials import Surface, Texture
from quiltcli.scene.textures.picture import Picture

_KEY_LIMIT = 2**62
_OF_PICTURES = {"color": (1.0, 1.0, 1.0), "emission": (1.0, 1.0, 1.0), "roughness": 1.0, "metallic": 1.0}
"""What a picture multiplies in a material that says nothing of it, or 0."""


class PolygonParts(NamedTuple):
    """The parts of a mesh, how well triangles cover its polygons, and the faces that are none."""

    parts: list[Part]
    coverage: Coverage
    too_small: int


@dataclass(frozen=True, eq=False)
class Cut:
    """The faces of one material, cut into T triangles over V vertices.

    Attributes:
        row: of the material, -1 for none.
        corner: (V,) a corner of the mesh that each vertex is.
        triangles: (T, 3) indices of vertices.
    """

    row: int
    corner: IntArray
    triangles: IntArray


class PolygonCuts(NamedTuple):
    """A mesh by materials, how well triangles cover its polygons, and the faces that are none."""

    cuts: list[Cut]
    coverage: Coverage
    too_small: int


def parts_of_polygons(mesh: PolygonMesh) -> PolygonParts:
    """One part for each material of a mesh; faces of less than three corners are left out."""
    found = cut_polygons(mesh)
    vertices = mesh.vertices
    if mesh.single:
        with np.errstate(over="ignore"):
            vertices = vertices.astype(np.float32).astype(np.float64)
    parts = []
    for cut in found.cuts:
        made_of = mesh.materials[cut.row] if cut.row >= 0 else None
        surface = surface_of(made_of, colored=mesh.colors is not None)
        part = _part(mesh, vertices, cut, surface)
        parts.append(part if made_of is None else replace(part, material=made_of.name))
    return PolygonParts(parts, found.coverage, found.too_small)


def cut_polygons(mesh: PolygonMesh) -> PolygonCuts:
    """Triangles of a mesh by materials, corners that share all they have as one vertex."""
    counts = np.diff(mesh.corner_start)
    triangles, covered = _triangles(mesh, np.flatnonzero(counts >= 3))
    material = np.full(mesh.count, -1, np.int64) if mesh.material is None else mesh.material
    cuts = []
    owner = material[triangles.face]
    rows, first = np.unique(owner, return_index=True)
    # The material that comes last is the first part: triangles keep the numbers they always had.
    for row in rows[np.argsort(-first, kind="stable")]:
        chosen = triangles.corners[_order(owner == row, counts[triangles.face])]
        corner, index = _shared(mesh, chosen.ravel())
        cuts.append(Cut(int(row), corner, index.reshape(-1, 3)))
    return PolygonCuts(cuts, covered, int(np.count_nonzero(counts < 3)))


def _triangles(mesh: PolygonMesh, faces: IntArray) -> tuple[Triangles, Coverage]:
    """Triangles of these faces; the second one of a quadrilateral begins at its third corner."""
    start, place = some_rows(mesh.corner_start, faces)
    points = np.zeros((len(place), 2))
    wide = np.flatnonzero(np.diff(start) > 3)
    with np.errstate(all="ignore"):  # vertices may be anywhere or nowhere
        if len(wide):
            part, own = some_rows(start, wide)
            points[own] = plane_coordinates(mesh.vertices[mesh.corners[place[own]]], part)
        cut = triangulate(points, start)
        covered = coverage(points, start, cut) if len(wide) else Coverage()
    corners = cut.corners.copy()
    first = start[cut.face]
    turned = (np.diff(start)[cut.face] == 4) & (corners[:, 0] == first) & (corners[:, 1] == first + 2)
    corners[turned] = np.roll(corners[turned], -1, axis=1)
    return Triangles(place[corners], faces[cut.face]), covered


def _order(chosen: BoolArray, counts: IntArray) -> IntArray:
    """The triangles of a part: as the faces come; where all are quadrilaterals, first halves first."""
    found = np.flatnonzero(chosen)
    if (counts[found] == 4).all():
        return np.concatenate((found[0::2], found[1::2]))
    return found


def _part(mesh: PolygonMesh, vertices: FloatArray, cut: Cut, surface: Surface) -> Part:
    corner = cut.corner
    normals = None if mesh.normals is None else mesh.normals[corner]
    if normals is not None and np.isnan(normals).all():
        normals = None
    return Part(
        vertices=vertices[mesh.corners[corner]],
        triangles=cut.triangles,
        normals=normals,
        colors=None if mesh.colors is None else mesh.colors[corner],
        surface=surface,
        uv=None if mesh.uv is None else mesh.uv[corner],
    )


def _shared(mesh: PolygonMesh, used: IntArray) -> tuple[IntArray, IntArray]:
    """One corner for every vertex of a part (V,), and the vertex of every used corner (3T,)."""
    vertex = mesh.corners[used]
    if mesh.variant is None:
        one_of = np.full(len(mesh.vertices), -1, np.int64)
        one_of[vertex] = used
        there = one_of >= 0
        return one_of[there], (np.cumsum(there) - 1)[vertex]
    variant = mesh.variant[used]
    if len(mesh.vertices) * (int(variant.max(initial=0)) + 1) > _KEY_LIMIT:
        variant = np.unique(variant, return_inverse=True)[1].reshape(-1)
    key = vertex * (variant.max(initial=0) + 1) + variant
    _, first, index = np.unique(key, return_index=True, return_inverse=True)
    return used[first], index.reshape(-1)


def surface_of(material: MeshMaterial | None, *, colored: bool) -> Surface:
    """The surface of a material; a mesh with colours of its own is white without one."""
    surface = Surface(color=(1.0, 1.0, 1.0)) if colored else Surface()
    if material is None:
        return surface
    keys: dict[str, Any] = {
        "color": material.color,
        "emission": material.emission,
        "roughness": material.roughness,
        "metallic": material.metallic,
    }
    if material.opacity is not None and material.opacity < 1:
        keys |= {"opacity": min(max(material.opacity, 0.0), 1.0), "alpha": "blend"}
    if material.shininess is not None and material.roughness is None:
        # Blinn's exponent to GGX's alpha, 2/(Ns + 2) = alpha², alpha = roughness².
        keys["roughness"] = (2 / (max(material.shininess, 0.0) + 2)) ** 0.25
    textures = tuple(_texture(material, texture) for texture in material.textures)
    # A picture multiplies what the file says, and is by itself where that says nothing.
    for texture in textures:
        if texture.role in _OF_PICTURES and not np.any(getattr(material, texture.role) or 0):
            keys[texture.role] = _OF_PICTURES[texture.role]
        if texture.role == "opacity":
            keys.setdefault("alpha", "blend")
    return surface.overridden({k: v for k, v in keys.items() if v is not None} | {"textures": textures})


def _texture(material: MeshMaterial, texture: MeshTexture) -> Texture:
    """A texture of an MTL file, whose coordinates have v up: u' = s·u + o."""
    (su, sv), (ou, ov) = texture.scale[:2], texture.offset[:2]
    wrap = "clamp" if texture.clamp else "repeat"
    use = f"material {material.name[:40]!r}, {texture.statement}" if material.name else texture.statement
    return Texture(
        role=texture.role,
        picture=Picture(str(texture.path)),
        matrix=(su, 0.0, ou, 0.0, sv, 1.0 - sv - ov),
        wrap=(wrap, wrap),
        strength=texture.strength,
        gain=texture.gain,
        channel=texture.channel if texture.channel in ("r", "g", "b") else "",
        use=use,
    )
