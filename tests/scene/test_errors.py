"""Scenes that cannot be loaded, each with its exact message."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import re

import pytest
import trimesh

from quiltcli.errors import JobError, SceneError
from quiltcli.scene import load_scene
from tests.scene.test_load import save

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face 2\nproperty list uchar int vertex_indices\nend_header\n"


def message(path, kind=SceneError):
    with pytest.raises(kind) as caught:
        load_scene(path)
    return str(caught.value).replace(f"{path.parent}/", "")


def written(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def exported(tmp_path, name, keep):
    """A sphere's file cut off after a share `keep` of its bytes."""
    path = tmp_path / name
    save(trimesh.creation.icosphere(1), path)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * keep)])
    return path


def test_missing(tmp_path):
    assert message(tmp_path / "gone.ply") == "gone.ply: no such file (expected a mesh)"


def test_directory(tmp_path):
    (tmp_path / "dir.obj").mkdir()
    assert message(tmp_path / "dir.obj") == "dir.obj: is a directory (expected a mesh file)"


@pytest.mark.parametrize("suffix", ["fbx", "blend", "max", "c4d", "FBX"])
def test_files_of_other_programs_say_what_to_do(tmp_path, suffix):
    found = message(written(tmp_path, f"car.{suffix}", b"\xe8\x00"))
    assert found == f"car.{suffix}: is a .{suffix.lower()} file, which is not read (export as GLB)"


def test_unknown_suffix(tmp_path):
    found = message(written(tmp_path, "car.xyz", "x"))
    assert (
        found
        == "car.xyz: unknown mesh format '.xyz' (expected .obj, .ply, .off, .stl, .gltf, .glb, .usd, .usda, .usdc, .usdz, .abc)"
    )


def test_no_suffix(tmp_path):
    found = message(written(tmp_path, "car", "x"))
    assert (
        found
        == "car: a mesh file without a suffix (expected .obj, .ply, .off, .stl, .gltf, .glb, .usd, .usda, .usdc, .usdz, .abc)"
    )


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "stl", "glb", "gltf"])
def test_empty(tmp_path, suffix):
    found = message(written(tmp_path, f"m.{suffix}", ""))
    assert found == f"m.{suffix}: the file is empty (expected a mesh)"


def test_cut_off_binary_stl(tmp_path):
    found = message(exported(tmp_path, "m.stl", 0.6))
    assert found == "m.stl: truncated: 80 triangles need 4084 bytes, 2450 are there"


def test_cut_off_glb(tmp_path):
    found = message(exported(tmp_path, "m.glb", 0.6))
    words = r"cannot be read as GLB: the file is damaged or incomplete \([\d,]+ of [\d,]+ bytes\)"
    assert re.fullmatch(f"m.glb: {words}", found)


def test_cut_off_gltf(tmp_path):
    found = message(exported(tmp_path, "m.gltf", 0.6))
    assert re.fullmatch(r"m.gltf:1:\d+: is not JSON: .*", found)


def test_cut_off_text_ply(tmp_path):
    path = written(tmp_path, "m.ply", PLY + FACES + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    assert message(path) == "m.ply: the file ends after 1 of 2 rows of face"


def test_cut_off_binary_ply(tmp_path):
    found = message(exported(tmp_path, "m.ply", 0.6))
    assert found == "m.ply: truncated: row 26 of 80 of face runs past the end, byte 1054"


def test_cut_off_off(tmp_path):
    assert (
        message(written(tmp_path, "m.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"))
        == "m.off: the file ends after 1 of 2 faces"
    )


def test_garbage(tmp_path):
    assert message(written(tmp_path, "m.obj", "hello\n")) == "m.obj: holds no triangles"
    assert message(written(tmp_path, "m.ply", "hello\n")) == "m.ply:1: found 'hello' (expected ply)"


def test_points_only(tmp_path):
    assert message(written(tmp_path, "m.obj", "v 0 0 0\n")) == "m.obj: holds no triangles"


def test_index_out_of_range(tmp_path):
    assert (
        message(written(tmp_path, "m.obj", TRIANGLE + "f 1 2 9\n"))
        == "m.obj:5: face 2 names vertex 9 (expected 1 to 3)"
    )


def test_a_vertex_of_two_coordinates(tmp_path):
    found = message(written(tmp_path, "m.obj", TRIANGLE.replace("v 1 0 0", "v 1 0")))
    assert found == "m.obj:2: vertex with 2 coordinates (expected x y z)"


def test_every_triangle_is_a_line(tmp_path):
    path = written(tmp_path, "m.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    assert message(path) == "m.obj: every triangle is without area or not finite"


def test_gltf_without_its_buffer(tmp_path):
    save(trimesh.creation.box(), tmp_path / "m.gltf")
    for buffer in tmp_path.glob("*.bin"):
        buffer.unlink()
    found = message(tmp_path / "m.gltf")
    assert re.fullmatch(r"m.gltf: buffers\[(.)\].uri: 'gltf_buffer_\1.bin' is missing beside it", found)


def test_a_scene_file_reports_every_bad_mesh_with_its_line(tmp_path):
    written(tmp_path, "points.obj", "v 0 0 0\n")
    written(tmp_path, "cut.stl", b"\0" * 90)
    written(tmp_path, "good.obj", TRIANGLE)
    text = (
        "quilt_scene: 1\nobjects:\n- mesh: points.obj\n- mesh: good.obj\n"
        "- name: tail\n  mesh: cut.stl\n"
    )  # fmt: skip
    assert message(written(tmp_path, "scene.yaml", text)) == (
        "scene.yaml:3:9: objects[0].mesh: points.obj: holds no triangles\n"
        "scene.yaml:6:9: objects[2].mesh: cut.stl: holds no triangles"
    )


def test_a_scene_file_that_flattens_a_mesh(tmp_path):
    written(tmp_path, "a.obj", TRIANGLE)
    text = "quilt_scene: 1\nobjects:\n- {mesh: a.obj, transform: {scale: 1.0e-200}}\n"
    assert message(written(tmp_path, "scene.yaml", text)) == (
        "scene.yaml:3:10: objects[0].mesh: a.obj: every triangle is without area or not finite"
    )


def test_a_scene_file_that_is_wrong_itself(tmp_path):
    path = written(tmp_path, "scene.yaml", "quilt_scene: 1\nobjects:\n- mesh: gone.obj\n")
    assert message(path, JobError) == "scene.yaml:3:9: objects[0].mesh: no such file: gone.obj"
