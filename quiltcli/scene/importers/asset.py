"""Scene meshes as the files give them: parts with their own surfaces, before any shading decision."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem, SceneError
from quiltcli.formats.mesh import read_mesh
from quiltcli.geometry import segments
from quiltcli.scene.importers.part import Part
from quiltcli.scene.importers.trimesh import parts_of, quiet, texture_count, trimesh_scene
from quiltcli.scene.materials import Surface

SUFFIXES = (".obj", ".ply", ".off", ".stl", ".gltf", ".glb")
_POLYGONS = (".obj", ".ply", ".off")
_FACE_COUNT = {
    ".ply": re.compile(rb"element\s+face\s+(\d+)"),
    ".off": re.compile(rb"OFF\s+(?:#[^\n]*\s+)*\d+\s+(\d+)"),
}


@dataclass(frozen=True)
class Asset:
    """The parts of a mesh file, the textures it wants, and the files it names that are not there."""

    parts: tuple[Part, ...]
    textures: int
    missing: tuple[str, ...]


def read_asset(path: Path) -> Asset:
    """Read a scene mesh.

    Raises:
        SceneError: the file is missing, of an unknown kind, damaged, or holds no triangles.
    """
    _check_file(path)
    asked: list[str] = []
    missing: list[str] = []
    try:
        with quiet():
            scene = trimesh_scene(path, asked, missing)
            parts = parts_of(scene, path.suffix.lower())
            textures = texture_count(scene, asked)
        if any(part.vertices.shape[1:] != (3,) for part in parts):
            raise ValueError("vertices without three coordinates")  # noqa: TRY301 - as if the reader had said so
    except Exception as error:  # whatever the reader meets in a damaged file
        if path.suffix.lower() not in _POLYGONS:
            raise _damaged(path, missing) from error
        parts, textures = [_polygon_part(path)], 0
    if sum(len(part.triangles) for part in parts) < _promised_faces(path):
        parts = [_polygon_part(path)]
    if not any(len(part.triangles) for part in parts):
        raise SceneError(Problem("holds no triangles", str(path)))
    return Asset(tuple(parts), textures, tuple(n for n in missing if n.lower().endswith(".mtl")))


def _check_file(path: Path) -> None:
    suffix = path.suffix.lower()
    if path.is_dir():
        raise SceneError(Problem("is a directory (expected a mesh file)", str(path)))
    if suffix not in SUFFIXES:
        found = f"unknown mesh format {path.suffix!r}" if suffix else "a mesh file without a suffix"
        raise SceneError(Problem(f"{found} (expected {', '.join(SUFFIXES)})", str(path)))
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except FileNotFoundError:
        raise SceneError(Problem("no such file (expected a mesh)", str(path))) from None
    except OSError as error:
        raise SceneError(Problem(f"cannot be read: {error.strerror}", str(path))) from None
    if empty:
        raise SceneError(Problem("the file is empty (expected a mesh)", str(path)))


def _damaged(path: Path, missing: list[str]) -> SceneError:
    kind = path.suffix[1:].upper()
    # trimesh looks for another glTF file when it cannot make sense of this one.
    buffers = [name for name in missing if not name.endswith(".gltf")]
    reason = f"{buffers[0]!r} is missing beside it" if buffers else "the file is damaged or incomplete"
    return SceneError(Problem(f"cannot be read as {kind}: {reason}", str(path)))


def _promised_faces(path: Path) -> int:
    """Number of faces the header of a PLY or OFF file announces, 0 for other files."""
    pattern = _FACE_COUNT.get(path.suffix.lower())
    if pattern is None:
        return 0
    with path.open("rb") as file:
        found = pattern.search(file.read(65536))
    return int(found[1]) if found else 0


def _polygon_part(path: Path) -> Part:
    """The file by the strict reader of polygons: it takes what trimesh cannot, and says what is wrong."""
    try:
        mesh = read_mesh(path)
    except MeshError as error:
        raise SceneError(error.problems) from error
    row, rank = segments(mesh.corner_start)
    third = np.flatnonzero(rank >= 2)
    fan = (mesh.corner_start[row[third]], third - 1, third)
    return Part(mesh.vertices, np.stack([mesh.corners[k] for k in fan], axis=1), None, None, Surface())
