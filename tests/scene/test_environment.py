"""Environments in scene files: what is read, and what is said of what cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import SceneError
from quiltcli.job import load_scene_file
from quiltcli.scene import load_scene
from quiltcli.scene.environment.panorama import read_panorama
from quiltcli.scene.lights import Ambient, Environment

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def written(path, pixels, kind="float"):
    import OpenImageIO as oiio  # noqa: N813 - its own short name

    pixels = np.asarray(pixels)
    height, width, channels = pixels.shape
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    out.write_image(pixels)
    out.close()
    return path


def scene(folder, light):
    (folder / "t.obj").write_text(TRIANGLE)
    path = folder / "scene.yaml"
    path.write_text(f"quilt_scene: 1\nobjects:\n- mesh: t.obj\nlights:\n- {light}\n")
    return path


@pytest.mark.parametrize("suffix", ["exr", "hdr"])
def test_float_panoramas_are_light_as_it_is(suffix, tmp_path):
    pixels = np.zeros((8, 16, 3), np.float32)
    pixels[2, 3] = (0.5, 4, 16)
    found = read_panorama(written(tmp_path / f"a.{suffix}", pixels))
    np.testing.assert_allclose(found, pixels, rtol=0.01)


def test_other_panoramas_are_srgb_and_grey_ones_have_three_colours(tmp_path):
    pixels = np.full((4, 8, 1), 188, np.uint8)
    found = read_panorama(written(tmp_path / "a.png", pixels, "uint8"))
    assert found.shape == (4, 8, 3)
    assert found == pytest.approx(0.5, abs=0.005)


def test_an_environment_is_one_of_the_lights(tmp_path):
    written(tmp_path / "sky.exr", np.full((4, 8, 3), 2, np.float32))
    text = "{type: environment, file: sky.exr, rotate_deg: 30, intensity: 0.5, distance: 2, rays: 8}"
    (light,) = load_scene(scene(tmp_path, text)).lights
    assert isinstance(light, Environment)
    assert (light.color.tolist(), light.shadows, light.distance, light.rays) == ([0.5] * 3, True, 2, 8)
    assert (light.maps.diffuse == 2).all()
    assert all((texels == 2).all() for texels in light.maps.mirrors)


def test_ambient_occlusion_is_for_light_from_everywhere_that_has_no_shadows(tmp_path):
    path = scene(tmp_path, "{type: ambient, color: [1, 1, 1]}")
    spec = load_scene_file(path).with_ambient_occlusion(0.5, 16)
    (light,) = load_scene(spec).lights
    assert isinstance(light, Ambient)
    assert (light.shadows, light.distance, light.rays) == (True, 0.5, 16)
    (plain,) = load_scene(spec.without_shadows()).lights
    assert not plain.shadows


@pytest.mark.parametrize(
    ("pixels", "words"),
    [
        (np.ones((8, 8, 3), np.float32), "it has 8 × 8 pixels (expected all directions"),
        (np.full((4, 8, 3), np.nan, np.float32), "holds 32 pixels that are infinite or no numbers"),
    ],
)
def test_a_wrong_panorama_is_named_with_its_place(pixels, words, tmp_path):
    written(tmp_path / "sky.exr", pixels)
    with pytest.raises(SceneError) as error:
        load_scene(scene(tmp_path, "{type: environment, file: sky.exr}"))
    text = str(error.value)
    assert words in text
    assert "scene.yaml:5:29: lights[0].file: " in text
    assert "sky.exr" in text


def test_what_is_no_picture_is_said(tmp_path):
    (tmp_path / "sky.exr").write_text("no picture")
    with pytest.raises(SceneError, match=r"sky\.exr.*cannot be read"):
        load_scene(scene(tmp_path, "{type: environment, file: sky.exr}"))
