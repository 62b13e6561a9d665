"""Pick the reader for a mesh file by its suffix."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.mesh.mesh import PolygonMesh, check_display_mesh
from quiltcli.formats.mesh.obj import read_obj
from quiltcli.formats.mesh.off import read_off
from quiltcli.formats.mesh.ply import read_ply
from quiltcli.formats.mesh.stl import read_stl

READERS: Mapping[str, Callable[[bytes, Path], PolygonMesh]] = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
}
"""Our own readers, by suffix: of a file's bytes, and of its path for what it names beside it."""

SUFFIXES = (*READERS, ".glb", ".gltf")


def read_mesh(path: Path | str) -> PolygonMesh:
    """Read a display mesh, every face whole and in file order.

    OBJ, PLY and OFF keep polygons of any size. STL and glTF hold triangles; of glTF, primitives
    come in file order and instances of one primitive in the order of their transforms.

    Raises:
        MeshError: the file is missing, of an unknown kind, broken or empty. All problems at once.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise _error(path, f"unknown mesh format {path.suffix!r} (expected {', '.join(SUFFIXES)})")
    mesh = read_polygons(path) if suffix in READERS else _read_triangles(path)
    check_display_mesh(mesh)
    return mesh


def read_polygons(path: Path) -> PolygonMesh:
    """Read a file that one of `READERS` reads, whether or not a display could be made of it.

    Raises:
        MeshError: the file is missing or broken. All problems at once.
    """
    with np.errstate(all="ignore"):  # the numbers of a file may be anything
        return READERS[path.suffix.lower()](_bytes(path), path)


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise _error(path, "no such file (expected a mesh)") from None
    except IsADirectoryError:
        raise _error(path, "is a directory (expected a mesh file)") from None
    except OSError as error:
        raise _error(path, f"cannot be read: {error.strerror}") from None


def _error(path: Path, message: str) -> MeshError:
    return MeshError(Problem(message, str(path)))


def _read_triangles(path: Path) -> PolygonMesh:
    """GlTF through trimesh, which keeps the order of triangles when told not to process."""
    import trimesh

    _bytes(path)
    try:
        scene = trimesh.load_scene(path, process=False)
        pieces = _baked(scene)
    except Exception as error:  # the readers behind it raise whatever they meet
        raise _error(path, f"cannot be read as {path.suffix[1:].upper()}: {error}") from error
    base = np.cumsum([0, *(len(vertices) for vertices, _, _ in pieces)])
    corners = [triangles.ravel() + start for (_, triangles, _), start in zip(pieces, base, strict=False)]
    joined = np.concatenate([*corners, np.zeros(0, np.int64)]).astype(np.int64)
    count = len(joined) // 3
    return PolygonMesh(
        vertices=np.concatenate([*(vertices for vertices, _, _ in pieces), np.zeros((0, 3))]),
        corner_start=3 * np.arange(count + 1, dtype=np.int64),
        corners=joined,
        uv=_corner_uv(pieces),
        names=("",) * count,
        lines=np.zeros(count, np.int64),
        path=str(path),
    )


def _corner_uv(pieces: list[tuple[Any, Any, Any]]) -> Any:
    if all(uv is None for _, _, uv in pieces):
        return None
    return np.concatenate(
        [
            np.full((triangles.size, 2), np.nan) if uv is None else uv[triangles.ravel()]
            for _, triangles, uv in pieces
        ]
    )


def _baked(scene: Any) -> list[tuple[Any, Any, Any]]:
    """World-space (vertices, triangles, uv or None) of every instance, in an order of the file alone.

    Node names are no help: trimesh makes some of them up at random.
    """
    rank = {name: index for index, name in enumerate(scene.geometry)}
    instances = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        instances.append((rank[name], np.asarray(matrix, dtype=np.float64).tolist(), name))
    pieces = []
    for _, rows, name in sorted(instances):
        geometry, matrix = scene.geometry[name], np.array(rows)
        if not hasattr(geometry, "faces"):
            continue
        vertices = np.asarray(geometry.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        uv = getattr(geometry.visual, "uv", None)
        pieces.append((vertices, np.asarray(geometry.faces), None if uv is None else np.asarray(uv)))
    return pieces
