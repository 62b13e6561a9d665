"""Pick the reader for a mesh file by its suffix."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.inputs import foreign_fault, read_input
from quiltcli.formats.mesh.gltf import read_gltf_mesh
from quiltcli.formats.mesh.mesh import PolygonMesh, check_display_mesh
from quiltcli.formats.mesh.obj import read_obj
from quiltcli.formats.mesh.off import read_off
from quiltcli.formats.mesh.ply import read_ply
from quiltcli.formats.mesh.stl import read_stl
from quiltcli.formats.mesh.usd import read_usd_mesh
from quiltcli.formats.usd import SUFFIXES as USD_SUFFIXES

READERS: Mapping[str, Callable[[bytes, Path], PolygonMesh]] = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
}
"""Our own readers, by suffix: of a file's bytes, and of its path for what it names beside it."""

MODELS: Mapping[str, Callable[[Path], PolygonMesh]] = {
    **dict.fromkeys((".glb", ".gltf"), read_gltf_mesh),
    **dict.fromkeys(USD_SUFFIXES, read_usd_mesh),
}
"""Readers of scenes, whose faces a display can be made of."""

SUFFIXES = (*READERS, *MODELS)


def read_mesh(path: Path | str) -> PolygonMesh:
    """Read a display mesh, every face whole and in file order.

    OBJ, PLY, OFF and USD keep polygons of any size. STL and glTF hold triangles; of glTF, primitives
    come in file order and instances of one primitive in the order of their transforms.

    Raises:
        MeshError: the file is missing, of an unknown kind, broken or empty. All problems at once.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if fault := foreign_fault(path):
        raise _error(path, fault)
    if suffix not in SUFFIXES:
        raise _error(path, f"unknown mesh format {path.suffix!r} (expected {', '.join(SUFFIXES)})")
    mesh = read_polygons(path) if suffix in READERS else MODELS[suffix](path)
    check_display_mesh(mesh)
    return mesh


def read_polygons(path: Path) -> PolygonMesh:
    """Read a file that one of `READERS` reads, whether or not a display could be made of it.

    Raises:
        MeshError: the file is missing or broken. All problems at once.
    """
    with np.errstate(all="ignore"):  # the numbers of a file may be anything
        return READERS[path.suffix.lower()](read_input(path, MeshError, "a mesh"), path)


def _error(path: Path, message: str) -> MeshError:
    return MeshError(Problem(message, str(path)))
