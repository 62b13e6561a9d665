"""The polygon mesh record every reader fills, and what readers and users of it hold it to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.errors import MeshError, Problem, first_of, raise_all
from quiltcli.formats.mesh.mtl import MeshMaterial
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, segments

MOST_PROBLEMS = 50
FARTHEST = 1e30
"""Coordinates beyond this are no place: their products would leave float64."""


@dataclass(frozen=True)
class PolygonMesh:
    """V vertices and F polygons of C corners, in file order, in the file's own units.

    Attributes:
        vertices: (V, 3) float64 positions.
        corner_start: (F+1,) offsets into `corners`.
        corners: (C,) vertex index of every corner, 0-based, in the winding of the file.
        uv: (C, 2) texture coordinates of the corners, v up; NaN for a corner without any;
            None when no corner has one.
        names: F names, empty where the file gives none.
        lines: (F,) line of the file each face stands on, 0 where lines mean nothing.
        path: the file as the user named it, for messages.
        normals: (C, 3) normals of the corners as written, NaN without one; None when none has one.
        colors: (C, 3) linear colours of the corners, 1 without one; None when none has one.
        variant: (C,) what tells corners of one vertex apart: where two of them have equal numbers,
            everything else about them is equal too. None when it is so for all.
        material: (F,) row of `materials` each face is made of, -1 for none.
        materials: what the file's materials are, those that no file defines by name alone.
        missing: material files that are named but not there.
        vertex_lines: (V,) line each vertex stands on; None where lines mean nothing.
        single: whether the positions are declared as float32, whatever digits were written.
        flaws: what a display must not have and a scene can do without.
    """

    vertices: FloatArray
    corner_start: IntArray
    corners: IntArray
    uv: FloatArray | None
    names: tuple[str, ...]
    lines: IntArray
    path: str
    normals: FloatArray | None = None
    colors: Float32Array | None = None
    variant: IntArray | None = None
    material: IntArray | None = None
    materials: tuple[MeshMaterial, ...] = ()
    missing: tuple[str, ...] = ()
    vertex_lines: IntArray | None = None
    single: bool = False
    flaws: tuple[Problem, ...] = ()

    @property
    def count(self) -> int:
        """Number of faces, F."""
        return len(self.names)


def check_display_mesh(mesh: PolygonMesh) -> None:
    """Hold a mesh to what every display needs: faces of three corners or more at finite places.

    Raises:
        MeshError: with every problem found, up to `MOST_PROBLEMS`.
    """
    raise_problems(list(mesh.flaws) or _empty(mesh) or _few_corners(mesh) or _nowhere(mesh), mesh.path)


def _empty(mesh: PolygonMesh) -> list[Problem]:
    if mesh.count:
        return []
    if not len(mesh.vertices):
        return [Problem("the mesh is empty (expected vertices and faces)", mesh.path)]
    found = f"the mesh has {len(mesh.vertices)} vertices but no faces (expected one or more)"
    return [Problem(found, mesh.path)]


def _few_corners(mesh: PolygonMesh) -> list[Problem]:
    counts = np.diff(mesh.corner_start)
    return [
        Problem(
            f"face {face + 1} has {counts[face]} corners (expected 3 or more)",
            mesh.path,
            int(mesh.lines[face]),
        )
        for face in np.flatnonzero(counts < 3)
    ]


def _nowhere(mesh: PolygonMesh) -> list[Problem]:
    """Vertices of some face that are not finite or absurdly far away."""
    used = np.zeros(len(mesh.vertices), np.bool_)
    used[mesh.corners] = True
    near = (np.abs(mesh.vertices) <= FARTHEST).all(axis=1)  # false for NaN
    problems = []
    for index in np.flatnonzero(used & ~near):
        vertex = mesh.vertices[index]
        found = ", ".join(f"{c:g}" for c in vertex)
        expected = f"numbers up to {FARTHEST:g}" if np.isfinite(vertex).all() else "finite numbers"
        line = 0 if mesh.vertex_lines is None else int(mesh.vertex_lines[index])
        problems.append(Problem(f"vertex {index + 1} is ({found}) (expected {expected})", mesh.path, line))
    return problems


def strange_corners(
    outside: BoolArray, start: IntArray, written: Callable[[int], str], expected: str, lines: IntArray
) -> list[tuple[str, int]]:
    """Messages, with their lines, on corners (C,) that name vertices which are not there.

    Args:
        outside: (C,) whether a corner does.
        start: (F+1,) offsets of the faces' corners.
        written: what the file calls the vertex of a corner.
        expected: what it might have called it, as `1 to 6`.
        lines: (F,) lines of the faces.
    """
    if not outside.any():
        return []
    row, _ = segments(start)
    return [
        (f"face {row[k] + 1} names vertex {written(int(k))} (expected {expected})", int(lines[row[k]]))
        for k in np.flatnonzero(outside)
    ]


def raise_problems(problems: Sequence[Problem], path: str) -> None:
    """Raise a `MeshError` with the first `MOST_PROBLEMS` problems and the count of the rest."""
    raise_all(MeshError, first_of(problems, MOST_PROBLEMS, path))


def one_face_groups(group: IntArray, names: Sequence[str]) -> tuple[str, ...]:
    """Names of faces from the group (F,) each is in: only a group of one face names it."""
    # Groups of the same name are one group.
    number = {name: row for row, name in enumerate(dict.fromkeys(names))}
    merged = np.array([number[name] for name in names], np.int64)[group]
    size = np.bincount(merged, minlength=len(number))
    faces = [""] * len(group)
    listed = list(number)
    for face in np.flatnonzero(size[merged] == 1):
        faces[face] = listed[merged[face]]
    return tuple(faces)
