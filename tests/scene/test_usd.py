"""USD in scenes: the same pixels as glTF, what is said of the rest, how it moves, what a hash knows."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import SceneError
from quiltcli.formats.exr.image import read_exr
from quiltcli.formats.mesh import read_mesh
from quiltcli.job import load_job, load_scene_file
from quiltcli.job.digest import file_sha256
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.scene import load_scene
from quiltcli.scene.environment.maps import turned_maps
from quiltcli.scene.lights import Ambient, Area, Directional, Environment, Point
from quiltcli.scene.motion import load_moving_scene
from tests.helpers.gltf_files import GltfFile
from tests.helpers.usd_files import bound, material, mesh, moved, needs_usd, stage, xform

needs_usd()
HEADLIGHT = ": a headlight at the viewer and a dim ambient light are used"
SLIDE = "double3 xformOp:translate.timeSamples = {0: (0, 0, 0), 24: (24, 0, 0)}"
BLINK = 'token visibility.timeSamples = {0: "inherited", 10: "invisible", 20: "inherited"}'


def scene_file(folder, text, lights=""):
    path = folder / "scene.yaml"
    path.write_text(f"quilt_scene: 1\nobjects:\n- {{{text}}}\n{lights}\n")
    return load_scene_file(path)


def moving(folder, text, lights=""):
    return load_moving_scene(scene_file(folder, text, lights), 24)


def sliding(body, ops=SLIDE):
    return xform("x", body, ops=ops, order='"xformOp:translate"')


def test_what_is_left_out_is_said(tmp_path):
    path = stage(
        tmp_path / "m.usda",
        sliding(mesh()),
        'def Camera "eye"\n{\n}',
        'def SphereLight "lamp"\n{\n}',
    )
    assert load_scene(path).notices == (
        "m: 1 camera left out",
        "m: 1 animation of the file not played ('animation' of the object plays them)",
        "m: 1 light of the file left out ('lights: file' takes them)",
        f"no lights are asked for{HEADLIGHT}",
    )


def test_an_object_is_in_metres_before_its_own_units(tmp_path):
    stage(tmp_path / "m.usda", mesh(), metersPerUnit=0.01)
    scene = load_scene(scene_file(tmp_path, "mesh: m.usda, units: 10"))
    np.testing.assert_allclose(np.ptp(scene.vertices, axis=0), (0.1, 0.1, 0))


def test_lights_of_all_kinds_are_taken_when_they_are_asked_for(tmp_path):
    Image.new("RGB", (8, 4), (255, 255, 255)).save(tmp_path / "sky.png")
    stage(
        tmp_path / "m.usda",
        mesh(),
        moved("a", (0, 1, 0), 'def RectLight "light"\n{\n}'),
        'def DistantLight "sun"\n{\nbool inputs:normalize = true\nfloat inputs:intensity = 3\n}',
        'def SphereLight "lamp"\n{\n}',
        'def DomeLight "all"\n{\n}',
        'def DomeLight "sky"\n{\nasset inputs:texture:file = @sky.png@\n}',
    )
    scene = load_scene(
        scene_file(tmp_path, "mesh: m.usda", "lights: [{type: file, scale: 2, shadows: true}]")
    )
    kinds = [type(light) for light in scene.lights]
    assert sorted(kinds, key=str) == sorted((Area, Directional, Point, Ambient, Environment), key=str)
    sun = scene.lights[kinds.index(Directional)]
    assert sun.color.tolist() == [6, 6, 6]
    assert sun.shadows


def test_a_panorama_may_be_turned_any_way():
    picture = np.zeros((16, 32, 3), np.float32)
    picture[:8] = 1  # light from above, in the panorama
    # Its top is the world's +X.
    maps = turned_maps(picture, np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    size = len(maps.diffuse)
    middle = size // 2
    assert maps.diffuse[middle, size - 1, 0] == pytest.approx(1, abs=1e-3)
    assert maps.diffuse[middle, 0, 0] == pytest.approx(0, abs=1e-3)


def test_frames_are_time_codes_where_both_have_one_rate(tmp_path):
    stage(tmp_path / "m.usda", sliding(mesh()), timeCodesPerSecond=24)
    base, source = moving(tmp_path, "mesh: m.usda, animation: {}")
    assert base.vertices[0, 0] == 0
    assert source.scene_at(7).vertices[0, 0] == 7
    assert source.scene_at(7).triangles is base.triangles


def test_what_disappears_comes_back(tmp_path):
    stage(tmp_path / "m.usda", mesh("still"), xform("x", moved("y", (5, 0, 0), mesh()), ops=BLINK))
    base, source = moving(tmp_path, "mesh: m.usda, animation: {}")
    assert [len(source.scene_at(frame).triangles) for frame in (0, 9, 10, 19, 20)] == [4, 4, 2, 2, 4]
    np.testing.assert_array_equal(source.scene_at(20).vertices, base.vertices)


def test_an_object_that_disappears_altogether_leaves_a_point(tmp_path):
    stage(tmp_path / "m.usda", xform("x", mesh(), ops=BLINK))
    _, source = moving(tmp_path, "mesh: m.usda, animation: {}")
    for frame in (10, 19):
        assert not np.ptp(source.scene_at(frame).vertices, axis=0).any()
    assert np.ptp(source.scene_at(20).vertices, axis=0).any()


def test_an_object_may_begin_unseen(tmp_path):
    stage(tmp_path / "m.usda", xform("x", mesh(), ops=BLINK))
    base, source = moving(tmp_path, "mesh: m.usda, animation: {start_frame: -12}")
    assert np.ptp(base.vertices, axis=0).any()  # as it begins, at frame -12
    assert not np.ptp(source.scene_at(0).vertices, axis=0).any()
    base, source = moving(tmp_path, "mesh: m.usda, animation: {offset: 0.5}")
    assert not np.ptp(base.vertices, axis=0).any()
    assert np.ptp(source.scene_at(8).vertices, axis=0).any()


def test_a_scene_asks_for_an_animation_that_is_there(tmp_path):
    stage(tmp_path / "m.usda", mesh())
    with pytest.raises(
        SceneError, match=r"scene.yaml:3:.*: objects\[0\].animation: .*m.usda: has no animation"
    ):
        moving(tmp_path, "mesh: m.usda, animation: {}")


def test_numbered_stages_are_a_sequence(tmp_path):
    for number in (1, 2):
        stage(tmp_path / f"m.{number:02d}.usda", moved("x", (number, 0, 0), mesh()))
    _, source = moving(tmp_path, "mesh: m.##.usda, frames: 1-2")
    assert [source.scene_at(frame).vertices[0, 0] for frame in (1, 2)] == [1, 2]


def test_errors_name_the_key_of_the_scene_and_the_prim(tmp_path):
    stage(tmp_path / "m.usda", mesh(indices=[0, 1, 2, 9]))
    with pytest.raises(SceneError) as error:
        moving(tmp_path, "mesh: m.usda")
    words = "m.usda: /square.faceVertexIndices: names point 9 of 4 (expected 0 to 3)"
    assert str(error.value).replace(f"{tmp_path}/", "") == f"scene.yaml:3:10: objects[0].mesh: {words}"


def test_the_hash_of_a_job_knows_layers_and_pictures(tmp_path):
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    nodes = 'def Shader "t"\n{\nuniform token info:id = "UsdUVTexture"\nasset inputs:file = @./a.png@\n}'
    stage(tmp_path / "part.usda", material("m", nodes=nodes), mesh())
    whole = stage(tmp_path / "m.usda", subLayers="[@./part.usda@]")
    first = file_sha256(whole)
    assert first == file_sha256(whole)
    Image.new("RGB", (2, 2), (1, 1, 1)).save(tmp_path / "a.png")
    second = file_sha256(whole)
    stage(tmp_path / "part.usda", material("m", nodes=nodes), mesh("other"))
    assert len({first, second, file_sha256(whole)}) == 3


def test_the_polygons_of_a_stage_may_be_a_display(tmp_path):
    five = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 3, 0), (0, 2, 0)]
    ops = "float3 xformOp:scale = (-1, 1, 1)"
    path = stage(
        tmp_path / "m.usda",
        mesh("a", points=five, counts=[5]),
        xform("x", mesh("b"), ops=ops, order='"xformOp:scale"'),
    )
    found = read_mesh(path)
    assert np.diff(found.corner_start).tolist() == [5, 4]
    np.testing.assert_array_equal(
        found.vertices[found.corners[5:]], [(0, 0, 0), (0, 1, 0), (-1, 1, 0), (-1, 0, 0)]
    )


ROOM = """
quilt_job: 1
display: display.yaml
scene: SCENE
frames: 6
fps: 24
viewer: {near: 0.05, far: 50, path: {keyframes: [{frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}]}}
output: {directory: OUT}
"""


def pictures(folder, name, text):
    """The page of frame 6 of a wall that shows a mesh."""
    (folder / "display.yaml").write_text(
        "quilt_display: 1\npanels: [{pixels: [96, 64], size: [3, 2], at: [0, 0, 0]}]\n"
    )
    (folder / f"{name}.yaml").write_text(f"quilt_scene: 1\nobjects: [{{{text}}}]\nlights: [{{type: file}}]\n")
    job = folder / f"{name}_job.yaml"
    job.write_text(ROOM.replace("SCENE", f"{name}.yaml").replace("OUT", f"out_{name}"))
    render(load_job(job), RenderOptions(threads=1))
    return read_exr(folder / f"out_{name}" / "quilt" / "page_01.0006.exr")


def test_a_stage_and_the_same_scene_as_gltf_are_the_same_pixels(tmp_path):
    rng = np.random.default_rng(1)
    Image.fromarray(rng.integers(0, 255, (16, 16, 3), dtype=np.uint8)).save(tmp_path / "a.png")
    points = (rng.uniform(-1, 1, (36, 3)) * (1.5, 1, 1)).astype(np.float32)
    uv = rng.uniform(0, 2, (36, 2)).astype(np.float32)
    normals = rng.uniform(-1, 1, (36, 3)).astype(np.float32) + np.float32((0, 0, 2))
    triangles = np.arange(36).reshape(-1, 3)

    file = GltfFile()
    file.add("images", uri="a.png")
    file.add("textures", source=0)
    file.add(
        "materials",
        pbrMetallicRoughness={
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0.25,
            "roughnessFactor": 0.5,
        },
        emissiveFactor=[0.125, 0, 0],
    )
    flipped = uv * (1, -1) + np.float32((0, 1))
    attributes = {"NORMAL": file.accessor(normals), "TEXCOORD_0": file.accessor(flipped.astype(np.float32))}
    shown = file.mesh(file.primitive(points, triangles.ravel(), material=0, attributes=attributes))
    node = file.node(mesh=shown)
    file.animation(node, "translation", [0, 1], [(0, 0, -1), (1, 0, -1)])
    light = {"type": "directional", "intensity": 683 * 2}
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    file.node(extensions={"KHR_lights_punctual": {"light": 0}})
    file.write(tmp_path / "m.glb")

    texture = (
        'def Shader "t"\n{\nuniform token info:id = "UsdUVTexture"\nasset inputs:file = @./a.png@\n'
        'token inputs:wrapS = "repeat"\ntoken inputs:wrapT = "repeat"\n'
        "float2 inputs:st.connect = </m/st.outputs:result>\nfloat3 outputs:rgb\n}\n"
        'def Shader "st"\n{\nuniform token info:id = "UsdPrimvarReader_float2"\n'
        'string inputs:varname = "st"\n'
        "float2 outputs:result\n}"
    )
    looks = bound("m")

    def rows(values):
        return [tuple(float(v) for v in row) for row in values]

    looks["more"] += (
        f'\nnormal3f[] normals = {rows(normals)} (interpolation = "vertex")'
        f'\ntexCoord2f[] primvars:st = {rows(uv)} (interpolation = "vertex")'
    )
    stage(
        tmp_path / "m.usda",
        material(
            "m",
            "color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>",
            "float inputs:metallic = 0.25",
            "color3f inputs:emissiveColor = (0.125, 0, 0)",
            nodes=texture,
        ),
        xform(
            "x",
            mesh(points=rows(points), counts=[3] * 12, **looks),
            ops="double3 xformOp:translate.timeSamples = {0: (0, 0, -1), 24: (1, 0, -1)}",
            order='"xformOp:translate"',
        ),
        'def DistantLight "sun"\n{\nbool inputs:normalize = true\nfloat inputs:intensity = 2\n}',
        timeCodesPerSecond=24,
    )
    one = pictures(tmp_path, "gltf", "mesh: m.glb, animation: {}")
    other = pictures(tmp_path, "usd", "mesh: m.usda, animation: {}")
    assert one.channels.keys() == other.channels.keys()
    for name, values in one.channels.items():
        np.testing.assert_array_equal(values, other.channels[name], err_msg=name)
    assert np.isfinite(one.channels["Z"]).mean() > 0.1
