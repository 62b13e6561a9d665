"""Stages at times: places, points, faces, visibility, skeletons."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import MeshError
from quiltcli.scene.importers.model import Playing
from quiltcli.scene.importers.usd import read_usd_model
from tests.helpers.usd_files import corners, listed, mesh, needs_usd, parts_of, stage, xform

needs_usd()
RANGE = {"startTimeCode": 10, "endTimeCode": 34, "timeCodesPerSecond": 24}
FIRST, LAST = 10 / 24, 34 / 24


def sliding(*body, **meta):
    """A place that goes from x = 0 at time code 10 to x = 24 at 34."""
    ops = "double3 xformOp:translate.timeSamples = {10: (0, 0, 0), 34: (24, 0, 0)}"
    return xform("x", *(body or (mesh(),)), ops=ops, order='"xformOp:translate"')


def x_at(path, seconds, after="hold"):
    return float(parts_of(path, seconds, after)[0].vertices[0, 0])


def test_second_0_is_time_code_0_and_places_are_linear_between_samples(tmp_path):
    path = stage(tmp_path / "a.usda", sliding(), **RANGE)
    assert x_at(path, 22 / 24) == 12
    assert x_at(path, 22.5 / 24) == 12.5


@pytest.mark.parametrize(
    ("code", "after", "expected"),
    [
        (0, "hold", 0),
        (99, "hold", 24),
        (35, "loop", 1),
        (9, "loop", 23),
        (35, "bounce", 23),
        (9, "bounce", 1),
        (59, "bounce", 1),
    ],
)
def test_beyond_its_range_it_holds_begins_anew_or_runs_back(tmp_path, code, after, expected):
    assert x_at(stage(tmp_path / "a.usda", sliding(), **RANGE), code / 24, after) == expected


def test_without_a_range_the_samples_are_it(tmp_path):
    path = stage(tmp_path / "a.usda", sliding(), timeCodesPerSecond=24)
    assert x_at(path, 35 / 24, "loop") == 1


def test_time_codes_have_the_rate_of_the_stage(tmp_path):
    path = stage(tmp_path / "a.usda", sliding(), **{**RANGE, "timeCodesPerSecond": 60})
    assert x_at(path, 22 / 60) == 12


def test_at_rest_a_stage_is_as_it_begins(tmp_path):
    ops = "double3 xformOp:translate.timeSamples = {0: (5, 0, 0), 20: (25, 0, 0)}"
    path = stage(tmp_path / "a.usda", xform("x", mesh(), ops=ops, order='"xformOp:translate"'), **RANGE)
    assert x_at(path, None) == 15


def test_points_are_linear_between_samples(tmp_path):
    high = [(x, y, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    low = [(x, y, 0) for x, y, _ in high]
    points = f"point3f[] points.timeSamples = {{0: {listed(low)}, 24: {listed(high)}}}"
    path = stage(tmp_path / "a.usda", mesh(points=points))
    model = read_usd_model(path)
    vertices, _ = model.pose(0.25, Playing())
    np.testing.assert_array_equal(vertices[:, 2], [0.25] * 4)
    assert model.form(0.25, Playing()) == model.form(0.75, Playing())


def test_a_pose_has_the_vertices_of_the_parts(tmp_path):
    normals = (
        'normal3f[] normals (interpolation = "constant")\n'
        "normal3f[] normals.timeSamples = {0: [(0, 0, 1)], 24: [(0, 1, 0)]}"
    )
    path = stage(tmp_path / "a.usda", sliding(mesh("a"), mesh("b", more=normals)), **RANGE)
    model = read_usd_model(path)
    parts = model.parts(0.7, Playing())
    vertices, directions = model.pose(0.7, Playing())
    np.testing.assert_array_equal(vertices, np.concatenate([part.vertices for part in parts]))
    np.testing.assert_array_equal(directions[4:], parts[1].normals)
    assert not directions[:4].any()


def test_frames_meet_the_samples_of_held_values(tmp_path):
    # 7 / 30 · 30 falls short of 7 in some orders of the sum; what changes there must have changed.
    times = ", ".join(f'{k}: "{"inherited" if k % 2 else "invisible"}"' for k in range(60))
    path = stage(
        tmp_path / "a.usda",
        mesh("always"),
        xform("x", mesh(), ops=f"token visibility.timeSamples = {{{times}}}"),
        timeCodesPerSecond=30,
    )
    model = read_usd_model(path)
    for k in range(60):
        triangles = sum(len(part.triangles) for part in model.parts(k / 30, Playing()))
        assert triangles == (4 if k % 2 else 2), k


BLINKS = 'token visibility.timeSamples = {0: "inherited", 10: "invisible", 20: "inherited"}'


def test_what_comes_and_goes_has_another_form(tmp_path):
    model = read_usd_model(stage(tmp_path / "a.usda", mesh("still"), xform("x", mesh(), ops=BLINKS)))
    forms = [model.form(code / 24, Playing()) for code in (0, 5, 10, 15, 20)]
    assert forms[0] == forms[1] == forms[4]
    assert forms[2] == forms[3] != forms[0]
    assert not model.hidden(10 / 24, Playing())


def test_where_nothing_is_seen_all_vertices_are_at_one_place(tmp_path):
    model = read_usd_model(stage(tmp_path / "a.usda", xform("x", mesh(), ops=BLINKS)))
    assert model.hidden(10 / 24, Playing())
    vertices, _ = model.pose(10 / 24, Playing())
    assert len(vertices) == 4
    assert not np.ptp(vertices, axis=0).any()
    assert [len(part.triangles) for part in model.parts(10 / 24, Playing())] == [2]


def test_faces_may_change(tmp_path):
    text = mesh(counts=[3], indices=[0, 1, 2]).replace(
        "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]",
        "int[] faceVertexCounts.timeSamples = {0: [3], 12: [4]}\n"
        "int[] faceVertexIndices.timeSamples = {0: [0, 1, 2], 12: [0, 1, 2, 3]}",
    )
    path = stage(tmp_path / "a.usda", text)
    assert len(corners(path, 11 / 24)) == 1
    assert len(corners(path, 12 / 24)) == 2


def test_instances_move_and_their_number_may_change(tmp_path):
    more = (
        "int[] protoIndices.timeSamples = {0: [0], 12: [0, 0]}\n"
        "point3f[] positions.timeSamples = {0: [(0, 0, 0)], 11: [(11, 0, 0)], 12: [(0, 0, 0), (9, 0, 0)]}"
    )
    text = f'def PointInstancer "i"\n{{\nrel prototypes = [</i/p>]\n{more}\n{mesh("p")}\n}}\n'
    model = read_usd_model(stage(tmp_path / "a.usda", text))
    assert model.pose(5.5 / 24, Playing())[0][0, 0] == 5.5
    assert model.form(0, Playing()) == model.form(5 / 24, Playing()) != model.form(12 / 24, Playing())
    assert len(model.parts(12 / 24, Playing())[0].vertices) == 8


def test_a_stage_that_rests_has_no_animation(tmp_path):
    assert read_usd_model(stage(tmp_path / "a.usda", mesh(), **RANGE)).clips == ()


def test_the_animation_that_a_scene_asks_for_is_there(tmp_path):
    model = read_usd_model(stage(tmp_path / "a.usda", sliding(), **RANGE))
    assert model.clips == ("animation 1",)
    model.check(Playing("animation 1"))
    with pytest.raises(MeshError, match="has no animation 'walk'"):
        model.check(Playing(("all", "walk")))


JOINTS = "[matrix, other]"
SKELETON = """
def SkelRoot "root" (prepend apiSchemas = ["SkelBindingAPI"])
{
    def Skeleton "skel" (prepend apiSchemas = ["SkelBindingAPI"])
    {
        uniform token[] joints = ["a", "a/b"]
        uniform matrix4d[] bindTransforms = [
            ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1)), ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,1,0,1))]
        uniform matrix4d[] restTransforms = [
            ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1)), ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,1,0,1))]
        rel skel:animationSource = </root/skel/anim>
        def SkelAnimation "anim"
        {
            uniform token[] joints = ["a", "a/b"]
            float3[] translations.timeSamples = {0: [(0,0,0), (0,1,0)], 24: [(0,0,0), (2,1,0)]}
            quatf[] rotations = [(1,0,0,0), (1,0,0,0)]
            half3[] scales = [(1,1,1), (1,1,1)]
            uniform token[] blendShapes = ["fat"]
            float[] blendShapeWeights.timeSamples = {0: [0], 24: [1]}
        }
    }
    BODY
}
"""
SKIN = """
    rel skel:skeleton = </root/skel>
    int[] primvars:skel:jointIndices = [0, 0, 1, 1] (
        elementSize = 1
        interpolation = "vertex"
    )
    float[] primvars:skel:jointWeights = [1, 1, 1, 1] (
        elementSize = 1
        interpolation = "vertex"
    )
"""
SHAPE = """
    uniform token[] skel:blendShapes = ["fat"]
    rel skel:blendShapeTargets = </root/square/fat>
    def BlendShape "fat"
    {
        uniform vector3f[] offsets = [(0, 0, 4)]
        uniform int[] pointIndices = [0]
    }
"""


def skinned(more):
    body = mesh(more=more, meta='prepend apiSchemas = ["SkelBindingAPI"]')
    return SKELETON.replace("BODY", body)


def test_joints_move_the_points_they_hold(tmp_path):
    vertices, _ = read_usd_model(stage(tmp_path / "a.usda", skinned(SKIN))).pose(0.5, Playing())
    np.testing.assert_allclose(vertices, [(0, 0, 0), (1, 0, 0), (2, 1, 0), (1, 1, 0)], atol=1e-6)


def test_blend_shapes_add_their_offsets(tmp_path):
    vertices, _ = read_usd_model(stage(tmp_path / "a.usda", skinned(SKIN + SHAPE))).pose(0.25, Playing())
    np.testing.assert_allclose(vertices[:, 2], [1, 0, 0, 0], atol=1e-6)


def test_a_skin_that_does_not_fit_names_its_mesh(tmp_path):
    path = stage(tmp_path / "a.usda", skinned(SKIN.replace("[0, 0, 1, 1]", "[0, 0, 1]")))
    with pytest.raises(MeshError, match="/root/square: has joint indices and weights"):
        read_usd_model(path).pose(0.5, Playing())


def test_normals_of_a_skin_are_made_anew_and_stay_sharp_where_they_were(tmp_path):
    # Two faces that fold over the edge from (1, 0, 0) to (1, 1, 0).
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
    shape = SHAPE.replace("[(0, 0, 4)]", "[(0, 0, 1), (0, 0, 1)]").replace(
        "pointIndices = [0]", "pointIndices = [4, 5]"
    )
    body = mesh(
        points=points,
        counts=[4, 4],
        indices=[0, 1, 2, 3, 1, 4, 5, 2],
        more=SKIN.replace("[0, 0, 1, 1]", "[0, 0, 0, 0, 0, 0]").replace("[1, 1, 1, 1]", "[1, 1, 1, 1, 1, 1]")
        + shape
        + "NORMALS",
        meta='prepend apiSchemas = ["SkelBindingAPI"]',
    )
    smooth = 'normal3f[] normals = [(0, 0, 1)] (interpolation = "constant")'
    sharp = (
        f"normal3f[] normals = [{', '.join(['(0, 0, 1)'] * 4 + ['(0, 0.1, 1)'] * 4)}]"
        ' (interpolation = "faceVarying")'
    )
    # Weights 1 of (0, 0, 1), and √2 / (√2² · 1²) of (-1, 0, 1) / √2.
    for given, expected in ((smooth, [(-1, 0, 3)]), (sharp, [(-1, 0, 1), (0, 0, 1)])):
        path = stage(tmp_path / "a.usda", SKELETON.replace("BODY", body.replace("NORMALS", given)))
        vertices, normals = read_usd_model(path).pose(1, Playing())
        edge = (np.abs(vertices - (1, 0, 0)) < 1e-6).all(axis=1)
        found = sorted(normals[edge].tolist())
        lengths = np.linalg.norm(expected, axis=1, keepdims=True)
        np.testing.assert_allclose(found, np.array(expected) / lengths, atol=1e-6)


def test_what_changes_its_faces_is_not_kept(tmp_path):
    counts = ", ".join(f"{k}: [{3 + k % 3}]" for k in range(30))
    indices = ", ".join(f"{k}: {list(range(3 + k % 3))}" for k in range(30))
    text = mesh(points=[(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]).replace(
        "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]",
        f"int[] faceVertexCounts.timeSamples = {{{counts}}}\n"
        f"int[] faceVertexIndices.timeSamples = {{{indices}}}",
    )
    blinking = xform("x", mesh("still"), ops=BLINKS)
    model = read_usd_model(stage(tmp_path / "a.usda", text, blinking))
    for k in range(30):
        triangles = [len(part.triangles) for part in model.parts(k / 24, Playing())]
        assert triangles == [1 + k % 3, 0 if 10 <= k < 20 else 2]
    kept = [len(forms) for forms in model._forms.values()]
    assert kept == [2, 1]
    assert len(model._points) == 1


def test_prototypes_may_be_native_instances(tmp_path):
    kind = xform("kind", mesh()).replace("def", "class", 1)
    use = xform("p", meta="instanceable = true\nreferences = </kind>")
    more = "int[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0), (5, 0, 0)]"
    text = f'def PointInstancer "i"\n{{\nrel prototypes = [</i/p>]\n{more}\n{use}\n}}\n'
    found = parts_of(stage(tmp_path / "a.usda", kind, text))
    assert [part.vertices[::4, 0].tolist() for part in found] == [[0, 5]]
