"""Files that others made, posed by their animations, against Filament; skipped where either is not.

`QUILT_GLTF_SAMPLES` names a folder with the round-trip tests of the glTF exporter of Blender, three files of
the tests of glTF-Transform, and TextureTransformTest of the Khronos samples; each in a folder of its name.
All are made unlit, opaque but for masks, seen from both sides and smoothly enlarged: compared is where
things are, how textures lie on them and what colour they have.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from quiltcli.scene import load_scene

filly = pytest.importorskip("filly", reason="Filament is not here (pip install -e '.[crosscheck]')")
from tests.system.test_filament import KEY, compare, filament, ours, theirs  # noqa: E402, F401

FOLDER = Path(os.environ.get("QUILT_GLTF_SAMPLES", "/nowhere"))
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="QUILT_GLTF_SAMPLES names no folder of files")
UNLIT, LINEAR, MIPMAPS = "KHR_materials_unlit", 9729, 9987
STILL = {
    "01_alpha_mask": {"fov": 6, "size": 400},
    "02_shared_mesh": {},
    "12_orm_two_uvmaps": {},
    "13_texture_wrapping": {},
    "22_vertex_color": {},
    "BoxVertexColors": {},
    "BoxMeshopt": {},
    "TextureTransformTest": {"fov": 10, "size": 300},
    "09_texture_transform": {"size": 400},
}
"""Files, and how near they are looked at for their textures to be enlarged."""
MOVING = {
    "01_cs_translate": 1,
    "01_cs_rotate": 1,
    "01_cs_scale": 1,
    "01_cs_morph": 1,
    "03_skinned_cylinder": 1,
    "03_all_animations": 3,
    "06_parent-inverse-anim": 5,
}
"""Files that move, and their animations."""
POSES = [(name, clip, frame) for name, clips in MOVING.items() for clip in range(clips) for frame in (1, 3)]


def found(name: str) -> Path:
    """The file of that name."""
    paths = [path for path in sorted(FOLDER.rglob(f"{name}.gl*")) if path.suffix in (".gltf", ".glb")]
    if not paths:
        pytest.skip(f"{name} is not in the folder of files")
    return paths[0]


def opened(path: Path) -> tuple[dict, bytes]:
    """A file's document, and what follows it in a GLB."""
    data = path.read_bytes()
    if path.suffix == ".gltf":
        return json.loads(data), b""
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[20 : 20 + length]), data[20 + length :]


def saved(path: Path, document: dict, rest: bytes) -> Path:
    text = json.dumps(document).encode()
    if path.suffix == ".gltf":
        path.write_bytes(text)
        return path
    text += b" " * (-len(text) % 4)
    head = struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    path.write_bytes(b"glTF" + head + text + rest)
    return path


def plain(name: str, folder: Path, clip: int | None = None) -> Path:
    """A copy of a file without anything that the two renderers light or filter each in its own way."""
    source = found(name)
    shutil.copytree(source.parent, folder / "file")
    path = folder / "file" / source.name
    path.chmod(0o644)
    document, rest = opened(path)
    materials = document.setdefault("materials", [])
    materials.append({})
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            primitive.setdefault("material", len(materials) - 1)
    for material in materials:
        material.setdefault("extensions", {})[UNLIT] = {}
        material["doubleSided"] = True
        if material.get("alphaMode") == "BLEND":
            material["alphaMode"] = "OPAQUE"
    for sampler in document.get("samplers", []):
        sampler |= {"magFilter": LINEAR, "minFilter": MIPMAPS}
    document["extensionsUsed"] = [*document.get("extensionsUsed", []), UNLIT]
    if clip is not None:
        document["animations"] = [document["animations"][clip]]
    return saved(path, document, rest)


def without_transforms(path: Path, folder: Path) -> Path:
    """A file with its base colour's transform worked into the texture coordinates.

    Filament turns pictures wrongly where their scale is not even. The transform is that of the extension's
    text: scale, a turn against the clock as one sees the picture, and the offset, v down.
    """
    shutil.copytree(path.parent, folder / "baked")
    path = folder / "baked" / path.name
    document, rest = opened(path)
    (material, *_) = document["materials"]
    base = material["pbrMetallicRoughness"]["baseColorTexture"]
    change = base.pop("extensions")["KHR_texture_transform"]
    material["pbrMetallicRoughness"] = {"baseColorTexture": base}
    for slot in ("normalTexture", "occlusionTexture", "emissiveTexture"):
        material.pop(slot, None)
    document["extensionsUsed"] = [UNLIT]
    document.pop("extensionsRequired", None)
    turn = change["rotation"]
    c, s = math.cos(turn), math.sin(turn)
    (wide, high), (right, down) = change["scale"], change["offset"]
    buffer = path.parent / document["buffers"][0]["uri"]
    buffer.chmod(0o644)
    data = bytearray(buffer.read_bytes())
    entries = {p["attributes"]["TEXCOORD_0"] for mesh in document["meshes"] for p in mesh["primitives"]}
    for entry in entries:
        accessor = document["accessors"][entry]
        start = document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        u, v = np.frombuffer(bytes(data), "<f4", 2 * accessor["count"], start).reshape(-1, 2).T
        new = np.stack((c * wide * u + s * high * v + right, -s * wide * u + c * high * v + down), axis=1)
        data[start : start + 8 * accessor["count"]] = new.astype("<f4").tobytes()
    buffer.write_bytes(data)
    return saved(path, document, rest)


def view_of(path: Path, grown: float = 1.0):
    """An eye that sees all of a file, and the middle of it."""
    scene = load_scene(path)
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    target = (low + high) / 2
    return target + np.linalg.norm(high - low) * grown * 1.3 * np.array([0.25, 0.3, 0.92]), target


@pytest.mark.parametrize("name", STILL)
def test_files_of_others_look_as_in_filament(tmp_path, filament, name):  # noqa: F811
    if name == "BoxMeshopt":
        pytest.importorskip("meshopt", reason="meshopt is not installed")
    path = plain(name, tmp_path)
    eye, target = view_of(path)
    linear = ours(f"file/{path.name}", eye, target, tmp_path, **STILL[name])
    same = without_transforms(path, tmp_path) if name == "09_texture_transform" else path
    compare(linear, theirs(filament, same, eye, target, behind=KEY, **STILL[name]))


@pytest.mark.parametrize(("name", "clip", "frame"), POSES)
def test_animated_poses_are_those_of_filament(tmp_path, filament, name, clip, frame):  # noqa: F811
    path = plain(name, tmp_path, clip)
    eye, target = view_of(path, 1.6)
    (tmp_path / "s.yaml").write_text(
        f"quilt_scene: 1\nobjects: [{{mesh: file/{path.name}, animation: {{}}}}]\n"
        "lights: [{type: ambient, color: [1, 1, 1]}]\n"
    )
    linear = ours("s.yaml", eye, target, tmp_path, frame=frame)
    other = theirs(filament, path, eye, target, seconds=frame / 10, behind=KEY)
    compare(linear, other)
    # Pixel for pixel: on an outline's own pixels one of the two may be a hair off.
    seen = np.abs(other - np.multiply(KEY, 255)).max(axis=-1) > 2
    assert np.count_nonzero(seen != (linear[..., 3] > 0)) <= 1
