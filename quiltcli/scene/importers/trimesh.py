"""What trimesh reads, as parts: the one place that knows its ways.

Colours: glTF factors and vertex colours and OBJ's Kd are linear. Vertex and face colours of PLY,
OBJ and OFF are sRGB, as the programs that write them mean them.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene.importers.part import Part, placed
from quiltcli.scene.materials import Surface

_TEXTURES = (
    "baseColorTexture",
    "metallicRoughnessTexture",
    "normalTexture",
    "occlusionTexture",
    "emissiveTexture",
)
_MTL = (("color", "kd"), ("emission", "ke"))


@contextmanager
def quiet() -> Iterator[None]:
    """Keep a reader's own log and warnings from the user."""
    log = logging.getLogger("trimesh")
    before = log.disabled
    log.disabled = True
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = before


def trimesh_scene(path: Path, asked: list[str], missing: list[str]) -> Any:
    """The file as a `trimesh.Scene`, noting which other files it asks for."""
    import trimesh

    class Resolver(trimesh.resolvers.FilePathResolver):  # type: ignore[misc]  # trimesh has no types
        def get(self, name: str) -> bytes:
            asked.append(name.strip())
            try:
                return bytes(super().get(name))
            except Exception:
                missing.append(name.strip())
                raise

    with path.open("rb") as file:
        suffix = path.suffix[1:].lower()
        return trimesh.load_scene(file, file_type=suffix, resolver=Resolver(str(path)), process=False)


def parts_of(scene: Any, suffix: str) -> list[Part]:
    """Every instance of every mesh, in an order that does not depend on the names of nodes.

    trimesh adds a random suffix to nodes of meshes with several primitives.
    """
    places: dict[str, list[FloatArray]] = {}
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        places.setdefault(name, []).append(np.array(matrix, dtype=np.float64))
    parts = []
    for name, mesh in scene.geometry.items():
        if getattr(mesh, "faces", None) is None:
            continue
        part = _mesh_part(mesh, suffix)
        matrices = sorted(places.get(name, ()), key=lambda matrix: tuple(matrix.flat))
        parts += [placed(part, matrix) for matrix in matrices]
    return parts


def _mesh_part(mesh: Any, suffix: str) -> Part:
    vertices, triangles = _plain(mesh.vertices), _plain(mesh.faces, np.int64)
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(vertices)):
        raise ValueError("a face names a vertex that is not there")
    given = mesh._cache.cache.get("vertex_normals")
    normals = None if given is None else _plain(given)
    visual = mesh.visual
    colors = None
    if visual.kind == "face":
        corner = triangles.ravel()
        colors = _linear_colors(np.repeat(_plain(visual.face_colors, np.uint8), 3, axis=0), suffix)
        vertices, normals = vertices[corner], None if normals is None else normals[corner]
        triangles = np.arange(corner.size).reshape(-1, 3)
    elif visual.kind == "vertex":
        colors = _linear_colors(_plain(visual.vertex_colors, np.uint8), suffix)
    elif visual.kind == "texture" and "color" in visual.vertex_attributes:
        colors = _attribute_colors(np.asarray(visual.vertex_attributes["color"]))
    return Part(vertices, triangles, normals, colors, _surface(visual, colors is not None))


def _plain(array: Any, dtype: Any = np.float64) -> Any:
    """An ordinary array: trimesh's own class checks itself for changes at every use."""
    return np.array(array, dtype=dtype, subok=False)


def _linear_colors(colors: Any, suffix: str) -> Float32Array:
    """Linear colours (V, 3) from bytes (V, 4)."""
    value = np.arange(256) / 255
    if suffix not in (".gltf", ".glb"):
        # The transfer function of sRGB (IEC 61966-2-1).
        value = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    result: Float32Array = value.astype(np.float32)[colors[:, :3]]
    return result


def _attribute_colors(colors: Any) -> Float32Array:
    """Colours of a glTF attribute, stored as floats or as integers that span 0 to 1."""
    scale = np.iinfo(colors.dtype).max if np.issubdtype(colors.dtype, np.integer) else 1
    result: Float32Array = (colors[:, :3] / scale).astype(np.float32)
    return result


def _surface(visual: Any, colored: bool) -> Surface:
    """The surface of a mesh's material: PBR of glTF, or Kd, Ke and Ns of OBJ."""
    material: Any = getattr(visual, "material", None)
    if hasattr(material, "baseColorFactor"):
        factor, emission = material.baseColorFactor, material.emissiveFactor
        return Surface(
            color=(1.0, 1.0, 1.0) if factor is None else _triple(np.asarray(factor) / 255),
            metallic=1.0 if material.metallicFactor is None else float(material.metallicFactor),
            roughness=1.0 if material.roughnessFactor is None else float(material.roughnessFactor),
            emission=(0.0, 0.0, 0.0) if emission is None else _triple(emission),
        )
    surface = Surface(color=(1.0, 1.0, 1.0)) if colored else Surface()
    given = getattr(material, "kwargs", {})
    keys: dict[str, Any] = {key: _triple(given[mtl]) for key, mtl in _MTL if len(given.get(mtl, ())) == 3}
    if "ns" in given:
        # Blinn's exponent to GGX's alpha, 2/(Ns + 2) = alpha², alpha = roughness².
        keys["roughness"] = (2 / (max(float(given["ns"]), 0.0) + 2)) ** 0.25
    return surface.overridden(keys)


def _triple(values: Any) -> tuple[float, float, float]:
    red, green, blue = (float(v) for v in values[:3])
    return red, green, blue


def texture_count(scene: Any, asked: list[str]) -> int:
    """Number of images the materials use, those of OBJ counted by the files asked for."""
    images = set()
    for mesh in scene.geometry.values():
        material = getattr(getattr(mesh, "visual", None), "material", None)
        images |= {id(image) for key in _TEXTURES if (image := getattr(material, key, None)) is not None}
    files = {name for name in asked if not name.lower().endswith((".mtl", ".bin"))}
    return max(len(images), len(files))
