"""Primitives: what corners are joined to, and what goes with them."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf import read_gltf
from tests.helpers.gltf_files import SQUARE, GltfFile, corners

ROW = [(x, y, 0.0) for x in range(3) for y in range(2)]


def areas(found) -> list[float]:
    """Signed areas seen from +Z."""
    return (np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2).tolist()


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(
    ("mode", "points", "count"),
    [(5, ROW, 4), (6, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 0, 0)], 3)],
)
def test_strips_and_fans_are_wound_one_way(tmp_path, indexed, mode, points, count):
    file = GltfFile()
    order = list(range(len(points))) if indexed else None
    file.node(mesh=file.mesh(file.primitive(points, order, mode=mode)))
    found = corners(file.write(tmp_path / "m.glb"))
    side = -0.5 if mode == 5 else 0.5
    assert areas(found) == [side] * count


def test_a_fan_starts_each_triangle_at_its_second_corner(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(SQUARE, None, mode=6)))
    assert corners(file.write(tmp_path / "m.glb"))[1].tolist() == [list(SQUARE[k]) for k in (2, 3, 0)]


def test_triangles_beside_a_fan_are_both_there(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(), file.primitive(SQUARE, None, mode=6)))
    path = file.write(tmp_path / "m.glb")
    assert len(corners(path)) == 4
    assert read_gltf(path).notices == ()


def test_points_and_lines_are_left_out_and_told(tmp_path):
    file = GltfFile()
    lines = [file.primitive(mode=mode) for mode in (0, 1, 2, 3)]
    file.node(mesh=file.mesh(file.primitive(), *lines))
    path = file.write(tmp_path / "m.glb")
    assert len(corners(path)) == 2
    assert read_gltf(path).notices == ("4 primitives of points or lines left out",)


def test_corners_left_over_are_told(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(SQUARE, [0, 1, 2, 3])))
    path = file.write(tmp_path / "m.glb")
    assert len(corners(path)) == 1
    assert read_gltf(path).notices == ("1 primitive with corners left over after the last triangle",)


def test_quantized_positions_and_texture_coordinates(tmp_path):
    file = GltfFile(extensionsRequired=["KHR_mesh_quantization"])
    position = file.accessor(np.array(SQUARE) * 32767, "i2", normalized=True)
    uv = file.accessor([(0, 0), (65535, 0), (65535, 13107), (0, 65535)], "u2", normalized=True)
    primitive = file.primitive()
    primitive["attributes"] = {"POSITION": position, "TEXCOORD_0": uv}
    file.node(mesh=file.mesh(primitive))
    path = file.write(tmp_path / "m.glb")
    assert corners(path).max(axis=(0, 1)).tolist() == [1, 1, 0]
    found = read_gltf(path).meshes[0][0].uv[0]
    assert found.tolist() == [[0, 0], [1, 0], [1, 0.2], [0, 1]]


def test_unsigned_bytes_of_positions_are_plain_numbers(tmp_path):
    file = GltfFile()
    position = file.accessor(np.array(SQUARE) * 200, "u1")
    primitive = file.primitive()
    primitive["attributes"] = {"POSITION": position}
    file.node(mesh=file.mesh(primitive))
    assert corners(file.write(tmp_path / "m.glb")).max() == 200


def test_both_sets_of_texture_coordinates_are_kept(tmp_path):
    file = GltfFile()
    sets = {f"TEXCOORD_{n}": file.accessor(np.array(SQUARE)[:, :2] * (n + 1)) for n in (0, 1)}
    file.node(mesh=file.mesh(file.primitive(attributes=sets)))
    first, second = read_gltf(file.write(tmp_path / "m.glb")).meshes[0][0].uv
    assert (first.max(), second.max()) == (1, 2)


def test_colours_are_exact_and_alpha_is_kept(tmp_path):
    file = GltfFile()
    color = file.accessor([(65535, 1, 0, 32768)] * 4, "u2", normalized=True)
    file.node(mesh=file.mesh(file.primitive(attributes={"COLOR_0": color})))
    found = read_gltf(file.write(tmp_path / "m.glb")).meshes[0][0].colors
    assert found[0].tolist() == np.array([1, 1 / 65535, 0, 32768 / 65535], np.float32).tolist()


def test_more_than_can_be_drawn_is_refused_before_it_is_built(tmp_path):
    file = GltfFile()
    square = file.primitive()
    many = file.mesh(*[square] * 500)
    for _ in range(3000):
        file.node(mesh=many)
    with pytest.raises(MeshError, match="nodes: show 1,500,000 pieces of meshes"):
        read_gltf(file.write(tmp_path / "m.glb"))
