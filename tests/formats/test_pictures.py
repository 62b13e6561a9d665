"""Pictures of other programs as linear light."""

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

from quiltcli.errors import OutputError
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.pictures import picture_size, read_picture, to_linear

VALUES = np.array([[[0, 10, 255], [128, 1, 2]], [[3, 200, 90], [7, 8, 9]]], dtype=np.uint8)
LIGHT = to_linear(VALUES / 255.0)


def write_oiio(path, pixels, **attributes):
    height, width, channels = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, channels, str(pixels.dtype).replace("float32", "float"))
    for name, value in attributes.items():
        spec.attribute(name.replace("_", ":"), value)
    file = OpenImageIO.ImageOutput.create(str(path))
    assert file.open(str(path), spec)
    assert file.write_image(pixels)
    file.close()


def test_the_curve_of_srgb():
    """Values of IEC 61966-2-1: its two pieces meet at 0.04045."""
    assert to_linear(np.array([0.0, 1.0])).tolist() == [0.0, 1.0]
    assert to_linear(np.array([0.5]))[0] == pytest.approx(0.21404114, abs=1e-8)
    assert to_linear(np.array([0.04045]))[0] == pytest.approx(0.04045 / 12.92, rel=1e-12)
    assert to_linear(np.array([-0.5]))[0] == -to_linear(np.array([0.5]))[0]


def test_whole_numbers_are_srgb_and_floats_are_light(tmp_path):
    for name, scale in (("a.png", 1), ("b.tif", 1), ("c.png", 257)):
        kind = np.uint8 if scale == 1 else np.uint16
        write_oiio(tmp_path / name, (VALUES.astype(np.uint16) * scale).astype(kind))
        light = read_picture(tmp_path / name)
        np.testing.assert_allclose(light[..., :3], LIGHT, rtol=1e-6)
        assert (light[..., 3] == 1).all()
        assert picture_size(tmp_path / name) == (2, 2)
        np.testing.assert_allclose(read_picture(tmp_path / name, "linear")[..., :3], VALUES / 255, rtol=1e-6)
    floats = np.array([[[0.25, 2.0, -0.5]]], dtype=np.float32)
    write_oiio(tmp_path / "d.tif", floats)
    assert read_picture(tmp_path / "d.tif")[0, 0, :3].tolist() == floats[0, 0].tolist()
    curved = read_picture(tmp_path / "d.tif", "srgb")[0, 0, :3]
    np.testing.assert_allclose(curved, to_linear(floats[0, 0].astype(np.float64)), rtol=1e-6)


def test_jpeg_and_grey(tmp_path):
    Image.fromarray(np.full((8, 8, 3), 100, np.uint8)).save(tmp_path / "a.jpg", quality=100)
    grey = to_linear(np.float64(100 / 255))
    np.testing.assert_allclose(read_picture(tmp_path / "a.jpg")[..., :3], grey, 0.02)
    Image.fromarray(VALUES[..., 0]).save(tmp_path / "b.png")
    light = read_picture(tmp_path / "b.png")
    np.testing.assert_allclose(light[..., 2], LIGHT[..., 0], rtol=1e-6)
    assert (light[..., 0] == light[..., 1]).all()


def test_alpha_is_multiplied_in_in_linear_light(tmp_path):
    pixels = np.array([[[188, 188, 188, 51]]], dtype=np.uint8)
    write_oiio(tmp_path / "a.png", pixels, oiio_UnassociatedAlpha=1)
    light = to_linear(np.float64(188 / 255)) * 0.2
    np.testing.assert_allclose(read_picture(tmp_path / "a.png")[0, 0], [light, light, light, 0.2], rtol=1e-6)


def test_layers_and_windows_of_exr(tmp_path):
    half = np.array([[1, 2, 3], [4, 5, 6]], dtype=np.float16)
    channels = {f"ViewLayer.Combined.{c}": half * k for k, c in enumerate("BGRA", 1)}
    channels |= {f"ViewLayer.Albedo.{c}": half * 9 for c in "RGB"}
    window = ((-1, 1), (1, 2)), ((0, 0), (3, 3))
    write_exr(tmp_path / "a.exr", channels, {}, data_window=window[0], display_window=window[1])
    light = read_picture(tmp_path / "a.exr")
    assert light.shape == (4, 4, 4)
    assert picture_size(tmp_path / "a.exr") == (4, 4)
    assert light[1, :2].tolist() == [[6, 4, 2, 8], [9, 6, 3, 12]]
    assert light[2, 0].tolist() == [15, 10, 5, 20]
    assert not light[0].any()
    assert not light[:, 2:].any()
    beside = ((9, 9), (11, 10)), ((0, 0), (3, 3))
    colours = dict.fromkeys("RGBA", half)
    write_exr(tmp_path / "b.exr", colours, {}, data_window=beside[0], display_window=beside[1])
    assert not read_picture(tmp_path / "b.exr").any()


def test_what_is_no_picture(tmp_path):
    (tmp_path / "a.png").write_text("no")
    with pytest.raises(OutputError, match=r"a\.png: cannot be read"):
        read_picture(tmp_path / "a.png")
    with pytest.raises(OutputError, match=r"b\.png: no such file"):
        picture_size(tmp_path / "b.png")
    write_exr(tmp_path / "z.exr", {"Z": np.zeros((2, 2), np.float32)}, {})
    with pytest.raises(OutputError, match=r"has no colours, expected R, G and B \(it has Z\)"):
        read_picture(tmp_path / "z.exr")
