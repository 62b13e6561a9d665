"""Polygon meshes of scenes that move: cut into triangles once, placed and dressed at every time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from quiltcli.errors import counted
from quiltcli.formats.corners import Dress, Faces
from quiltcli.formats.gltf.posing import Placed, carried, copied_triangles
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.scene.importers.part import Part
from quiltcli.scene.importers.polygons import Cut, cut_polygons
from quiltcli.scene.materials import Surface

MOST_TRIANGLES = 2**26


@dataclass(frozen=True, eq=False)
class Form:
    """A mesh cut into triangles, as long as its faces stay the same.

    Attributes:
        faces: the faces.
        dress: what their corners carry.
        cuts: triangles by materials.
        flaws: what of the mesh cannot be drawn.
        refining: (V', V) its vertices from those of the file, where it is subdivided.
    """

    faces: Faces
    dress: Dress
    cuts: tuple[Cut, ...]
    flaws: tuple[str, ...]
    refining: csr_matrix | None = None

    @property
    def vertices(self) -> int:
        """How many the file has."""
        return self.faces.corners.vertices if self.refining is None else int(self.refining.shape[1])

    @property
    def triangles(self) -> int:
        """How many there are."""
        return sum(len(cut.triangles) for cut in self.cuts)


@dataclass(frozen=True, eq=False)
class Posed:
    """A mesh at a time.

    Attributes:
        points: (V, 3).
        normals: (C, 3) of the corners, or None.
    """

    points: FloatArray
    normals: FloatArray | None


@dataclass(frozen=True)
class Look:
    """What the triangles of a cut are made of.

    Attributes:
        surface: the surface.
        name: of its material, or empty.
        worn: whether the mesh's colours count.
        faint: whether its opacities do.
    """

    surface: Surface
    name: str = ""
    worn: bool = True
    faint: bool = True


def form_of(path: str, faces: Faces, dress: Dress, points: FloatArray, materials: IntArray) -> Form:
    """Cut a mesh into triangles.

    Args:
        path: its file.
        faces: its faces.
        dress: what their corners carry.
        points: (V, 3) where it is flat is judged by these.
        materials: (F,) rows of materials, not below 0.
    """
    polygons = PolygonMesh(
        vertices=points,
        corner_start=faces.start,
        corners=faces.corners.vertex,
        uv=None,
        names=("",) * len(faces.number),
        lines=np.zeros(len(faces.number), dtype=np.int64),
        path=path,
        variant=dress.variant,
        material=materials,
    )
    found = cut_polygons(polygons)
    flaws = []
    if found.too_small:
        flaws.append(f"{counted(found.too_small, 'face')} of fewer than 3 corners dropped")
    if found.coverage.crossing:
        count = counted(found.coverage.crossing, "face")
        flaws.append(f"{count} whose outline crosses itself, which no triangles can cover")
    return Form(faces, dress, tuple(found.cuts), tuple(flaws))


def placed_cut(form: Form, cut: Cut, posed: Posed, places: FloatArray) -> Placed:
    """The vertices of a cut in all its places (C, 4, 4)."""
    points = posed.points[form.faces.corners.vertex[cut.corner]]
    return carried(points, None if posed.normals is None else posed.normals[cut.corner], places)


def part_of(form: Form, cut: Cut, posed: Posed, places: FloatArray, look: Look) -> Part:
    """The triangles of a cut in all its places (C, 4, 4)."""
    there = placed_cut(form, cut, posed, places)
    copies, corner, dress = len(places), cut.corner, form.dress
    uv, uv1 = (None if one is None else np.tile(one.at_corners[corner], (copies, 1)) for one in dress.uv)
    colors = opacities = None
    if dress.color is not None and look.worn:
        colors = np.tile(dress.color.at_corners[corner], (copies, 1)).astype(np.float32)
    if dress.opacity is not None and look.faint and (dress.opacity.values < 1).any():
        opacities = np.tile(dress.opacity.at_corners[corner, 0], copies).astype(np.float32)
    return Part(
        vertices=there.vertices,
        triangles=copied_triangles(cut.triangles, len(corner), there.mirrored),
        normals=there.normals,
        colors=colors,
        surface=look.surface,
        uv=uv,
        uv1=uv1,
        material=look.name,
        opacities=opacities,
    )


def joined(placed: list[Placed]) -> tuple[FloatArray, FloatArray]:
    """Vertices and normals (V, 3) of all after one another; zero for normals that are not there."""
    nothing = np.empty((0, 3))
    normals = [np.zeros_like(one.vertices) if one.normals is None else one.normals for one in placed]
    return np.concatenate([nothing, *(one.vertices for one in placed)]), np.concatenate([nothing, *normals])


def at_one_place(vertices: FloatArray) -> FloatArray:
    """As many vertices (V, 3), all where the first is: a mesh that is not seen for a while."""
    return np.repeat(vertices[:1], len(vertices), axis=0)
