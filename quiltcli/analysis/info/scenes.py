"""What a scene is: its objects, materials and lights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.displays import areas, polygon_counts, polygons_text
from quiltcli.analysis.info.record import Info, bounds, bounds_text, counted, number, vector
from quiltcli.errors import MeshError
from quiltcli.formats.mesh import read_mesh
from quiltcli.job import ObjectSpec, load_scene_file
from quiltcli.job.frames import format_frames
from quiltcli.scene import Light, Scene, load_scene
from quiltcli.scene.lights import KINDS
from quiltcli.scene.textures.picture import Picture
from quiltcli.scene.textures.pool import ROLES

_LISTED = 6


def scene_info(path: Path) -> Info:
    """Objects, triangles, materials and lights of a scene file.

    Raises:
        JobError, SceneError: the scene cannot be loaded.
    """
    spec = load_scene_file(path)
    scene = load_scene(spec)
    moves = {
        name: how for name, item in zip(scene.objects, spec.objects, strict=True) if (how := _motion(item))
    }
    lines = [("moves", f"{name}: {how}") for name, how in moves.items()]
    return _info("scene", path, scene, {"moves": moves}, lines)


def _motion(item: ObjectSpec) -> str:
    """How an object moves, empty where it does not."""
    found = []
    if item.transform is not None and item.transform.keyframes is not None and item.transform.moves:
        frames = [key.frame for key in item.transform.keyframes]
        found.append(f"{counted(len(frames), 'keyframe')}, frames {min(frames)} to {max(frames)}")
    if item.animation is not None:
        clip = item.animation.clip
        what = "all animations" if clip == "all" else repr(clip) if isinstance(clip, str) else str(list(clip))
        found.append(f"{what} of the file, from frame {item.animation.start_frame}")
    if item.frames is not None:
        found.append(f"{counted(len(item.frames), 'numbered file')}, frames {format_frames(item.frames)}")
    return "; ".join(found)


def mesh_info(path: Path) -> Info:
    """A mesh file as a scene of its own and, where its polygons can be read, as a display's mesh.

    Raises:
        SceneError: the file cannot be loaded.
    """
    scene = load_scene(path)
    try:
        mesh = read_mesh(path)
    except MeshError:  # fit to be seen, but not to be a display
        return _info("mesh", path, scene, {"polygons": None, "texture_coordinates": None}, [])
    area = areas(mesh.vertices[mesh.corners], mesh.corner_start).sum()
    data: dict[str, Any] = {
        "polygons": polygon_counts(mesh.corner_start),
        "area": float(area),
        "texture_coordinates": mesh.uv is not None,
    }
    lines = [
        ("polygons", polygons_text(data["polygons"])),
        ("area", f"{number(float(area))} square units of the file"),
        ("texture coordinates", "yes" if mesh.uv is not None else "no"),
    ]
    return _info("mesh", path, scene, data, lines)


def _info(kind: str, path: Path, scene: Scene, more: dict[str, Any], lines: list[tuple[str, str]]) -> Info:
    objects = _objects(scene)
    lights = _light_counts(scene.lights)
    textures = _textures(scene)
    data = {
        "path": str(path),
        **more,
        "triangles": len(scene.triangles),
        "vertices": len(scene.vertices),
        "bounds": bounds(scene.vertices),
        "materials": len(scene.materials.color),
        "textures": textures,
        "lights": lights,
        "background": [float(c) for c in scene.background],
        "notices": list(scene.notices),
        "objects": objects,
    }
    shown = [counted(n, f"{name} light") for name, n in lights.items() if n and name != "headlight"]
    lines = [
        *lines,
        ("objects", f"{len(objects):,}"),
        ("triangles", f"{len(scene.triangles):,}"),
        ("vertices", f"{len(scene.vertices):,}"),
        ("bounds", bounds_text(data["bounds"])),
        ("materials", f"{len(scene.materials.color):,}"),
        *((("textures", _textures_text(textures)),) if textures else ()),
        ("lights", ", ".join(shown + ["a headlight"] * lights["headlight"])),
        ("background", vector(data["background"])),
        *(("note", notice) for notice in scene.notices),
    ]
    columns = ("object", "name", "triangles", "from", "to")
    return Info(kind, data, lines, columns, [_row(i, entry) for i, entry in enumerate(objects, 1)])


def _textures(scene: Scene) -> list[dict[str, Any]]:
    """The pictures that are drawn: what each is, where it is from and what it varies."""
    found: dict[Picture, tuple[str, set[str]]] = {}
    for textures in scene.materials.textures:
        for texture in textures:
            if texture.role in ROLES:
                found.setdefault(texture.picture, (texture.use, set()))[1].add(texture.role)
    result = []
    for picture, (use, roles) in found.items():
        size = picture.size(use)
        varies = [role for role in ROLES if role in roles]
        result.append({"name": picture.name, "width": size.width, "height": size.height, "varies": varies})
    return result


def _textures_text(textures: Sequence[dict[str, Any]]) -> str:
    sizes = [f"{entry['width']:,} × {entry['height']:,} ({', '.join(entry['varies'])})" for entry in textures]
    more = f" and {len(sizes) - _LISTED} more" if len(sizes) > _LISTED else ""
    return f"{len(sizes):,}: {'; '.join(sizes[:_LISTED])}{more}"


def _objects(scene: Scene) -> list[dict[str, Any]]:
    """Name, triangle count and bounds of every object; triangles of an object lie together."""
    ends = np.searchsorted(scene.object, np.arange(len(scene.objects) + 1))
    return [
        {
            "name": name,
            "triangles": int(ends[i + 1] - ends[i]),
            "bounds": bounds(scene.vertices[scene.triangles[ends[i] : ends[i + 1]].ravel()]),
        }
        for i, name in enumerate(scene.objects)
    ]


def _row(number_: int, entry: dict[str, Any]) -> list[str]:
    box = entry["bounds"]
    return [str(number_), entry["name"], f"{entry['triangles']:,}", vector(box["min"]), vector(box["max"])]


def _light_counts(lights: Sequence[Light]) -> dict[str, int]:
    """How many lights of each kind; headlight last."""
    return {kind.kind: sum(type(light) is kind for light in lights) for kind in KINDS}
