"""Loading scenes: every format, placement, materials, lights and notices."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
import trimesh
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from quiltcli.job import load_scene_file
from quiltcli.scene import load_scene

HEADLIGHT = "the scene has no lights: a headlight at the viewer and a dim ambient light are used"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def write(path, content):
    path.write_bytes(content) if isinstance(content, bytes) else path.write_text(content)
    return path


def scene_of(tmp_path, text, **meshes):
    """Load a scene file whose meshes stand beside it."""
    for name, content in meshes.items():
        write(tmp_path / f"{name}.obj", content)
    return load_scene(write(tmp_path / "scene.yaml", "quilt_scene: 1\n" + text))


def save(mesh, path):
    """Write a mesh; glTF as text with its buffers beside it."""
    if path.suffix != ".gltf":
        mesh.export(path)
        return
    for name, content in trimesh.Scene(mesh).export(file_type="gltf").items():
        write(path if name == "model.gltf" else path.with_name(name), content)


def areas(scene):
    a, b, c = (scene.vertices[scene.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "stl", "glb", "gltf"])
def test_every_format_holds_the_same_box(tmp_path, suffix):
    save(trimesh.creation.box((1, 2, 3)), tmp_path / f"box.{suffix}")
    scene = load_scene(tmp_path / f"box.{suffix}")
    assert scene.triangles.shape == (12, 3)
    assert scene.vertices.shape == (24, 3)
    assert scene.vertices.min(axis=0).tolist() == [-0.5, -1, -1.5]
    assert np.linalg.norm(areas(scene), axis=1).sum() == pytest.approx(22, rel=1e-6)
    # Winding and normals look outward.
    middle = scene.vertices[scene.triangles].mean(axis=1)
    assert ((areas(scene) * middle).sum(axis=1) > 0).all()
    own = areas(scene) / np.linalg.norm(areas(scene), axis=1)[:, None]
    assert scene.normals[scene.triangles] == pytest.approx(np.repeat(own[:, None], 3, axis=1), abs=1e-6)


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_normals_of_the_file_are_kept(tmp_path, suffix):
    box = trimesh.creation.box()
    bent = box.vertices / np.linalg.norm(box.vertices, axis=1)[:, None]
    trimesh.Trimesh(box.vertices, box.faces, vertex_normals=bent, process=False).export(
        tmp_path / f"b.{suffix}"
    )
    scene = load_scene(tmp_path / f"b.{suffix}")
    assert scene.vertices.shape == (8, 3)
    np.testing.assert_allclose(scene.normals, scene.vertices / math.sqrt(0.75), rtol=1e-5)


def test_polygons_become_fans(tmp_path):
    pentagon = "OFF\n5 1 0\n0 0 0\n1 0 0\n1 1 0\n.5 2 0\n0 1 0\n5 0 1 2 3 4\n"
    assert areas(load_scene(write(tmp_path / "p.off", pentagon))).sum(axis=0).tolist() == [0, 0, 1.5]


def test_binary_ply_may_mix_polygons(tmp_path):
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 2, 0], [0, 1, 0]], "<f4").tobytes()
    faces = struct.pack("<B3i", 3, 0, 1, 2) + struct.pack("<B4i", 4, 0, 2, 3, 4)
    scene = load_scene(write(tmp_path / "mixed.ply", head.encode() + points + faces))
    assert areas(scene).sum(axis=0).tolist() == [0, 0, 1.5]


def test_a_mesh_alone_is_one_object_under_a_headlight(tmp_path):
    scene = load_scene(write(tmp_path / "flag.obj", TRIANGLE))
    assert scene.objects == ("flag",)
    assert [light.kind for light in scene.lights] == ["ambient", "headlight"]
    assert scene.lights[0].color == pytest.approx([0.1] * 3)
    assert scene.background.tolist() == [0, 0, 0]
    assert scene.notices == (HEADLIGHT,)
    assert scene.vertices.dtype == np.float64
    assert scene.triangles.dtype == np.int32
    assert scene.normals.dtype == scene.colors.dtype == np.float32


def test_instances_are_baked(tmp_path):
    instances = trimesh.Scene()
    ball = trimesh.creation.icosphere(1)
    instances.add_geometry(ball, node_name="a", geom_name="ball")
    for name, shift in (("b", 5), ("c", -7)):
        place = trimesh.transformations.translation_matrix([shift, 0, 0])
        instances.graph.update(name, "world", matrix=place, geometry="ball")
    instances.export(tmp_path / "balls.glb")
    scene = load_scene(tmp_path / "balls.glb")
    assert scene.triangles.shape == (240, 3)
    assert scene.vertices[:, 0].min() == pytest.approx(-8)
    assert scene.vertices[:, 0].max() == pytest.approx(6)
    again = load_scene(tmp_path / "balls.glb")
    np.testing.assert_array_equal(scene.vertices, again.vertices)


def test_transform_scales_then_rotates_then_moves(tmp_path):
    text = "objects:\n- {mesh: a.obj, transform: {scale: 2, rotate_deg: [90, 0, 90], translate: [1, 2, 3]}}\n"
    scene = scene_of(tmp_path, text, a=TRIANGLE)
    # (0, 1, 0) · 2 about X becomes (0, 0, 2); (1, 0, 0) · 2 about Z becomes (0, 2, 0).
    expected = [[1, 2, 3], [1, 4, 3], [1, 2, 5]]
    np.testing.assert_allclose(scene.vertices, expected, atol=1e-15)


def test_mirroring_keeps_the_outside_out(tmp_path):
    matrix = "[[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
    trimesh.creation.icosphere(1).export(tmp_path / "ball.obj", include_normals=True)
    scene = scene_of(tmp_path, f"objects:\n- {{mesh: ball.obj, transform: {{matrix: {matrix}}}}}\n")
    middle = scene.vertices[scene.triangles].mean(axis=1)
    assert ((areas(scene) * middle).sum(axis=1) > 0).all()
    assert (scene.normals * scene.vertices).sum(axis=1) == pytest.approx(1, abs=1e-5)


def test_normals_under_uneven_scale_stay_upright(tmp_path):
    slope = "v 0 0 0\nv 1 1 0\nv 0 0 1\nvn -1 1 0\nf 1//1 3//1 2//1\n"
    text = "objects:\n- {mesh: a.obj, transform: {scale: [2, 1, 1]}}\n"
    normal = scene_of(tmp_path, text, a=slope).normals[0]
    assert normal == pytest.approx(np.array([-1, 2, 0]) / math.sqrt(5), abs=1e-6)


def test_several_objects_keep_their_names_and_materials(tmp_path):
    text = (
        "objects:\n"
        "- {name: one, mesh: a.obj, material: {color: [1, 0, 0]}}\n"
        "- {mesh: a.obj, material: {metallic: 1, roughness: 0.25, emission: [0, 0, 2]}, normals: flat}\n"
        "- {name: three, mesh: a.obj, material: {color: [1, 0, 0], unlit: false}}\n"
    )
    scene = scene_of(tmp_path, text, a=TRIANGLE)
    assert scene.objects == ("one", "a", "three")
    assert scene.object.tolist() == [0, 1, 2]
    assert scene.material.tolist() == [0, 1, 0]
    assert scene.flat.tolist() == [False, True, False]
    assert scene.materials.color == pytest.approx(np.array([[1, 0, 0], [0.8, 0.8, 0.8]]))
    assert scene.materials.roughness.tolist() == [0.5, 0.25]
    assert scene.materials.metallic.tolist() == [0, 1]
    assert scene.materials.emission.tolist() == [[0, 0, 0], [0, 0, 2]]


def test_lights_and_background(tmp_path):
    text = (
        "objects:\n- mesh: a.obj\n"
        "lights:\n"
        "- {type: directional, direction: [0, -2, 0], color: [3, 2, 1]}\n"
        "- {type: point, position: [1, 2, 3], color: [20, 20, 20]}\n"
        "- {type: ambient, color: [0.25, 0.25, 0.5]}\n"
        "- {type: ambient, color: [0.25, 0, 0]}\n"
        "background: [0, 0.5, 1]\n"
    )
    scene = scene_of(tmp_path, text, a=TRIANGLE)
    around, sun, lamp = scene.lights
    assert [light.kind for light in scene.lights] == ["ambient", "directional", "point"]
    assert sun.direction.tolist() == [0, -1, 0]
    assert sun.color.tolist() == [3, 2, 1]
    assert lamp.position.tolist() == [1, 2, 3]
    assert lamp.color.tolist() == [20, 20, 20]
    assert around.color.tolist() == [0.5, 0.25, 0.5]
    assert scene.background.tolist() == [0, 0.5, 1]
    assert scene.notices == ()


def test_a_scene_may_be_given_as_its_model(tmp_path):
    write(tmp_path / "a.obj", TRIANGLE)
    model = load_scene_file(write(tmp_path / "s.yaml", "quilt_scene: 1\nobjects:\n- mesh: a.obj\n"))
    assert load_scene(model).objects == ("a",)


def test_obj_materials_are_linear_and_not_rounded(tmp_path):
    write(tmp_path / "m.mtl", "newmtl red\nKd 0.7131 0.1 0\nNs 98\nKe 0 0 1\n")
    scene = load_scene(write(tmp_path / "m.obj", "mtllib m.mtl\nusemtl red\n" + TRIANGLE))
    assert scene.materials.color[0] == pytest.approx([0.7131, 0.1, 0])
    assert scene.materials.roughness[0] == pytest.approx((2 / 100) ** 0.25)
    assert scene.materials.emission[0].tolist() == [0, 0, 1]


def test_gltf_materials_and_textures(tmp_path):
    from PIL import Image

    material = PBRMaterial(
        baseColorFactor=[0.2, 0.4, 0.6, 1.0], metallicFactor=0.25, emissiveFactor=[1, 0, 0],
        baseColorTexture=Image.new("RGB", (2, 2)),
    )  # fmt: skip
    ball = trimesh.creation.icosphere(1)
    ball.visual = TextureVisuals(uv=ball.vertices[:, :2], material=material)
    ball.export(tmp_path / "ball.glb")
    scene = load_scene(tmp_path / "ball.glb")
    assert scene.materials.color[0] == pytest.approx([0.2, 0.4, 0.6], abs=1 / 255)
    assert scene.materials.metallic[0] == 0.25
    assert scene.materials.roughness[0] == 1
    assert scene.materials.emission[0].tolist() == [1, 0, 0]
    assert scene.notices == (HEADLIGHT,)
    (texture,) = scene.materials.textures[0]
    assert (texture.role, texture.picture.size("").width) == ("color", 2)


def test_textures_that_are_not_drawn_are_counted_once(tmp_path):
    write(tmp_path / "m.mtl", "newmtl a\nmap_Ks one.png\nnewmtl b\nmap_Ks two.png\ndisp three.png\n")
    text = (
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n"
    )
    scene = load_scene(write(tmp_path / "m.obj", text))
    assert scene.notices[0] == "m: 3 textures not drawn (displacement, specular)"


def test_texture_coordinates_alone_are_no_texture(tmp_path):
    scene = load_scene(write(tmp_path / "m.obj", "vt 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n"))
    assert scene.notices == (HEADLIGHT,)
    assert scene.materials.color[0] == pytest.approx([0.8] * 3)


def test_a_missing_material_file_is_told(tmp_path):
    scene = load_scene(write(tmp_path / "m.obj", "mtllib gone.mtl\nusemtl red\n" + TRIANGLE))
    assert scene.notices[0] == "m: the material file 'gone.mtl' is missing (default materials used)"


@pytest.mark.parametrize(("suffix", "expected"), [("ply", 0.21586), ("obj", 0.21586), ("glb", 128 / 255)])
def test_vertex_colors_are_srgb_but_linear_in_gltf(tmp_path, suffix, expected):
    ball = trimesh.creation.icosphere(1)
    ball.visual.vertex_colors = [255, 128, 0, 255]
    ball.export(tmp_path / f"ball.{suffix}")
    scene = load_scene(tmp_path / f"ball.{suffix}")
    assert scene.colors == pytest.approx(np.tile([1, expected, 0], (len(scene.vertices), 1)), abs=1e-4)
    assert scene.materials.color[0].tolist() == [1, 1, 1]


def test_a_color_in_the_scene_file_replaces_vertex_colors(tmp_path):
    colored = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"
    text = (
        "objects:\n- {mesh: a.obj, material: {color: [0, 0, 0]}}\n- {mesh: a.obj, material: {metallic: 1}}\n"
    )
    scene = scene_of(tmp_path, text, a=colored)
    assert scene.colors.tolist() == [[1, 1, 1]] * 3 + [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_what_cannot_be_drawn_is_dropped_and_counted(tmp_path):
    points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv inf 0 0\nv 2 0 0\n"
    broken = points + "f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 6\n"
    scene = load_scene(write(tmp_path / "b.obj", broken))
    assert scene.triangles.tolist() == [[0, 1, 2]]
    assert np.isfinite(scene.vertices).all()
    assert scene.notices == (
        "b: 2 triangles with NaN or infinite vertices dropped",
        "b: 1 triangle of no area dropped",
        HEADLIGHT,
    )


def test_nothing_is_said_on_the_side(tmp_path, capfd):
    write(tmp_path / "m.mtl", "newmtl a\nmap_Ks gone.png\n")
    load_scene(write(tmp_path / "m.obj", "mtllib m.mtl\nmtllib gone.mtl\nusemtl a\n" + TRIANGLE))
    assert capfd.readouterr() == ("", "")
