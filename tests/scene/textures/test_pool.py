"""The memory textures are looked up in: borders, what may not be read, and what is too much."""

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import SceneError
from quiltcli.scene import load_scene
from quiltcli.scene.materials import Texture
from quiltcli.scene.textures.picture import Picture
from quiltcli.scene.textures.pool import TextureLimits, TextureStore

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n"


def texture(path, role="color", **keys):
    return Texture(role, Picture(str(path)), use="material 'a', map_Kd", **keys)


def saved(path, pixels):
    Image.fromarray(np.asarray(pixels, np.uint8)).save(path)
    return path


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_a_border_goes_on_as_the_texture_does(tmp_path, wrap):
    path = saved(tmp_path / "a.png", np.arange(6).reshape(2, 3) * 40)
    pool = TextureStore().of([(texture(path, "roughness", wrap=(wrap, wrap)),)])
    grid = pool.texels[:20].view(np.float16).reshape(4, 5, 4)[..., 0].astype(float) * 255 / 40
    mode = {"repeat": "wrap", "clamp": "edge", "mirror": "edge"}[wrap]
    np.testing.assert_allclose(grid, np.pad(np.arange(6).reshape(2, 3), 1, mode=mode), atol=2e-3)
    assert pool.first[0] == 6
    assert pool.stride[0] == 5


def test_a_picture_is_there_once_for_every_way_it_is_used(tmp_path):
    path = saved(tmp_path / "a.png", np.zeros((2, 2, 3)))
    both = (texture(path), texture(path, "emission"), texture(path, "roughness"))
    pool = TextureStore().of([both, (texture(path, wrap=("clamp", "clamp")),), ()])
    assert len(pool.start) == 4
    assert pool.slots["color"].image.tolist() == [0, 2, -1]
    assert pool.slots["emission"].image.tolist() == [0, -1, -1]
    assert pool.slots["roughness"].image.tolist() == [1, -1, -1]


def test_the_same_materials_have_the_same_textures(tmp_path):
    store = TextureStore()
    used = [(texture(saved(tmp_path / "a.png", np.zeros((2, 2, 3)))),)]
    assert store.of(used) is store.of(list(used))
    assert store.of([()]) is None
    assert store.of([(texture("nowhere.png", "displacement"),)]) is None


def test_large_pictures_are_reduced(tmp_path):
    path = saved(tmp_path / "a.png", np.zeros((40, 9, 3)))
    pool = TextureStore(TextureLimits(largest=16)).of([(texture(path),)])
    assert (pool.width[0], pool.height[0]) == (2, 10)


def test_too_much_memory_is_an_error_that_names_the_largest(tmp_path):
    large, small = saved(tmp_path / "large.png", np.zeros((64, 64, 3))), tmp_path / "small.png"
    saved(small, np.zeros((4, 4, 3)))
    with pytest.raises(SceneError, match=r"48 kB|0.1 MB.*texture_memory.*large.png, 64 × 64.*small.png"):
        TextureStore(TextureLimits(memory=0.01)).of([(texture(large), texture(small, "emission"))])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (None, "material 'a', map_Kd: no such file"),
        (b"hello", "material 'a', map_Kd: cannot be read"),
        (b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(90), "KTX2, which is not read"),
        (b"\0\0\0\x1cftypavif" + bytes(90), "AVIF or HEIF, which is not read"),
    ],
)
def test_a_picture_that_cannot_be_read_is_an_error_naming_material_and_file(tmp_path, data, message):
    if data is not None:
        (tmp_path / "w x.png").write_bytes(data)
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd w x.png\n")
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + QUAD)
    with pytest.raises(SceneError, match=message) as caught:
        load_scene(tmp_path / "m.obj")
    assert "w x.png" in str(caught.value)


def test_a_picture_that_a_scene_replaces_is_not_looked_for(tmp_path):
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd nowhere.png\ndisp none.png\n")
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + QUAD)
    scene = tmp_path / "s.yaml"
    scene.write_text("quilt_scene: 1\nobjects:\n- {mesh: m.obj, material: {color: [1, 0, 0]}}\n")
    loaded = load_scene(scene)
    assert loaded.notices[0] == "m: 1 texture not drawn (displacement)"


def test_triangles_without_texture_coordinates_are_told(tmp_path):
    saved(tmp_path / "w.png", np.zeros((2, 2, 3)))
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd w.png\n")
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + QUAD + "f 1 2 3\n")
    words = "m: 1 textured triangle without texture coordinates show one place of the picture"
    assert words in load_scene(tmp_path / "m.obj").notices


def test_pictures_multiply_what_a_material_file_says(tmp_path):
    saved(tmp_path / "w.png", np.zeros((2, 2, 3)))
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n" + QUAD)
    for text, color in (("", 1.0), ("Kd 0.5 0.5 0.5\n", 0.5), ("Kd 0 0 0\n", 1.0)):
        (tmp_path / "m.mtl").write_text(f"newmtl a\n{text}map_Kd w.png\n")
        assert load_scene(tmp_path / "m.obj").materials.color.tolist() == [[color] * 3]
