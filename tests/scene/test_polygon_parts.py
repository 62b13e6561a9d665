"""What scenes make of polygon meshes: vertices parted, materials, colours, texture coordinates, areas."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import SceneError
from quiltcli.scene import load_scene
from quiltcli.scene.importers.asset import read_asset

SQUARE = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n"
U = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 8\n"
XYZ = "property float x\nproperty float y\nproperty float z\n"


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return path


def area(scene):
    a, b, c = np.moveaxis(scene.vertices[scene.triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def positions(scene):
    return scene.vertices[scene.triangles].tolist()


def test_notches_and_windows_stay_open(tmp_path):
    scene = load_scene(written(tmp_path, "u.obj", U))
    assert area(scene) == pytest.approx(7)
    assert (scene.coverage.faces, scene.coverage.wrong, scene.coverage.triangle_area) == (1, 0, 7)
    hole = SQUARE + "v 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n"
    assert area(load_scene(written(tmp_path, "hole.obj", hole))) == pytest.approx(12)
    off = "OFF\n8 1 0\n" + U.rpartition("f")[0].replace("v ", "") + "8 0 1 2 3 4 5 6 7\n"
    assert area(load_scene(written(tmp_path, "u.off", off))) == pytest.approx(7)


def test_quadrilaterals_alone_come_in_halves(tmp_path):
    a, b, c, d = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    scene = load_scene(written(tmp_path, "m.obj", SQUARE + "f 1 2 3 4\nf 4 3 2 1\n"))
    assert positions(scene) == [[a, b, c], [d, c, b], [c, d, a], [b, a, d]]
    scene = load_scene(written(tmp_path, "m.obj", SQUARE + "f 1 2 3 4\nf 3 2 1\n"))
    assert positions(scene) == [[a, b, c], [c, d, a], [c, b, a]]


def test_vertices_are_parted_where_their_corners_differ(tmp_path):
    text = SQUARE + "vt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/1\n"
    scene = load_scene(written(tmp_path, "m.obj", text))
    assert len(scene.vertices) == 5
    assert scene.uv is not None
    corner = scene.uv[scene.triangles]
    assert corner.tolist() == [[[0, 0]] * 3, [[0, 0], [1, 1], [0, 0]]]
    # Without normals of the file, too.
    bare = text.replace("/1 ", " ").replace("/1\n", "\n").replace("vn 0 0 1\n", "")
    scene = load_scene(written(tmp_path, "m.obj", bare))
    assert scene.uv is not None
    assert scene.uv[scene.triangles].tolist() == corner.tolist()


def test_objects_without_texture_coordinates_have_none(tmp_path):
    written(tmp_path, "a.obj", SQUARE + "vt 0 1\nf 1/1 2/1 3/1\n")
    written(tmp_path, "b.obj", SQUARE + "f 1 2 3\n")
    scene = load_scene(
        written(tmp_path, "s.yaml", "quilt_scene: 1\nobjects:\n- mesh: a.obj\n- mesh: b.obj\n")
    )
    np.testing.assert_array_equal(scene.uv, [[0, 1]] * 3 + [[np.nan, np.nan]] * 3)
    scene = load_scene(written(tmp_path, "s.yaml", "quilt_scene: 1\nobjects:\n- mesh: b.obj\n"))
    assert scene.uv is None


def test_images_stay_with_their_materials(tmp_path):
    written(tmp_path, "m.mtl", "newmtl a\nKd 1 1 1\nmap_Kd -s 2 2 a b.png\ndisp n.png\nnewmtl b\nKd 1 1 1\n")
    text = "mtllib m.mtl\n" + SQUARE + "vt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1/1 3/1 4/1\n"
    mesh = written(tmp_path, "m.obj", text)
    Image.new("RGB", (2, 2)).save(tmp_path / "a b.png")
    scene = load_scene(mesh)
    textures = scene.materials.textures[scene.material[-1]]
    assert [(t.role, t.picture.path, t.matrix) for t in textures] == [
        ("color", str(tmp_path / "a b.png"), (2, 0, 0, 0, 2, -1)),
        ("displacement", str(tmp_path / "n.png"), (1, 0, 0, 0, 1, 0)),
    ]
    assert scene.materials.textures[scene.material[0]] == ()
    assert scene.notices[0] == "m: 1 texture not drawn (displacement)"
    part = read_asset(mesh).parts[-1]
    assert [t.role for t in part.surface.overridden({"color": (1, 0, 0)}).textures] == ["displacement"]


def test_roughness_and_metal_of_the_pbr_statements_win(tmp_path):
    written(tmp_path, "m.mtl", "newmtl a\nNs 98\nPr 0.3\nPm 1\n")
    text = "mtllib m.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\n"
    materials = load_scene(written(tmp_path, "m.obj", text)).materials
    assert materials.roughness.tolist() == [np.float32(0.3)]
    assert materials.metallic.tolist() == [1]


def test_colors_of_faces_do_not_run_into_each_other(tmp_path):
    color = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    text = (
        f"ply\nformat ascii 1.0\nelement vertex 4\n{XYZ}element face 2\n"
        f"property list uchar int vertex_indices\n{color}end_header\n"
        "0 0 0\n4 0 0\n4 4 0\n0 4 0\n4 0 1 2 3 255 0 0\n3 0 2 1 0 255 0\n"
    )
    scene = load_scene(written(tmp_path, "m.ply", text))
    assert scene.colors[scene.triangles].tolist() == [[[1, 0, 0]] * 3] * 2 + [[[0, 1, 0]] * 3]


def test_colors_multiply_the_material(tmp_path):
    written(tmp_path, "m.mtl", "newmtl a\nKd 0.5 0.5 0.5\n")
    text = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nusemtl a\nf 1 2 3\n"
    scene = load_scene(written(tmp_path, "m.obj", text))
    assert scene.materials.color.tolist() == [[0.5] * 3]
    assert scene.colors.tolist() == [[1, 0, 0]] * 3


def test_text_that_is_declared_single_is_as_precise_as_that(tmp_path):
    text = (
        f"ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}element face 1\n"
        "property list uchar int vertex_indices\nend_header\n0.1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    assert load_scene(written(tmp_path, "m.ply", text)).vertices[0, 0] == np.float32(0.1)
    text = text.replace("float x", "double x")
    assert load_scene(written(tmp_path, "m.ply", text)).vertices[0, 0] == 0.1


def test_faces_that_are_none_are_counted(tmp_path):
    scene = load_scene(written(tmp_path, "m.obj", SQUARE + "f 1 2\nf 1 2 3\nf 1\n"))
    assert scene.notices[0] == "m: 2 faces of fewer than 3 corners dropped"
    with pytest.raises(SceneError, match="holds no triangles"):
        load_scene(written(tmp_path, "m.obj", SQUARE + "f 1 2\n"))


def test_faces_that_cross_themselves_are_told(tmp_path):
    scene = load_scene(
        written(tmp_path, "m.obj", SQUARE.replace("0 4 0", "0 3 0") + "f 1 2 3 4\nf 1 3 2 4\n")
    )
    assert scene.coverage.crossing == 1
    assert scene.notices[0] == (
        "m: 1 face whose outline crosses itself, which no triangles can cover (face 2, line 6)"
    )


def test_places_beyond_all_bounds_are_dropped(tmp_path):
    text = SQUARE + "v 1e400 0 0\nv 1e300 1e300 0\nv 0 1e300 0\nf 1 2 3\nf 1 2 5\nf 1 6 7 2\n"
    scene = load_scene(written(tmp_path, "m.obj", text))
    assert len(scene.triangles) == 1
    assert scene.notices[0] == "m: 3 triangles with NaN or infinite vertices dropped"
