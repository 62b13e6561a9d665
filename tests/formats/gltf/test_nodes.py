"""Nodes: placement, trees and instances."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import math

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf import read_gltf
from quiltcli.formats.mesh import read_mesh
from tests.helpers.gltf_files import GltfFile, corners, one_square

HALF = math.sqrt(0.5)


def message(file, path):
    with pytest.raises(MeshError) as caught:
        read_gltf(file.write(path / "m.glb"))
    return str(caught.value).removeprefix(f"{path}/m.glb: ")


def test_scale_then_turn_then_shift(tmp_path):
    file = one_square(translation=[1, 2, 3], rotation=[0, 0, HALF, HALF], scale=[2, 3, 1])
    found = corners(file.write(tmp_path / "m.glb"))
    np.testing.assert_allclose(found[0], [[1, 2, 3], [1, 4, 3], [-2, 4, 3]], atol=1e-15)


def test_a_matrix_is_given_column_by_column(tmp_path):
    matrix = [0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]
    found = corners(one_square(matrix=matrix).write(tmp_path / "m.glb"))
    assert found[0].tolist() == [[1, 2, 3], [1, 4, 3], [-2, 4, 3]]


def test_children_move_with_their_parents(tmp_path):
    file = one_square(translation=[0, 1, 0])
    file.node(children=[0], scale=[2, 2, 2])
    file.node(children=[1], translation=[5, 0, 0])
    found = corners(file.write(tmp_path / "m.glb"))
    assert found.min(axis=(0, 1)).tolist() == [5, 2, 0]
    assert found.max(axis=(0, 1)).tolist() == [7, 4, 0]


@pytest.mark.parametrize("depth", [3, 20_000])
def test_a_chain_of_nodes_of_any_length(tmp_path, depth):
    file = one_square()
    for child in range(depth):
        file.node(children=[child], translation=[1, 0, 0])
    assert corners(file.write(tmp_path / "m.glb")).max() == depth + 1


def test_only_the_scene_that_is_named_is_shown(tmp_path):
    file = one_square()
    file.node(mesh=0, translation=[5, 0, 0])
    file.json["scenes"] = [{"nodes": [0]}, {"nodes": [1]}]
    assert corners(file.write(tmp_path / "m.glb")).max() == 1
    file.json["scene"] = 1
    assert corners(file.write(tmp_path / "m.glb")).max() == 6
    # Without scenes every root is shown.
    del file.json["scenes"], file.json["scene"]
    assert len(corners(file.write(tmp_path / "m.glb"))) == 4


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ([{"children": [0]}], "nodes[0].children: the node is its own ancestor"),
        ([{"children": [1]}, {"children": [0]}], "nodes[0].children: the node is its own ancestor"),
        ([{"children": [2]}, {"children": [2]}, {}], "nodes[1].children[0]: node 2 is a child of node 0 already"),
        ([{"children": [5]}], "nodes[0].children[0]: expected node, 0 to 0, got 5"),
        ([{"rotation": [0, 0, 0, 0]}], "nodes[0].rotation: expected a unit quaternion"),
        ([{"matrix": [0] * 16}], "nodes[0].matrix: is not affine"),
        ([{"children": [1]}, {}], "scenes[0].nodes[0]: node 1 is a child of node 0 (expected a root)"),
    ],
)  # fmt: skip
def test_nodes_that_make_no_tree_are_named(tmp_path, nodes, words):
    file = GltfFile(nodes=nodes, scenes=[{"nodes": [len(nodes) - 1]}])
    assert message(file, tmp_path).startswith(words)


@pytest.mark.parametrize("mirror", [{"scale": [-1, 1, 1]}, {"scale": [-1, -1, -1]}])
def test_a_mirrored_node_keeps_its_front(tmp_path, mirror):
    file = one_square(**mirror)
    path = file.write(tmp_path / "m.glb")
    expected = 1 if mirror["scale"][2] == 1 else -1
    # The square's front follows its mirrored normal: it looks to +Z, or to -Z where Z is mirrored too.
    mesh = read_mesh(path)
    display = mesh.vertices[mesh.corners].reshape(-1, 3, 3)
    for found in (corners(path), display):
        normal = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
        assert (normal[:, 2] * expected > 0).all()


def test_instances_of_the_extension_stand_where_it_says(tmp_path):
    file = GltfFile(extensionsRequired=["EXT_mesh_gpu_instancing"])
    places = {
        "TRANSLATION": file.accessor([(0, 0, 0), (10, 0, 0), (20, 0, 0)]),
        "ROTATION": file.accessor([(0, 0, 0, 127), (0, 0, 127, 0), (0, 0, 0, 127)], "i1", normalized=True),
        "SCALE": file.accessor([(1, 1, 1), (1, 1, 1), (2, 2, 2)]),
    }
    file.node(
        mesh=file.mesh(),
        translation=[0, 5, 0],
        extensions={"EXT_mesh_gpu_instancing": {"attributes": places}},
    )
    found = corners(file.write(tmp_path / "m.glb")).reshape(3, -1, 3)
    assert found.min(axis=1).tolist() == [[0, 5, 0], [9, 4, 0], [20, 5, 0]]
    assert found.max(axis=1).tolist() == [[1, 6, 0], [10, 5, 0], [22, 7, 0]]


def test_instances_of_different_counts(tmp_path):
    file = GltfFile()
    places = {"TRANSLATION": file.accessor([(0, 0, 0)] * 3), "SCALE": file.accessor([(1, 1, 1)] * 2)}
    file.node(mesh=file.mesh(), extensions={"EXT_mesh_gpu_instancing": {"attributes": places}})
    found = message(file, tmp_path)
    words = "attributes.SCALE: has 2 elements (expected 3, as the others have)"
    assert found == f"nodes[0].extensions.EXT_mesh_gpu_instancing.{words}"


def test_instances_of_a_display_come_in_the_order_of_their_transforms(tmp_path):
    file = one_square(translation=[5, 0, 0])
    file.node(mesh=0, translation=[3, 0, 0])
    assert read_mesh(file.write(tmp_path / "m.glb")).vertices[::4, 0].tolist() == [3, 5]


def test_a_display_has_texture_coordinates_without_a_material(tmp_path):
    file = GltfFile()
    uv = file.accessor([(0, 0), (1, 0), (1, 0.25), (0, 0.25)])
    file.node(mesh=file.mesh(file.primitive(attributes={"TEXCOORD_0": uv})))
    found = read_mesh(file.write(tmp_path / "m.glb")).uv
    assert found[:3].tolist() == [[0, 1], [1, 1], [1, 0.75]]
