"""Pick the reader for a mesh file by its suffix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.mesh.mesh import MeshBuilder, PolygonMesh
from quiltcli.formats.mesh.obj import read_obj
from quiltcli.formats.mesh.off import read_off
from quiltcli.formats.mesh.ply import read_ply

_TEXT = {".obj": read_obj, ".off": read_off}
_TRIANGLES = (".stl", ".glb", ".gltf")
SUFFIXES = (*_TEXT, ".ply", *_TRIANGLES)


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
    data = _bytes(path)
    builder = MeshBuilder(str(path))
    if suffix == ".ply":
        read_ply(data, builder)
    elif suffix in _TEXT:
        _TEXT[suffix](data.decode("utf-8", errors="replace"), builder)
    else:
        _read_triangles(path, builder)
    return builder.finish()


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


def _read_triangles(path: Path, builder: MeshBuilder) -> None:
    """STL and glTF through trimesh, which keeps the order of triangles when told not to process."""
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
        pieces = _baked(scene)
    except Exception as error:  # the readers behind it raise whatever they meet
        raise _error(path, f"cannot be read as {path.suffix[1:].upper()}: {error}") from error
    for vertices, triangles, uv in pieces:
        base = len(builder.vertices)
        builder.vertices.extend(vertices.tolist())
        builder.vertex_lines.extend([0] * len(vertices))
        for corners in triangles.tolist():
            pairs = None if uv is None else uv[corners].tolist()
            builder.add_face([base + corner for corner in corners], 0, pairs)


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
