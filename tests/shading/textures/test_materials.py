"""Pictures of one value are that value: a textured surface against one of numbers, and closed forms."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from quiltcli.errors import SceneError
from quiltcli.scene import load_scene
from tests.helpers import textured_floor as floor

SUN = "{type: directional, direction: [-1, -2, -1], color: [2, 1.5, 1]}"
DIM = "{type: ambient, color: [0.2, 0.3, 0.4]}"
POINT = "{type: point, position: [0.3, 1.5, -6], color: [9, 8, 7]}"
NAMES = ("R", "G", "B")


def seen(folder, material, lights, textures=""):
    """Colours of the floor, with a material and textures of a scene file, as they stand there."""
    even = np.full((4, 4, 3), 255, np.uint8)
    job = floor.write_floor_job(folder, even, material=material, lights=f"[{lights}]")
    scene = folder / "scene.yaml"
    covered = f", textures: {{{textures}}}" if textures else ""
    scene.write_text(scene.read_text().replace(", textures: {color: floor.png}", covered))
    return np.stack(floor.drawn(job, *NAMES)).astype(np.float64)


def even(folder, name, *values):
    """A picture of one value; 8 bits that half floats keep well."""
    Image.fromarray(np.full((4, 4, 3), values or 0, np.uint8)).save(folder / name)


@pytest.mark.parametrize("lights", [SUN, DIM, f"{SUN}, {POINT}"])
@pytest.mark.parametrize(
    ("numbers", "material", "textures"),
    [
        ("color: [1, 1, 1], roughness: 0.2", "color: [1, 1, 1]", "roughness: fifth.png"),
        ("color: [0.8, 0.6, 0.2], metallic: 0.2", "color: [0.8, 0.6, 0.2]", "metallic: fifth.png"),
        ("color: [1, 1, 1], metallic: 0.1", "color: [1, 1, 1], metallic: 0.5", "metallic: fifth.png"),
        ("emission: [0.5, 0.25, 0]", "emission: [0.5, 0.25, 1]", "emission: yellow.png"),
        ("color: [1, 1, 0], metallic: 1", "metallic: 1", "color: yellow.png"),
        ("color: [1, 1, 0], unlit: true", "unlit: true", "color: yellow.png"),
        ("color: [0.5, 0.25, 0]", "color: [0.5, 0.25, 1]", "color: yellow.png, occlusion: white.png"),
        ("roughness: 0.4", "roughness: 0.4", "normal: flat.exr"),
    ],
)
def test_a_picture_of_one_value_is_that_value(tmp_path, lights, numbers, material, textures):
    even(tmp_path, "fifth.png", 51, 200, 100)
    even(tmp_path, "yellow.png", 255, 255, 0)
    even(tmp_path, "white.png", 255, 255, 255)
    import OpenImageIO

    flat = np.full((4, 4, 3), (0.5, 0.5, 1), np.float32)
    assert OpenImageIO.ImageBuf(flat).write(str(tmp_path / "flat.exr"))
    expected = seen(tmp_path, numbers, lights)
    found = seen(tmp_path, material, lights, textures)
    np.testing.assert_allclose(found, expected, rtol=3e-3, atol=1e-3)
    assert found.max() > 0.01


def test_occlusion_holds_back_what_comes_from_everywhere_and_nothing_else(tmp_path):
    even(tmp_path, "fifth.png", 51, 0, 0)
    material = "color: [1, 0.5, 0.25], roughness: 0.5"
    for lights, share in ((DIM, 0.2), (SUN, 1.0)):
        open_ = seen(tmp_path, material, lights)
        held = seen(tmp_path, material, lights, "occlusion: fifth.png")
        np.testing.assert_allclose(held, open_ * share, rtol=3e-3, atol=3e-4)
    expected = np.array([1, 0.5, 0.25]) * (0.2, 0.3, 0.4) * 0.2
    ground = seen(tmp_path, material, DIM, "occlusion: fifth.png")[:, 90]
    np.testing.assert_allclose(ground, np.tile(expected[:, None], ground.shape[1]), rtol=3e-3)


def test_colours_of_vertices_multiply_pictures_of_the_mesh(tmp_path):
    even(tmp_path, "half.png", 188, 188, 188)
    job = floor.write_floor_job(tmp_path, np.zeros((2, 2, 3), np.uint8))
    text = (
        (tmp_path / "floor.obj")
        .read_text()
        .replace(" 30\n", " 30 1 0 1\n")
        .replace(" -210\n", " -210 1 0 1\n")
    )
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd half.png\n")
    (tmp_path / "floor.obj").write_text("mtllib m.mtl\nusemtl a\n" + text)
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects: [{mesh: floor.obj, material: {unlit: true}}]\n"
    )
    red, green, blue = floor.drawn(job, *NAMES)
    half = ((188 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(red[90], half, rtol=1e-3)
    assert (green[90] == 0).all()
    np.testing.assert_allclose(blue[90], half, rtol=1e-3)


def test_pictures_that_promise_too_much_are_refused_before_memory_is_taken(tmp_path):
    def chunk(kind, data):
        check = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + check

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(999)))
    floor.write_floor_job(tmp_path, np.zeros((2, 2, 3), np.uint8))
    (tmp_path / "floor.png").write_bytes(data + chunk(b"IEND", b""))
    with pytest.raises(
        SceneError, match=r"floor.png: material.textures.color: cannot be read: it has .*pixels"
    ):
        load_scene(tmp_path / "scene.yaml")
