"""Where the triangles of a stage are."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import MeshError, MissingExtraError, SceneError
from quiltcli.formats.mesh import read_mesh
from quiltcli.scene import load_scene
from quiltcli.scene.importers.asset import read_asset
from tests.helpers.usd_files import (
    bound,
    corners,
    material,
    mesh,
    moved,
    needs_usd,
    notices,
    parts_of,
    stage,
    xform,
)

needs_usd()
SQUARE = [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[1, 1, 0], [0, 1, 0], [0, 0, 0]]]


def area(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.cross(b - a, c - a).sum(axis=0) / 2


def test_a_square_is_two_triangles_in_metres(tmp_path):
    np.testing.assert_array_equal(corners(stage(tmp_path / "a.usda", mesh())), SQUARE)


def test_centimetres_are_hundredths(tmp_path):
    found = corners(stage(tmp_path / "a.usda", mesh(), metersPerUnit=0.01))
    np.testing.assert_allclose(found, np.array(SQUARE) / 100, rtol=0, atol=1e-17)
    assert notices(tmp_path / "a.usda") == ()


def test_a_stage_that_does_not_say_its_unit_is_in_centimetres_and_that_is_said(tmp_path):
    path = stage(tmp_path / "a.usda", mesh(), metersPerUnit=None)
    np.testing.assert_allclose(corners(path), np.array(SQUARE) / 100, rtol=0, atol=1e-17)
    assert notices(path) == (
        "does not say its metersPerUnit: taken as centimetres ('units: 100' makes it metres)",
    )


def test_with_z_up_the_negative_y_axis_faces_the_worlds_z(tmp_path):
    path = stage(
        tmp_path / "a.usda", mesh(points=[(1, 2, 3), (2, 2, 3), (1, 2, 4), (1, 2, 3.5)]), upAxis='"Z"'
    )
    np.testing.assert_array_equal(parts_of(path)[0].vertices[0], (1, 3, -2))


def test_a_polygon_with_a_notch_is_covered_once(tmp_path):
    notch = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0)]
    found = corners(stage(tmp_path / "a.usda", mesh(points=notch, counts=[5])))
    np.testing.assert_allclose(area(found), (0, 0, 16 - 6))
    assert len(found) == 3


def test_a_hole_is_no_face(tmp_path):
    two = mesh(counts=[3, 3], indices=[0, 1, 2, 0, 2, 3], more="int[] holeIndices = [0]")
    np.testing.assert_array_equal(
        corners(stage(tmp_path / "a.usda", two)), [[[0, 0, 0], [1, 1, 0], [0, 1, 0]]]
    )


def test_left_handed_faces_are_wound_the_other_way(tmp_path):
    path = stage(tmp_path / "a.usda", mesh(more='uniform token orientation = "leftHanded"'))
    np.testing.assert_allclose(area(corners(path)), (0, 0, -1))


def test_a_mirrored_place_keeps_the_front_in_front(tmp_path):
    ops = "float3 xformOp:scale = (-1, 1, 1)"
    path = stage(tmp_path / "a.usda", xform("x", mesh(), ops=ops, order='"xformOp:scale"'))
    found = corners(path)
    assert found[..., 0].min() == -1
    np.testing.assert_allclose(area(found), (0, 0, 1))


def test_places_follow_one_another(tmp_path):
    turn = "float xformOp:rotateZ = 90\ndouble3 xformOp:translate = (1, 0, 0)"
    inner = xform("y", mesh(), ops=turn, order='"xformOp:translate", "xformOp:rotateZ"')
    found = parts_of(stage(tmp_path / "a.usda", moved("x", (0, 5, 0), inner)))[0].vertices
    np.testing.assert_allclose(found[1], (1, 6, 0), atol=1e-15)


def test_a_reset_stack_forgets_what_is_above(tmp_path):
    ops = "double3 xformOp:translate = (1, 0, 0)"
    inner = xform("y", mesh(), ops=ops, order='"!resetXformStack!", "xformOp:translate"')
    found = parts_of(stage(tmp_path / "a.usda", moved("x", (0, 5, 0), inner)))[0].vertices
    np.testing.assert_array_equal(found[0], (1, 0, 0))


def test_what_is_invisible_or_no_part_of_the_picture_is_left_out(tmp_path):
    path = stage(
        tmp_path / "a.usda",
        mesh("seen"),
        xform("hidden", mesh(), ops='token visibility = "invisible"'),
        xform("helper", mesh(), ops='uniform token purpose = "guide"'),
        xform("final", mesh(), ops='uniform token purpose = "render"'),
    )
    assert len(corners(path)) == 4
    assert notices(path) == ("1 prim of purpose proxy or guide left out",)


def test_inactive_prims_and_classes_are_not_there(tmp_path):
    body = mesh("seen"), mesh("off", meta="active = false"), mesh("kind").replace("def", "class", 1)
    assert len(corners(stage(tmp_path / "a.usda", *body))) == 2


def test_native_instances_are_copies_of_one_part(tmp_path):
    kind = xform("kind", mesh()).replace("def", "class", 1)
    use = [
        moved(f"at{x}", (x, 0, 0)).replace("()", "(instanceable = true\nreferences = </kind>)", 1)
        for x in (3, 7)
    ]
    found = parts_of(stage(tmp_path / "a.usda", kind, *use))
    assert len(found) == 1
    np.testing.assert_array_equal(found[0].vertices[[0, 4], 0], (3, 7))
    assert len(found[0].triangles) == 4


def instancer(more="", prototypes="</i/p>", body=None, name="i"):
    return (
        f'def PointInstancer "{name}"\n{{\nrel prototypes = [{prototypes}]\n'
        f"{more}\n{moved('p', (0, 0, 10), mesh()) if body is None else body}\n}}\n"
    )


POINTS = "int[] protoIndices = [0, 0, 0]\npoint3f[] positions = [(0, 0, 0), (5, 0, 0), (9, 0, 0)]"


def test_instancers_show_their_prototypes_with_the_prototypes_own_place(tmp_path):
    found = parts_of(stage(tmp_path / "a.usda", moved("x", (0, 1, 0), instancer(POINTS, "</x/i/p>"))))
    assert len(found) == 1
    np.testing.assert_array_equal(found[0].vertices[::4], [(0, 1, 10), (5, 1, 10), (9, 1, 10)])


def test_instances_are_turned_scaled_and_masked(tmp_path):
    more = (
        f"{POINTS}\nquath[] orientations = [(1, 0, 0, 0), (0, 0, 0, 1), (1, 0, 0, 0)]\n"
        "float3[] scales = [(1, 1, 1), (2, 1, 1), (1, 1, 1)]\n"
        "int64[] ids = [7, 8, 9]\nint64[] invisibleIds = [9]"
    )
    found = parts_of(stage(tmp_path / "a.usda", instancer(more, body=mesh("p"))))[0].vertices
    assert len(found) == 8
    # Half a turn about Z after the scale.
    np.testing.assert_allclose(found[4:], [(5, 0, 0), (3, 0, 0), (3, -1, 0), (5, -1, 0)], atol=1e-12)


def test_instancers_of_instancers_multiply(tmp_path):
    inner = instancer(POINTS, "</i/p/i/q>", mesh("q"))
    outer = instancer(
        "int[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0), (0, 50, 0)]", body=xform("p", inner)
    )
    found = parts_of(stage(tmp_path / "a.usda", outer))[0].vertices[::4]
    np.testing.assert_array_equal(found, [(x, y, 0) for y in (0, 50) for x in (0, 5, 9)])


INTERPOLATIONS = {
    "constant": ([0.25], [0.25] * 6),
    "uniform": ([0.25, 0.5], [0.25] * 3 + [0.5] * 3),
    "vertex": ([0, 1, 2, 3], [0, 1, 2, 0, 2, 3]),
    "varying": ([0, 1, 2, 3], [0, 1, 2, 0, 2, 3]),
    "faceVarying": ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5]),
}


def two_triangles(more):
    return mesh(counts=[3, 3], indices=[0, 1, 2, 0, 2, 3], more=more)


@pytest.mark.parametrize("name", INTERPOLATIONS)
@pytest.mark.parametrize("indexed", [False, True])
def test_what_corners_carry_is_found_by_its_interpolation(tmp_path, name, indexed):
    values, expected = INTERPOLATIONS[name]
    order = list(range(len(values)))[::-1]
    given = [values[k] for k in order] if indexed else values
    colors = ", ".join(f"({value}, 0, 0)" for value in given)
    more = f'color3f[] primvars:displayColor = [{colors}] (interpolation = "{name}")'
    if indexed:
        more += f"\nint[] primvars:displayColor:indices = {order}"
    (part,) = parts_of(stage(tmp_path / "a.usda", two_triangles(more)))
    np.testing.assert_array_equal(part.colors[part.triangles.ravel(), 0], np.float32(expected))


def test_vertices_are_parted_only_where_corners_differ(tmp_path):
    colors = "[(0,0,0), (1,0,0), (2,0,0), (0,0,0), (2,0,0), (3,0,0)]"
    more = f'color3f[] primvars:displayColor = {colors} (interpolation = "faceVarying")'
    (part,) = parts_of(stage(tmp_path / "a.usda", two_triangles(more)))
    assert len(part.vertices) == 4


def test_constants_are_inherited(tmp_path):
    ops = 'color3f[] primvars:displayColor = [(0.5, 0, 0)] (interpolation = "constant")'
    (part,) = parts_of(stage(tmp_path / "a.usda", xform("x", mesh(), ops=ops)))
    np.testing.assert_array_equal(part.colors, [(0.5, 0, 0)] * 4)


def test_normals_of_the_primvar_come_before_the_others(tmp_path):
    more = (
        'normal3f[] normals = [(1, 0, 0)] (interpolation = "constant")\n'
        'normal3f[] primvars:normals = [(0, 0, 1), (0, 1, 0), (0, 0, 1), (0, 0, 1)] (interpolation = "vertex")'
    )
    (part,) = parts_of(stage(tmp_path / "a.usda", mesh(more=more)))
    np.testing.assert_array_equal(part.normals[:2], [(0, 0, 1), (0, 1, 0)])


def test_normals_go_by_the_inverse_transpose(tmp_path):
    more = 'normal3f[] normals = [(1, 1, 0)] (interpolation = "constant")'
    ops = "float3 xformOp:scale = (2, 1, 1)"
    path = stage(tmp_path / "a.usda", xform("x", mesh(more=more), ops=ops, order='"xformOp:scale"'))
    np.testing.assert_allclose(parts_of(path)[0].normals[0], (0.5, 1, 0))


def test_cages_of_subdivided_surfaces_and_other_shapes_are_spoken_of(tmp_path):
    path = stage(
        tmp_path / "a.usda",
        mesh().replace('"none"', '"catmullClark"'),
        'def BasisCurves "hair"\n{\n}',
        'def Camera "eye"\n{\n}',
    )
    assert notices(path) == (
        "1 BasisCurves prim left out",
        "1 camera left out",
        "subdivision surfaces drawn as the polygons of their cages ('subdivision' of the object refines them):"
        " /square",
    )


WRONG = {
    "points": (mesh(indices=[0, 1, 2, 4]), "/square.faceVertexIndices: names point 4 of 4 (expected 0 to 3)"),
    "below": (
        mesh(indices=[0, 1, 2, -1]),
        "/square.faceVertexIndices: names point -1 of 4 (expected 0 to 3)",
    ),
    "counts": (
        mesh(counts=[5], indices=[0, 1, 2, 3]),
        "/square.faceVertexIndices: has 4 indices (expected 5, the sum of faceVertexCounts)",
    ),
    "minus": (mesh(counts=[7, -3]), "/square.faceVertexCounts: has the count -3 (expected 0 or more)"),
    "few": (
        mesh(more='color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "vertex")'),
        "/square.primvars:displayColor: has 1 values (expected 4, as it is vertex)",
    ),
    "index": (
        mesh(
            more='color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "vertex")\n'
            "int[] primvars:displayColor:indices = [0, 0, 0, 1]"
        ),
        "/square.primvars:displayColor: has the index 1 of 1 values",
    ),
    "normals": (
        mesh(more='normal3f[] normals = [(1, 0, 0)] (interpolation = "faceVarying")'),
        "/square.normals: has 1 values (expected 4, as it is faceVarying)",
    ),
    "prototype": (
        instancer("int[] protoIndices = [1]\npoint3f[] positions = [(0, 0, 0)]"),
        "/i.protoIndices: names prototype 1 of 1",
    ),
    "positions": (
        instancer("int[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0)]"),
        "/i.positions: has 1 values for 2 protoIndices",
    ),
    "nowhere": (instancer(POINTS, "</gone>"), "/i.prototypes: names the prototype /gone, which is not there"),
    "itself": (
        xform("x", instancer(POINTS, "</x>")),
        "/x/i.prototypes: names what it is part of itself",
    ),
    "reference": (
        xform("x", meta="references = @gone.usda@"),
        "a.usda: Could not open asset @gone.usda@",
    ),
    "circle": (xform("x", meta="references = </x>"), "Cycle detected"),
    "text": ("def Mesh {{{", "a.usda:15:1: is no USD file that can be read: parse error"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_the_path_of_the_prim(tmp_path, name):
    body, words = WRONG[name]
    path = stage(tmp_path / "a.usda", mesh("good"), body)
    with pytest.raises(MeshError) as error:
        parts_of(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)


def test_instancers_that_ask_for_too_much_are_refused(tmp_path):
    count = 2000
    row = ", ".join(["0"] * count)
    at = ", ".join(["(0, 0, 0)"] * count)
    points = f"int[] protoIndices = [{row}]\npoint3f[] positions = [{at}]"
    inner = instancer(points, "</i/p/i/q>", mesh("q"))
    path = stage(tmp_path / "a.usda", instancer(points, body=xform("p", inner)))
    with pytest.raises(
        MeshError, match=r"/i/p/i: shows 4,000,000 instances of 'q' \(expected at most 2,097,152\)"
    ):
        parts_of(path)


def test_without_the_extra_it_is_named(tmp_path, monkeypatch):
    path = stage(tmp_path / "a.usda", mesh())
    monkeypatch.setitem(__import__("sys").modules, "pxr", None)
    with pytest.raises(
        MissingExtraError, match=r"A USD file needs usd-core, which is not installed .*\[usd\]"
    ):
        parts_of(path)


SHAPES = {
    "Cube": ("double size = 2", 8.0, (-1, -1, -1), (1, 1, 1)),
    "Sphere": ("double radius = 2", 4 / 3 * np.pi * 8, (-2, -2, -2), (2, 2, 2)),
    "Cylinder": (
        'double radius = 2\ndouble height = 6\nuniform token axis = "X"',
        np.pi * 4 * 6,
        (-3, -2, -2),
        (3, 2, 2),
    ),
    "Cone": (
        'double radius = 1\ndouble height = 4\nuniform token axis = "Y"',
        np.pi * 4 / 3,
        (-1, -2, -1),
        (1, 2, 1),
    ),
    "Capsule": (
        'double radius = 1\ndouble height = 4\nuniform token axis = "Z"',
        np.pi * (4 + 4 / 3),
        (-1, -1, -3),
        (1, 1, 3),
    ),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_shapes_by_formula_have_their_volume_size_and_front(tmp_path, kind):
    inputs, volume, least, most = SHAPES[kind]
    path = stage(tmp_path / "a.usda", moved("x", (5, 0, 0), f'def {kind} "s"\n{{\n{inputs}\n}}\n'))
    found = corners(path) - (5, 0, 0)
    np.testing.assert_allclose(found.min(axis=(0, 1)), least, atol=1e-5)
    np.testing.assert_allclose(found.max(axis=(0, 1)), most, atol=1e-5)
    a, b, c = np.moveaxis(found, 1, 0)
    # Positive by the divergence theorem where the front is outside; 96 sides hold 0.15 % less than a circle.
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(volume, rel=2e-3)


@pytest.mark.parametrize(("axis", "normal"), [("X", (1, 0, 0)), ("Y", (0, 1, 0)), ("Z", (0, 0, 1))])
def test_planes_face_along_their_axis(tmp_path, axis, normal):
    inputs = f'double width = 2\ndouble length = 3\nuniform token axis = "{axis}"'
    path = stage(tmp_path / "a.usda", f'def Plane "p"\n{{\n{inputs}\n}}\n')
    np.testing.assert_allclose(area(corners(path)), np.multiply(normal, 6))


def test_a_sphere_may_be_a_display(tmp_path):
    found = read_mesh(stage(tmp_path / "a.usda", 'def Sphere "s"\n{\n}\n'))
    assert found.count == 96 * 48


@pytest.mark.parametrize("far", ["nan", "inf", "1e300"])
def test_what_is_nowhere_is_dropped_from_scenes_and_refused_as_a_display(tmp_path, far):
    ops = f"double3 xformOp:translate = ({far}, 0, 0)\nfloat3 xformOp:scale = (1, 1, 1)"
    order = '"xformOp:translate", "xformOp:scale"'
    path = stage(tmp_path / "a.usda", mesh("here"), xform("x", mesh("gone"), ops=ops, order=order))
    scene = load_scene(path)
    assert len(scene.triangles) == 2
    assert "a: 2 triangles with NaN or infinite vertices dropped" in scene.notices
    with pytest.raises(MeshError, match=r"vertex 5 is \("):
        read_mesh(path)


def test_names_that_are_no_text_are_an_error(tmp_path):
    path = stage(tmp_path / "a.usda", mesh(**bound("m")), material("m", "token inputs:x = 'é'"))
    path.write_bytes(path.read_bytes().replace("é".encode(), b"\xe1("))
    with pytest.raises(MeshError, match="UTF-8"):
        parts_of(path)


def test_shapes_have_their_colours_and_those_above(tmp_path):
    ops = 'color3f[] primvars:displayColor = [(0.5, 0, 0)] (interpolation = "constant")'
    (part,) = parts_of(stage(tmp_path / "a.usda", xform("x", 'def Cube "c"\n{\n}\n', ops=ops)))
    np.testing.assert_array_equal(part.colors, [(0.5, 0, 0)] * len(part.vertices))


def test_sizes_of_shapes_that_make_no_sense_are_errors(tmp_path):
    path = stage(tmp_path / "a.usda", 'def Sphere "s"\n{\ndouble radius = -1\n}\n')
    with pytest.raises(MeshError, match=r"/s\.radius: is -1 \(expected a number, 0 or more\)"):
        parts_of(path)


CUBE = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
SIDES = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]


def cubic(folder, more=""):
    cage = mesh("cage", points=CUBE, counts=[4] * 6, indices=SIDES, more=more)
    return stage(folder / "a.usda", cage.replace('"none"', '"catmullClark"'), mesh("flat"))


def test_cages_are_refined_where_that_is_asked_for(tmp_path):
    asset = read_asset(cubic(tmp_path), 3)
    assert [len(part.triangles) for part in asset.parts] == [6 * 64 * 2, 2]
    assert asset.notices == ()
    assert np.linalg.norm(asset.parts[0].vertices, axis=1).max() < 0.9
    scene = tmp_path / "scene.yaml"
    scene.write_text("quilt_scene: 1\nobjects: [{mesh: a.usda, subdivision: 1}]\n")
    assert len(load_scene(scene).triangles) == 6 * 4 * 2 + 2


def test_creases_are_taken_and_checked(tmp_path):
    creases = (
        "int[] creaseIndices = [4, 5, 7, 6, 4]\nint[] creaseLengths = [5]\nfloat[] creaseSharpnesses = [10]\n"
        "int[] cornerIndices = [0]\nfloat[] cornerSharpnesses = [10]"
    )
    (part, _) = read_asset(cubic(tmp_path, creases), 2).parts
    assert part.vertices[:, 2].max() == 1
    np.testing.assert_array_equal(part.vertices[0], (-1, -1, -1))
    with pytest.raises(SceneError, match=r"/cage\.creaseLengths: sums up to 4 \(expected 5 creaseIndices"):
        read_asset(cubic(tmp_path, creases.replace("[5]", "[4]")), 2)
    with pytest.raises(SceneError, match=r"/cage\.creaseIndices: names point 9 of 8"):
        read_asset(cubic(tmp_path, creases.replace("4, 5, 7, 6, 4", "4, 5, 9, 6, 4")), 2)


def test_only_cages_can_be_refined(tmp_path):
    with pytest.raises(SceneError, match="has no subdivision surfaces that could be refined"):
        read_asset(stage(tmp_path / "a.usda", mesh()), 1)
