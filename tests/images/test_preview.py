from __future__ import annotations

import numpy as np
import OpenImageIO
import pytest
from click.testing import CliRunner
from PIL import Image

import quiltcli.images.preview as module
from quiltcli.cli import main
from quiltcli.errors import OutputError
from quiltcli.formats.exr.image import write_exr
from quiltcli.images.preview import (
    Look,
    block_means,
    display_values,
    preview,
    preview_paths,
    tone_map,
    write_bytes,
    write_png,
    write_values,
)


def grey(*values):
    return np.repeat(np.float32(values)[None, :, None], 3, axis=2)


def test_srgb_is_the_curve_of_the_standard():
    # 0.0031308 is where the line ends; 0.214041 is what sRGB calls one half.
    assert tone_map(grey(0, 0.0031308, 0.21404114, 1, 7), "srgb")[0, :, 0].tolist() == [0, 10, 128, 255, 255]


def test_aces_keeps_black_and_order_and_bounds():
    shown = tone_map(grey(0, 0.01, 0.18, 1, 16, 1e4))[0, :, 0].astype(int)
    assert shown[0] == 0
    assert (np.diff(shown) >= 0).all()
    assert shown[5] > 250
    # The reference rendering of ACES 1 sends 18 % grey to 10 % of white, sRGB code 89; the view adjusts
    # that a little for the surround of an SDR screen.
    assert shown[2] == 91


def test_aces_keeps_grey_grey():
    assert np.ptp(tone_map(grey(0.02, 0.18, 0.7)), axis=2).max() <= 1


def test_exposure_is_in_stops():
    light = grey(0.05, 0.1)
    assert (tone_map(light, "srgb", 2) == tone_map(4 * light, "srgb")).all()


def test_what_is_no_number_is_black_and_infinity_is_white():
    assert tone_map(grey(np.nan, np.inf, -np.inf), "srgb")[0, :, 0].tolist() == [0, 255, 0]


def test_means_of_blocks_that_do_not_fit():
    image = np.arange(15, dtype=np.float32).reshape(3, 5, 1)
    assert block_means(image, 2)[..., 0].tolist() == [[3, 5, 6.5], [10.5, 12.5, 14]]
    assert (block_means(image, 1) == image).all()


def test_a_png_holds_the_bytes(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    write_bytes(tmp_path / "a.png", pixels)
    assert (np.asarray(Image.open(tmp_path / "a.png")) == pixels).all()


def test_a_png_is_whole_or_not_there(tmp_path, monkeypatch):
    def fails(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", fails)
    with pytest.raises(OutputError, match=r"a\.png: cannot be written: No space left on device"):
        write_png(tmp_path / "a.png", grey(1), "srgb")
    assert list(tmp_path.iterdir()) == []


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"must end in \.png"):
        write_png(tmp_path / "a.jpg", grey(1))


def test_an_unknown_configuration_is_an_error_not_a_picture(monkeypatch):
    monkeypatch.setattr(module, "CONFIG", "ocio://no-such-config")
    with pytest.raises(OutputError, match="the ACES view failed"):
        tone_map(grey(0.5))


def test_preview_scales_large_images_down(tmp_path):
    half = np.full((4, 4100), 0.25, np.float16)
    write_exr(tmp_path / "page.exr", dict.fromkeys("RGBA", half), {})
    assert preview(tmp_path / "page.exr", tmp_path / "page.png", Look("srgb")) == (1367, 2)
    shown = np.asarray(Image.open(tmp_path / "page.png"))
    assert shown.shape == (2, 1367, 3)
    assert (shown == 137).all()


def test_preview_needs_colours(tmp_path):
    write_exr(tmp_path / "z.exr", {"Z": np.ones((2, 2), np.float32)}, {})
    with pytest.raises(OutputError, match=r"has no channel R, expected R, G and B \(it has Z\)"):
        preview(tmp_path / "z.exr", tmp_path / "z.png")


def test_command_names_pictures_after_their_images(tmp_path):
    for name in ("a", "b"):
        write_exr(tmp_path / f"{name}.exr", dict.fromkeys("RGB", np.ones((2, 3), np.float16)), {})
    arguments = ["preview", str(tmp_path / "a.exr"), str(tmp_path / "b.exr"), "-o"]
    result = CliRunner().invoke(main, [*arguments, str(tmp_path / "seen")])
    assert result.output == f"{tmp_path / 'seen' / 'a.png'}  3×2\n{tmp_path / 'seen' / 'b.png'}  3×2\n"
    result = CliRunner().invoke(main, [*arguments, str(tmp_path / "one.png")])
    assert result.exit_code == 2
    assert "is one picture for 2 images, expected a folder" in result.output


# --- pictures of 16 bits ---


def test_sixteen_bits_hold_the_curve_of_the_standard():
    # Half a step off the closed form at most: the light is single precision, the steps are a 65535th.
    light = np.linspace(0, 1, 4001, dtype=np.float32)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light.astype(float) ** (1 / 2.4) - 0.055)
    shown = display_values(grey(*light), Look("srgb", depth=16))
    assert shown.dtype == np.uint16
    assert np.abs(shown[0, :, 0] - 65535 * curve).max() < 0.51


def test_raw_is_the_light_itself():
    light = grey(0, 0.25, 1 / 65535, 1, 3, np.nan)
    assert display_values(light, Look("raw", depth=16))[0, :, 1].tolist() == [0, 16384, 1, 65535, 65535, 0]


def test_strips_are_no_matter(monkeypatch):
    light = np.random.default_rng(1).random((50, 7, 3)).astype(np.float32)
    whole = display_values(light, Look(depth=16))
    monkeypatch.setattr(module, "_STRIP", 40)
    assert (display_values(light, Look(depth=16)) == whole).all()


@pytest.mark.parametrize(("name", "depth"), [("a.png", 16), ("a.tif", 16), ("a.tiff", 8), ("a.png", 8)])
def test_a_picture_holds_every_value(tmp_path, name, depth):
    kind = np.uint8 if depth == 8 else np.uint16
    pixels = np.random.default_rng(2).integers(0, 2**depth, (5, 7, 3)).astype(kind)
    written = []
    for _ in range(2):
        write_values(tmp_path / name, pixels, "srgb")
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]
    image = OpenImageIO.ImageBuf(str(tmp_path / name))
    assert image.spec().get_string_attribute("DateTime").strip(" :") == ""
    assert str(image.spec().format) == str(np.dtype(kind))
    assert (image.get_pixels(OpenImageIO.UINT16 if depth == 16 else OpenImageIO.UINT8) == pixels).all()
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_picture_that_cannot_be_written_says_why(tmp_path):
    with pytest.raises(OutputError, match=r"none/a\.tif: cannot be written: No such file or directory$"):
        write_values(tmp_path / "none" / "a.tif", np.zeros((2, 2, 3), np.uint16), "srgb")
    with pytest.raises(OutputError, match=r"a\.jpg: a picture's name must end in \.png, \.tif or \.tiff"):
        write_values(tmp_path / "a.jpg", np.zeros((2, 2, 3), np.uint16), "srgb")


def test_deliverables_of_a_sequence_keep_every_pixel(tmp_path):
    for frame in (2, 10, 9):
        half = np.full((3, 2100), frame / 16, np.float16)
        write_exr(tmp_path / f"page_01.{frame:04d}.exr", dict.fromkeys("RGB", half), {})
    arguments = ["preview", str(tmp_path / "page_01.####.exr"), "-o", str(tmp_path / "out"), "--depth", "16"]
    result = CliRunner().invoke(main, [*arguments, "--format", "tiff", "--view", "raw"])
    assert result.exit_code == 0
    names = [f"page_01.{frame:04d}.tif" for frame in (2, 9, 10)]
    assert result.output == "".join(f"{tmp_path / 'out' / name}  2100×3\n" for name in names)
    image = OpenImageIO.ImageBuf(str(tmp_path / "out" / names[1]))
    assert (image.get_pixels(OpenImageIO.UINT16) == round(9 / 16 * 65535)).all()


def test_a_sequence_of_nothing_is_an_error(tmp_path):
    with pytest.raises(OutputError, match="there is no image of this sequence"):
        preview_paths([tmp_path / "page.####.exr"], tmp_path / "out")


def test_a_name_and_a_format_that_disagree(tmp_path):
    with pytest.raises(OutputError, match="is a name for a png picture, not for tiff"):
        preview_paths([tmp_path / "a.exr"], tmp_path / "a.png", "tiff")


def test_a_sequence_of_dome_masters_has_the_names_planetaria_take(tmp_path):
    light = {c: np.full((8, 8), 0.5, np.float32) for c in "RGB"}
    for frame in (7, 8):
        write_exr(tmp_path / f"page_01.{frame:04d}.exr", light, {})
    words = [str(tmp_path / "page_01.####.exr"), "-o", str(tmp_path / "dome"), "--domemaster", "Show"]
    result = CliRunner().invoke(main, ["preview", *words])
    assert result.exit_code == 0, result.output
    names = sorted(path.name for path in (tmp_path / "dome").iterdir())
    assert names == ["Show_000007.png", "Show_000008.png"]
    assert np.asarray(Image.open(tmp_path / "dome" / "Show_000007.png")).shape == (8, 8, 3)
    assert (tmp_path / "dome" / "Show_000007.png").read_bytes()[24] == 16  # bits a channel


@pytest.mark.parametrize(
    ("images", "output", "words"),
    [
        (["still.exr"], "dome", "has no frame number"),
        (["a.0001.exr", "b.0001.exr"], "dome", "is a second image of frame 1"),
        (["a.0001.exr"], "dome.png", "is a picture's name"),
    ],
)
def test_what_is_no_sequence_of_dome_masters_is_said(tmp_path, images, output, words):
    for name in images:
        write_exr(tmp_path / name, {c: np.zeros((4, 4), np.float32) for c in "RGB"}, {})
    paths = [str(tmp_path / name) for name in images]
    more = ["-o", str(tmp_path / output), "--domemaster", "Show"]
    result = CliRunner().invoke(main, ["preview", *paths, *more])
    assert result.exit_code == 2
    assert words in result.output + result.stderr
