"""Scene meshes as the files give them: parts with their own surfaces, before any shading decision."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from quiltcli.errors import MeshError, Problem, SceneError
from quiltcli.formats.alembic import SUFFIXES as ALEMBIC_SUFFIXES
from quiltcli.formats.inputs import foreign_fault, open_input
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.mesh.coverage import NOTHING, Coverage
from quiltcli.formats.mesh.read import READERS, read_polygons
from quiltcli.formats.usd import SUFFIXES as USD_SUFFIXES
from quiltcli.scene.importers.alembic import read_alembic_model
from quiltcli.scene.importers.gltf import read_gltf_model
from quiltcli.scene.importers.model import NO_SUBDIVISION, Model
from quiltcli.scene.importers.part import Part
from quiltcli.scene.importers.polygons import parts_of_polygons
from quiltcli.scene.importers.usd import read_usd_model

MODELS: Mapping[str, Callable[[Path], Model]] = {
    ".gltf": read_gltf_model,
    ".glb": read_gltf_model,
    **dict.fromkeys(USD_SUFFIXES, read_usd_model),
    **dict.fromkeys(ALEMBIC_SUFFIXES, read_alembic_model),
}
"""Readers of scenes that may move, by suffix."""

SUFFIXES = (".obj", ".ply", ".off", ".stl", *MODELS)


@dataclass(frozen=True)
class Asset:
    """What a mesh file brings to a scene.

    Attributes:
        parts: its parts, at rest.
        missing: material files it names that are not there.
        notices: what else was dropped or assumed, without a name before it.
        coverage: how the areas of its polygons compare with those of their triangles.
        model: what can be posed at other times, for a file with nodes and animations.
    """

    parts: tuple[Part, ...]
    missing: tuple[str, ...]
    notices: tuple[str, ...] = ()
    coverage: Coverage = NOTHING
    model: Model | None = None


def read_asset(path: Path, subdivision: int = 0) -> Asset:
    """Read a scene mesh.

    Args:
        path: its file.
        subdivision: how many times its subdivision surfaces are refined.

    Raises:
        SceneError: the file is missing, of an unknown kind, damaged, or holds no triangles, or there are no
            subdivision surfaces that could be refined.
    """
    _check_file(path)
    if path.suffix.lower() not in READERS:
        asset = _model_asset(path, subdivision)
    elif subdivision:
        raise SceneError(Problem(NO_SUBDIVISION, str(path)))
    else:
        asset = _polygon_asset(path)
    if not any(len(part.triangles) for part in asset.parts):
        raise SceneError(Problem("holds no triangles", str(path)))
    return asset


def _polygon_asset(path: Path) -> Asset:
    try:
        mesh = read_polygons(path)
    except MeshError as error:
        raise SceneError(error.problems) from error
    found = parts_of_polygons(mesh)
    notices = []
    if found.too_small:
        notices.append(f"{_faces(found.too_small)} of fewer than 3 corners dropped")
    if found.coverage.crossing:
        notices.append(
            f"{_faces(found.coverage.crossing)} whose outline crosses itself, which no triangles can cover"
            f"{_place(mesh, found.coverage.first)}"
        )
    return Asset(tuple(found.parts), mesh.missing, tuple(notices), found.coverage)


def _faces(count: int) -> str:
    return f"{count} face" if count == 1 else f"{count} faces"


def _place(mesh: PolygonMesh, face: int) -> str:
    line = int(mesh.lines[face])
    return f" (face {face + 1}, line {line})" if line else f" (face {face + 1})"


def _model_asset(path: Path, subdivision: int) -> Asset:
    try:
        model = MODELS[path.suffix.lower()](path)
        if subdivision:
            model = model.subdivided(subdivision)
        parts = model.parts()
    except MeshError as error:
        raise SceneError(error.problems) from error
    if not any(len(part.triangles) for part in parts):
        left_out = "".join(f"; {notice}" for notice in model.notices)
        raise SceneError(Problem(f"holds no triangles{left_out}", str(path)))
    return Asset(parts, (), model.notices, model=model)


def _check_file(path: Path) -> None:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        if fault := foreign_fault(path):
            raise SceneError(Problem(fault, str(path)))
        found = f"unknown mesh format {path.suffix!r}" if suffix else "a mesh file without a suffix"
        raise SceneError(Problem(f"{found} (expected {', '.join(SUFFIXES)})", str(path)))
    with open_input(path, SceneError, "a mesh") as file:
        empty = not file.read(1)
    if empty:
        raise SceneError(Problem("the file is empty (expected a mesh)", str(path)))
