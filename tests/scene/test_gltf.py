"""glTF in scenes: what is drawn of it, what is said of the rest, and how it moves."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import SceneError
from quiltcli.job import load_scene_file
from quiltcli.scene import load_scene
from quiltcli.scene.bake import bake, reposed
from quiltcli.scene.importers.asset import read_asset
from quiltcli.scene.importers.gltf import Playing, gltf_parts, pose
from quiltcli.scene.importers.part import placed
from quiltcli.scene.lights import Directional, Point, Spot
from quiltcli.scene.movers import Mover
from tests.helpers.gltf_files import SQUARE, GltfFile, one_square

HEADLIGHT = ": a headlight at the viewer and a dim ambient light are used"
SUN = {"type": "directional", "intensity": 683 * 2, "color": [1, 0.5, 0]}
LAMP = {"type": "point", "intensity": 683 * 5}
SPOT = {"type": "spot"}


def lit(*lights, **lamp):
    """A square and lights, each at a node of its own."""
    file = one_square()
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": list(lights)}}
    for number in range(len(lights)):
        file.node(extensions={"KHR_lights_punctual": {"light": number}}, **lamp)
    return file


def scene_of(file, folder, text, name="m.glb"):
    file.write(folder / name)
    (folder / "scene.yaml").write_text(f"quilt_scene: 1\nobjects:\n- {{mesh: {name}{text}")
    return load_scene(folder / "scene.yaml")


def message(file, folder, text):
    with pytest.raises(SceneError) as caught:
        scene_of(file, folder, text)
    return str(caught.value).replace(f"{folder}/", "")


def test_a_file_is_drawn_as_it_says(tmp_path):
    file = GltfFile()
    color = file.accessor([(255, 0, 51, 255)] * 4, "u1", normalized=True)
    file.add("materials", pbrMetallicRoughness={"baseColorFactor": [0.5, 0.5, 0.0015, 1]})
    file.node(mesh=file.mesh(file.primitive(material=0, attributes={"COLOR_0": color})))
    scene = load_scene(file.write(tmp_path / "m.glb"))
    assert scene.materials.color.tolist() == np.array([[0.5, 0.5, 0.0015]], np.float32).tolist()
    assert scene.colors.tolist() == np.array([[1, 0, 0.2]] * 4, np.float32).tolist()
    assert scene.notices == (f"the scene has no lights{HEADLIGHT}",)


def test_texture_coordinates_go_up(tmp_path):
    file = GltfFile()
    sets = {f"TEXCOORD_{n}": file.accessor([(0, 0), (1, 0), (1, 0.25), (0, n)]) for n in (0, 1)}
    file.node(mesh=file.mesh(file.primitive(attributes=sets)))
    part = read_asset(file.write(tmp_path / "m.glb")).parts[0]
    assert part.uv.tolist() == [[0, 1], [1, 1], [1, 0.75], [0, 1]]
    assert part.uv1[3].tolist() == [0, 0]


# --- what is left out is said


def test_lights_that_nobody_asks_for_are_told_and_not_denied(tmp_path):
    scene = load_scene(lit(SUN, LAMP).write(tmp_path / "m.glb"))
    assert scene.notices == (
        "m: 2 lights of the file left out ('lights: file' takes them)",
        f"no lights are asked for{HEADLIGHT}",
    )
    scene = scene_of(lit(SUN), tmp_path, "}\nlights: [{type: ambient}]\n")
    assert scene.notices == ("m: 1 light of the file left out ('lights: file' takes them)",)


def test_cameras_animations_and_lines_are_told(tmp_path):
    file = one_square()
    file.node(camera=0)
    file.add("cameras", type="perspective")
    file.node(mesh=file.mesh(file.primitive(mode=1)))
    file.animation(0, "scale", [0, 1], [(1, 1, 1)] * 2)
    file.animation(0, "translation", [0, 1], [(0, 0, 0)] * 2)
    assert load_scene(file.write(tmp_path / "m.glb")).notices == (
        "m: 1 primitive of points or lines left out",
        "m: 1 camera left out",
        "m: 2 animations of the file not played ('animation' of the object plays them)",
        f"the scene has no lights{HEADLIGHT}",
    )


def test_check_says_what_is_left_out_and_finds_nothing_wrong(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene_of(lit(SUN), tmp_path, "}\nlights: [{type: ambient}]\n")
    result = CliRunner().invoke(main, ["check", "scene.yaml", "scene.yaml"])
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr.splitlines() == [
        "note: scene.yaml: m: 1 light of the file left out ('lights: file' takes them)",
        "2 files: nothing is wrong",
    ]


def test_a_file_of_lines_alone_has_no_triangles(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(file.primitive(mode=1)))
    with pytest.raises(SceneError, match="holds no triangles; 1 primitive of points or lines left out"):
        load_scene(file.write(tmp_path / "m.glb"))


# --- lights of files


def test_lights_of_the_file_stand_where_the_object_is(tmp_path):
    file = lit(SUN, LAMP, translation=[0, 1, 0])
    scene = scene_of(
        file, tmp_path, ", transform: {rotate_deg: [0, 90, 0], translate: [0, 0, 4]}}\nlights: file\n"
    )
    # A sun shines along -Z, which the object turns to -X; lux and candela are 683 times watts.
    sun, lamp = scene.lights
    assert isinstance(sun, Directional)
    assert sun.direction == pytest.approx(np.array([-1, 0, 0]), abs=1e-7)
    assert sun.color.tolist() == [2, 1, 0]
    assert isinstance(lamp, Point)
    assert (lamp.position.tolist(), lamp.color.tolist()) == ([0, 1, 4], [5, 5, 5])
    assert scene.notices == ()


def test_lights_of_the_file_beside_others_and_by_a_factor(tmp_path):
    text = "}\nlights:\n- {type: file, scale: 10}\n- {type: point, position: [0, 0, 0]}\n"
    scene = scene_of(lit(LAMP), tmp_path, text)
    assert [light.color.tolist() for light in scene.lights] == [[1, 1, 1], [50, 50, 50]]


def test_spots_ranges_and_shadows_of_the_file(tmp_path):
    scene = scene_of(lit({**SUN, "range": 3}, {**LAMP, "range": 4}, SPOT), tmp_path, "}\nlights: file\n")
    sun, lamp, spot = scene.lights
    assert scene.notices == ()
    assert (lamp.reach, spot.reach) == (4, np.inf)
    assert isinstance(spot, Spot)
    assert spot.direction == pytest.approx(np.array([0, 0, -1]))
    assert (spot.inner, spot.outer) == pytest.approx((1, np.cos(np.pi / 4)))
    assert not any(light.shadows for light in scene.lights)
    text = "}\nlights:\n- {type: file, shadows: true}\n- {type: point, position: [0, 0, 0]}\n"
    scene = scene_of(lit(SUN, LAMP, SPOT), tmp_path, text)
    assert [light.shadows for light in scene.lights] == [False, True, True, True]
    del sun


def test_a_file_without_lamps_is_lit_by_the_headlight(tmp_path):
    scene = scene_of(one_square(), tmp_path, "}\nlights: file\n")
    assert [light.kind for light in scene.lights] == ["ambient", "headlight"]
    assert scene.notices == (f"the scene has no lights{HEADLIGHT}",)


# --- animation


def moving():
    file = one_square()
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (4, 0, 0)], name="slide")
    file.animation(0, "translation", [0, 2], [(0, 0, 0), (0, 8, 0)], name="rise")
    return file


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("{clip: slide}", [0, 0, 0]),
        ("{clip: slide, offset: 1}", [2, 0, 0]),
        ("{clip: [rise], offset: 1}", [0, 4, 0]),
        ("{clip: rise, offset: 2.5, after: bounce}", [0, 6, 0]),
    ],
)
def test_an_object_begins_where_its_animation_does(tmp_path, keys, expected):
    scene = scene_of(moving(), tmp_path, f", animation: {keys}}}\nlights: [{{type: ambient}}]\n")
    assert scene.vertices.min(axis=0).tolist() == expected
    assert scene.notices == ()


def test_channels_that_two_clips_move_are_told(tmp_path):
    scene = scene_of(moving(), tmp_path, ", animation: {}}\nlights: [{type: ambient}]\n")
    assert scene.notices == ("m: animated by two clips at once (the first counts): 1 channel",)


def test_an_animation_that_is_not_there(tmp_path):
    place = "scene.yaml:3:28: objects[0].animation: m.glb: "
    found = message(moving(), tmp_path, ", animation: {clip: turn}}\n")
    assert found == f"{place}has no animation 'turn' (expected all, 'slide', 'rise')"
    assert message(one_square(), tmp_path, ", animation: {}}\n") == f"{place}has no animation"


def test_the_time_of_a_frame(tmp_path):
    scene_of(moving(), tmp_path, ", animation: {start_frame: 10, offset: 0.5, speed: 2}}\n")
    spec = load_scene_file(tmp_path / "scene.yaml").objects[0].animation
    assert spec is not None
    assert (spec.seconds(10, 24), spec.seconds(34, 24), spec.seconds(4, 24)) == (0.5, 2.5, 0)


# --- objects that move


def bent(*, normals: bool):
    """A folded strip, whose one half a node turns."""
    file = GltfFile()
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0.1), (0, 1, 0.1), (1, 1, 0.1), (1, 2, 2), (0, 2, 2)]
    order = [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]
    attributes = {"NORMAL": file.accessor([(0, 0, 1)] * 8)} if normals else {}
    file.node(mesh=file.mesh(file.primitive(points, order, attributes=attributes)))
    file.animation(0, "rotation", [0, 1], [(0, 0, 0, 1), (1, 0, 0, 0)])
    return file


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize("mode", ["auto", "smooth"])
def test_an_object_posed_anew_is_the_object_baked_in_that_pose(tmp_path, normals, mode):
    model = read_asset(bent(normals=normals).write(tmp_path / "m.glb")).model
    still = bake(gltf_parts(model, 0.0), mode)
    for time in (0.0, 0.3, 1.0):
        expected = bake(gltf_parts(model, time), mode)
        vertices, found = reposed(still, *pose(model, time))
        np.testing.assert_array_equal(still.triangles, expected.triangles)
        np.testing.assert_array_equal(vertices, expected.vertices)
        np.testing.assert_allclose(found, expected.normals, atol=1e-6)


@pytest.mark.parametrize("matrix", [None, np.diag([-2.0, 2, 2, 1])])
def test_a_mover_is_the_object_placed_in_the_world(tmp_path, matrix):
    model = read_asset(bent(normals=False).write(tmp_path / "m.glb")).model

    def world(time):
        parts = gltf_parts(model, time)
        return bake(parts if matrix is None else [placed(part, matrix) for part in parts])

    mover = Mover(model, Playing(), matrix, world(0.0))
    for time in (0.0, 0.5, 2.0):
        vertices, normals = mover.at(time)
        np.testing.assert_array_equal(vertices, world(time).vertices)
        np.testing.assert_allclose(normals, world(time).normals, atol=1e-6)


def test_parts_without_normals_beside_parts_with_some(tmp_path):
    file = GltfFile()
    normal = file.accessor([(0, 1, 0)] * 4)
    file.node(mesh=file.mesh(file.primitive(attributes={"NORMAL": normal}), file.primitive()))
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (0, 0, 3)])
    model = read_asset(file.write(tmp_path / "m.glb")).model
    still = bake(gltf_parts(model), "auto")
    vertices, normals = reposed(still, *pose(model, 1.0))
    assert vertices[:, 2].tolist() == [3] * 8
    assert normals.tolist() == [[0, 1, 0]] * 4 + [[0, 0, 1]] * 4


def test_a_mirrored_copy_stays_out_side_out_when_the_object_mirrors_too(tmp_path):
    part = read_asset(one_square(scale=[-1, 1, 1]).write(tmp_path / "m.glb")).parts[0]
    twice = placed(part, np.diag([-1.0, 1, 1, 1]))
    assert twice.mirrored
    corners = twice.vertices[twice.triangles[:, ::-1]]
    assert np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].tolist() == [1, 1]
    assert sorted(map(tuple, twice.vertices.tolist())) == sorted(SQUARE)
