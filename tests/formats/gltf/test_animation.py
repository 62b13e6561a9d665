"""Animations: what keys say between them, and what comes after the last."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.formats.gltf import read_gltf
from quiltcli.formats.gltf.animation import clip_time, slerp, value_at
from quiltcli.scene.importers.gltf import GltfModel, Playing, gltf_parts, pose, read_gltf_model
from tests.helpers.gltf_files import SQUARE, GltfFile, corners, one_square

HALF = math.sqrt(0.5)
QUARTER = [0, 0, HALF, HALF]


def low(path, time, **more):
    """The lowest corner at a time."""
    return corners(path, time=time, **more).min(axis=(0, 1)).tolist()


def message(file, path):
    with pytest.raises(MeshError) as caught:
        read_gltf(file.write(path / "m.glb"))
    return str(caught.value).removeprefix(f"{path}/m.glb: ")


def test_linear_keys_are_joined_by_lines_and_held_outside(tmp_path):
    file = one_square(translation=[9, 9, 9])
    file.animation(0, "translation", [1, 2, 4], [(0, 0, 0), (2, 0, 0), (2, 8, 0)])
    path = file.write(tmp_path / "m.glb")
    assert corners(path).min() == 9
    for time, expected in [
        (-5, (0, 0)),
        (1, (0, 0)),
        (1.25, (0.5, 0)),
        (2, (2, 0)),
        (3, (2, 4)),
        (9, (2, 8)),
    ]:
        assert low(path, time)[:2] == list(expected)


def test_steps_stay_until_the_next_key(tmp_path):
    file = one_square()
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (2, 0, 0)], interpolation="STEP")
    path = file.write(tmp_path / "m.glb")
    assert [low(path, time)[0] for time in (0, 0.999, 1, 2)] == [0, 0, 2, 2]


def test_a_cubic_spline_follows_its_tangents(tmp_path):
    # Arrive, value and leave at each of two keys that are two seconds apart.
    keys = [(9, 9, 9), (0, 0, 0), (1, 0, 0), (3, 0, 0), (4, 0, 0), (9, 9, 9)]
    file = one_square()
    file.animation(0, "translation", [0, 2], keys, interpolation="CUBICSPLINE")
    path = file.write(tmp_path / "m.glb")
    assert low(path, 0)[0] == 0
    assert low(path, 2)[0] == 4
    # Half way: (v0 + v1)/2 + 2 s · (leave − arrive)/8.
    assert low(path, 1)[0] == 2 + 2 * (1 - 3) / 8


def test_a_turn_goes_the_short_way_at_an_even_pace():
    identity, third = np.array([0.0, 0, 0, 1]), np.array([0, 0, math.sin(math.pi / 6), math.cos(math.pi / 6)])
    for sign in (1, -1):
        found = slerp(identity, sign * third, 0.25)
        expected = [0, 0, math.sin(math.pi / 24), math.cos(math.pi / 24)]
        assert np.abs(found) == pytest.approx(expected, abs=1e-11)
    assert slerp(third, -third, 0.3) == pytest.approx(third)
    # Turned by half a circle: any way is the shortest, but it is a turn.
    assert np.linalg.norm(slerp(identity, np.array([0.0, 0, 1, 0]), 0.5)) == pytest.approx(1)


def test_turns_that_nearly_agree_divide_by_nothing():
    almost = np.array([0, 0, 1e-7, 1.0])
    assert slerp(np.array([0.0, 0, 0, 1]), almost, 0.5)[2] == pytest.approx(5e-8)


def test_rotation_and_scale_are_animated_too(tmp_path):
    file = one_square()
    file.animation(0, "rotation", [0, 1], [(0, 0, 0, 1), QUARTER])
    file.animation(0, "scale", [0, 1], [(1, 1, 1), (2, 3, 1)])
    found = corners(file.write(tmp_path / "m.glb"), time=1)
    np.testing.assert_allclose(found[0], [[0, 0, 0], [0, 2, 0], [-3, 2, 0]], atol=1e-9)


def test_normalized_turns_are_numbers_to_1(tmp_path):
    file = one_square()
    output = file.accessor([(0, 0, 0, 127), (0, 0, 127, 0)], "i1", normalized=True)
    sampler = {"input": file.accessor([0.0, 1.0]), "output": output}
    target = {"node": 0, "path": "rotation"}
    file.add("animations", channels=[{"sampler": 0, "target": target}], samplers=[sampler])
    found = corners(file.write(tmp_path / "m.glb"), time=1)
    assert found[0].tolist() == [[0, 0, 0], [-1, 0, 0], [-1, -1, 0]]


def two_clips():
    file = one_square()
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (2, 0, 0)], name="slide")
    file.animation(0, "scale", [0, 2], [(1, 1, 1), (3, 1, 1)], name="stretch")
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (0, 0, 7)])
    return file


@pytest.mark.parametrize(
    ("clips", "expected"),
    [
        ("slide", ([2, 0, 0], [3, 1, 0])),
        (["slide", "stretch"], ([2, 0, 0], [5, 1, 0])),
        ("animation 3", ([0, 0, 7], [1, 1, 7])),
        # Of two clips that move the same thing the first counts.
        ("all", ([2, 0, 0], [5, 1, 0])),
    ],
)
def test_clips_are_chosen_by_name(tmp_path, clips, expected):
    found = corners(two_clips().write(tmp_path / "m.glb"), time=2, clips=clips)
    assert (found.min(axis=(0, 1)).tolist(), found.max(axis=(0, 1)).tolist()) == expected


def test_a_clip_that_is_not_there(tmp_path):
    with pytest.raises(MeshError) as caught:
        corners(two_clips().write(tmp_path / "m.glb"), time=0, clips=["slide", "slid"])
    assert str(caught.value).endswith(
        "has no animation 'slid' (expected all, 'slide', 'stretch', 'animation 3')"
    )


@pytest.mark.parametrize(
    ("after", "expected"),
    [
        ("hold", [0, 0, 0.5, 2, 2, 2, 2]),
        ("loop", [1.5, 0, 0.5, 0, 0.5, 1, 0.5]),
        ("bounce", [0.5, 0, 0.5, 2, 1.5, 1, 0.5]),
    ],
)
def test_after_its_end_a_clip_holds_begins_anew_or_runs_back(after, expected):
    assert [clip_time(t, 2.0, after) for t in (-0.5, 0, 0.5, 2, 2.5, 3, 4.5)] == expected


def test_a_clip_without_length_has_one_time():
    assert {clip_time(3.0, 0.0, after) for after in ("hold", "loop", "bounce")} == {0.0}


def test_two_keys_at_one_time_do_not_divide_by_nothing(tmp_path):
    file = one_square()
    file.animation(0, "translation", [0, 1, 1, 2], [(0, 0, 0), (1, 0, 0), (5, 0, 0), (6, 0, 0)])
    channel = read_gltf(file.write(tmp_path / "m.glb")).clips[0].channels[0]
    assert [value_at(channel, t)[0] for t in (0.5, 1, 1.5)] == [0.5, 5, 5.5]


def test_broken_channels_are_named(tmp_path):
    file = one_square(matrix=np.eye(4).ravel().tolist())
    file.animation(0, "translation", [0, 1], [(0, 0, 0)] * 2)
    words = "node 0 has a matrix (expected translation, rotation and scale)"
    assert message(file, tmp_path) == f"animations[0].channels[0].target.node: {words}"
    file = one_square()
    file.animation(0, "translation", [1, 0], [(0, 0, 0)] * 2)
    assert message(file, tmp_path) == "animations[0].samplers[0].input: its times do not ascend"
    file = one_square()
    file.animation(0, "translation", [0, 1], [(0, 0, 0)] * 3)
    assert message(file, tmp_path) == "animations[0].samplers[0].output: has 3 elements for 2 keys"
    file = one_square()
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (np.inf, 0, 0)])
    words = "holds numbers that are not finite"
    assert message(file, tmp_path) == f"animations[0].samplers[0].output: {words}"


def test_channels_of_nothing_are_passed_over(tmp_path):
    file = one_square()
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (1, 0, 0)])
    channels = file.json["animations"][0]["channels"]
    channels.append({"sampler": 0, "target": {"path": "scale"}})
    channels.append({"sampler": 0, "target": {"path": "pointer"}})
    gltf = read_gltf(file.write(tmp_path / "m.glb"))
    assert len(gltf.clips[0].channels) == 1
    assert gltf.notices == ("1 animation channel left out, which move no node",)


# --- morph targets


def morphing(**mesh):
    """A square with a target that lifts it by 2 and one that moves it by 1 along X."""
    file = GltfFile()
    lifted, moved = file.accessor([(0, 0, 2)] * 4), file.accessor([(1, 0, 0)] * 4)
    primitive = file.primitive(targets=[{"POSITION": lifted}, {"POSITION": moved}])
    file.node(mesh=file.mesh(primitive, **mesh))
    return file


def test_weights_of_the_mesh_hold_at_rest_and_the_nodes_win(tmp_path):
    file = morphing(weights=[0.5, 0])
    path = file.write(tmp_path / "m.glb")
    assert corners(path).min(axis=(0, 1)).tolist() == [0, 0, 1]
    file.json["nodes"][0]["weights"] = [0, 3]
    assert corners(file.write(path)).min(axis=(0, 1)).tolist() == [3, 0, 0]


def test_weights_are_animated(tmp_path):
    file = morphing()
    file.animation(0, "weights", [0, 1], [(0, 0), (1, 4)])
    assert low(file.write(tmp_path / "m.glb"), 0.5) == [2, 0, 1]


def test_weights_follow_splines(tmp_path):
    file = morphing()
    keys = [[(0, 0), (0, 0), (0, 0)], [(0, 0), (1, 4), (0, 0)]]
    file.animation(0, "weights", [0, 1], keys, interpolation="CUBICSPLINE")
    assert low(file.write(tmp_path / "m.glb"), 0.5) == [2, 0, 1]


def test_as_many_weights_as_targets(tmp_path):
    assert message(morphing(weights=[1]), tmp_path) == "meshes[0].weights: 1 weights for 2 morph targets"


def test_normals_morph_too(tmp_path):
    file = GltfFile()
    target = {"POSITION": file.accessor([(0, 0, 0)] * 4), "NORMAL": file.accessor([(1, 0, -1)] * 4)}
    normal = file.accessor([(0, 0, 1)] * 4)
    primitive = file.primitive(attributes={"NORMAL": normal}, targets=[target])
    file.node(mesh=file.mesh(primitive, weights=[1]))
    model = read_gltf_model(file.write(tmp_path / "m.glb"))
    assert gltf_parts(model)[0].normals.tolist() == [[1, 0, 0]] * 4


# --- skins


def skinned(joints=((0, 1, 0, 0),) * 4, weights=((1, 0, 0, 0),) * 2 + ((0, 1, 0, 0),) * 2):
    """A square whose lower side holds to a joint at (0, 5, 0), its upper one to one above that turns."""
    file = GltfFile()
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, 1, 3] = -1
    matrices = file.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))
    attributes = {"JOINTS_0": file.accessor(joints, "u1"), "WEIGHTS_0": file.accessor(weights)}
    mesh = file.mesh(file.primitive(attributes=attributes))
    file.node(mesh=mesh, skin=0, translation=[100, 0, 0])
    file.node(children=[2], translation=[0, 5, 0])
    file.node(translation=[0, 1, 0])
    file.add("skins", joints=[1, 2], inverseBindMatrices=matrices)
    return file


def test_a_skin_is_where_its_joints_are_and_not_where_its_node_is(tmp_path):
    found = corners(skinned().write(tmp_path / "m.glb"))
    assert found[0].tolist() == [[0, 5, 0], [1, 5, 0], [1, 6, 0]]


def test_joints_move_what_holds_to_them(tmp_path):
    file = skinned()
    file.animation(2, "rotation", [0, 1], [(0, 0, 0, 1), QUARTER])
    found = corners(file.write(tmp_path / "m.glb"), time=1)
    # (1, 1) lies beside the turning joint, which is at (0, 1) at rest; (0, 1) is the joint's own place.
    np.testing.assert_allclose(found[0], [[0, 5, 0], [1, 5, 0], [0, 7, 0]], atol=1e-9)
    np.testing.assert_allclose(found[1, 2], [0, 6, 0], atol=1e-9)


def test_weights_are_made_to_sum_to_one(tmp_path):
    file = skinned(weights=((2, 2, 0, 0),) * 4)
    file.json["nodes"][2]["translation"] = [0, 3, 0]
    assert corners(file.write(tmp_path / "m.glb")).min(axis=(0, 1)).tolist() == [0, 6, 0]


def test_a_joint_that_is_not_there(tmp_path):
    words = "meshes[0].primitives[0].attributes.JOINTS_0: names joint 7 of 2 (expected 0 to 1)"
    assert message(skinned(joints=((7, 1, 0, 0),) * 4), tmp_path) == words
    # Without any weight it does no harm.
    file = skinned(joints=((0, 1, 9, 0),) * 4)
    assert len(corners(file.write(tmp_path / "m.glb"))) == 2


def test_normals_turn_with_the_joints(tmp_path):
    file = skinned()
    primitive = file.json["meshes"][0]["primitives"][0]
    primitive["attributes"]["NORMAL"] = file.accessor([(1, 0, 0)] * 4)
    file.json["nodes"][2]["rotation"] = QUARTER
    found = gltf_parts(read_gltf_model(file.write(tmp_path / "m.glb")))[0].normals
    np.testing.assert_allclose(found, [(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)], atol=1e-9)


# --- the order of what is posed


def test_a_pose_keeps_the_order_of_vertices(tmp_path):
    file = skinned()
    file.node(mesh=file.mesh(), translation=[7, 0, 0])
    file.animation(3, "translation", [0, 1], [(0, 0, 0), (0, 0, 5)])
    model = read_gltf_model(file.write(tmp_path / "m.glb"))
    rest = np.concatenate([part.vertices for part in gltf_parts(model)])
    vertices, normals = pose(model, 1.0)
    assert (vertices[:4] == rest[:4]).all()
    np.testing.assert_allclose(vertices[4:], np.array(SQUARE) + (0, 0, 5))
    assert not normals.any()


def test_a_clip_that_turns_inside_out_keeps_its_triangles(tmp_path):
    file = one_square()
    file.animation(0, "scale", [0, 1], [(1, 1, 1), (-1, 1, 1)])
    model = read_gltf_model(file.write(tmp_path / "m.glb"))
    assert isinstance(model, GltfModel)
    before, after = (gltf_parts(model, t, Playing())[0].triangles for t in (0.0, 1.0))
    assert (before == after).all()
