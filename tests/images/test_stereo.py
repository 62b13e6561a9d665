"""Two eyes' images as stereo hardware takes them."""

from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.cli import stereo as command
from quiltcli.errors import OutputError
from quiltcli.formats.exr.image import read_exr, write_exr
from quiltcli.images.facets import page_of
from quiltcli.images.names import facet_path, quilt_path
from quiltcli.images.stereo.anaglyph import MATRICES, anaglyph, luma
from quiltcli.images.stereo.files import MODES, StereoOptions, page_raster, write_stereo
from quiltcli.images.stereo.packing import (
    PACKINGS,
    interleaved,
    own_raster,
    squeezed,
    with_sync_line,
)
from quiltcli.layout import pixel_owners, write_layout
from tests.helpers.turned_layout import turned_layout


def noise(height=5, width=7, seed=1):
    return np.random.default_rng(seed).random((4, height, width), dtype=np.float32)


LEFT, RIGHT = noise(seed=1), noise(seed=2)


@pytest.mark.parametrize("name", MATRICES)
def test_white_stays_white_in_every_anaglyph(name):
    expected = [1, 0, 1] if name == "true" else [1, 1, 1]
    assert MATRICES[name].sum(axis=1) == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize("name", MATRICES)
def test_the_left_eye_sees_through_the_first_filter_what_is_its_own(name):
    """What a filter lets through is mostly its eye's: red, green or amber the left, the rest the right's."""
    matrix = MATRICES[name]
    mine = {"dubois-green-magenta": [1], "dubois-amber-blue": [0, 1]}.get(name, [0])
    for row in range(3):
        left, right = np.abs(matrix[row, :3]).sum(), np.abs(matrix[row, 3:]).sum()
        assert (left > right) == (row in mine) or left == right == 0


def test_an_anaglyph_is_mixed_in_linear_light_and_never_negative():
    mixed = anaglyph(LEFT[:3], RIGHT[:3], MATRICES["dubois-red-cyan"])
    pixel = MATRICES["dubois-red-cyan"] @ np.concatenate((LEFT[:3, 2, 3], RIGHT[:3, 2, 3]))
    assert mixed[:, 2, 3] == pytest.approx(np.maximum(pixel, 0), abs=1e-6)
    assert anaglyph(np.zeros_like(LEFT[:3]), RIGHT[:3], MATRICES["dubois-red-cyan"]).min() == 0


def test_full_packings_lose_nothing():
    wide, high = PACKINGS["side-by-side"](LEFT, RIGHT), PACKINGS["top-bottom"](LEFT, RIGHT)
    assert wide.shape == (4, 5, 14)
    assert high.shape == (4, 10, 7)
    np.testing.assert_array_equal(wide[:, :, :7], LEFT)
    np.testing.assert_array_equal(wide[:, :, 7:], RIGHT)
    np.testing.assert_array_equal(high[:, :5], LEFT)
    np.testing.assert_array_equal(high[:, 5:], RIGHT)


@pytest.mark.parametrize(("height", "width"), [(4, 6), (5, 7), (1, 1)])
def test_half_packings_keep_the_size_and_the_light(height, width):
    left, right = noise(height, width, 3), noise(height, width, 4)
    wide, high = PACKINGS["side-by-side-half"](left, right), PACKINGS["top-bottom-half"](left, right)
    assert wide.shape == high.shape == (4, height, width)
    more = width - width // 2
    assert wide[:, :, :more].mean() == pytest.approx(left.mean(), rel=1e-5)
    assert high[:, : height - height // 2].mean() == pytest.approx(left.mean(), rel=1e-5)


def test_an_even_width_is_squeezed_to_means_of_two():
    image = noise(3, 8)
    expected = (image[:, :, ::2] + image[:, :, 1::2]) / 2
    assert np.abs(squeezed(image, 4) - expected).max() < 1e-6


@pytest.mark.parametrize(
    ("mode", "is_right"),
    [
        ("rows", lambda x, y: y % 2),
        ("columns", lambda x, y: x % 2),
        ("checkerboard", lambda x, y: (x + y) % 2),
    ],
)
def test_turns_begin_with_the_left_eye_at_the_top_left(mode, is_right):
    woven = interleaved(LEFT, RIGHT, mode, own_raster(5, 7))
    assert woven.shape == LEFT.shape
    for y in range(5):
        for x in range(7):
            expected = RIGHT if is_right(x, y) else LEFT
            assert woven[0, y, x] == expected[0, y, x]


def test_in_a_page_turns_are_counted_in_each_panel_however_it_lies():
    layout = turned_layout()
    owners = pixel_owners(layout)
    for page in range(len(layout.pages)):
        raster = page_raster(layout, page)
        owner = page_of(owners, layout, page)
        for place in np.flatnonzero(layout.page == page):
            width, height = layout.size[place]
            mine = owner == layout.facet[place]
            columns, rows = raster.column[mine], raster.row[mine]
            assert (columns.min(), columns.max()) == (0, width - 1)
            assert (rows.min(), rows.max()) == (0, height - 1)
            y, x = np.nonzero(mine)
            back = layout.quilt_from_facet[place] @ np.stack((columns + 0.5, rows + 0.5, np.ones(x.size)))
            assert np.abs(back - [x + 0.5, y + 0.5]).max() < 1e-6


@pytest.mark.parametrize(("eye", "share"), [("left", 1), ("right", 3)])
def test_the_blue_line_tells_the_eyes_apart(eye, share):
    image = with_sync_line(noise(4, 16), eye)
    assert image[2, -1].tolist() == [1.0] * (4 * share) + [0.0] * (16 - 4 * share)
    assert not image[:2, -1].any()
    np.testing.assert_array_equal(image[:, :-1], noise(4, 16)[:, :-1])


@pytest.fixture
def out(tmp_path):
    """A folder with two frames of pages and facets for two eyes."""
    layout = turned_layout()
    write_layout(layout, tmp_path / "layout.yaml")
    (tmp_path / "quilt").mkdir()
    (tmp_path / "facets").mkdir()
    for frame in (1, 2):
        for eye, seed in (("left", 1), ("right", 2)):
            told = {"quilt:frame": frame, "framesPerSecond": Fraction(30), "view": eye, "multiView": [eye]}
            for page, (width, height) in enumerate(layout.pages.tolist()):
                light = dict(zip("RGBA", noise(height, width, seed + 10 * frame).astype("f2"), strict=True))
                write_exr(quilt_path(tmp_path, page + 1, frame, eye), light, told)
            light = dict(zip("RGBA", noise(5, 7, seed + 20 * frame).astype("f2"), strict=True))
            write_exr(facet_path(tmp_path, 1, frame, eye), light, told)
    return tmp_path


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_writes_files_that_read_back(out, mode):
    written = write_stereo(out, out / "new", StereoOptions(mode))
    assert written
    for path in written:
        image = read_exr(path)
        assert image.attributes["quilt:stereo"] == mode
        assert image.channels["R"].dtype == np.float16
    with pytest.raises(OutputError, match="exists already"):
        write_stereo(out, out / "new", StereoOptions(mode))
    assert write_stereo(out, out / "new", StereoOptions(mode, overwrite=True)) == written


def test_a_sequence_shows_left_at_odd_frames_and_right_at_even_ones(out):
    write_stereo(out, out / "new", StereoOptions("sequential", "facet"))
    names = sorted(path.name for path in (out / "new").iterdir())
    assert names == [f"facet_0001.{frame:04}.exr" for frame in (1, 2, 3, 4)]
    for name, (frame, eye) in zip(names, ((1, "left"), (1, "right"), (2, "left"), (2, "right")), strict=True):
        shown, made = read_exr(out / "new" / name), read_exr(facet_path(out, 1, frame, eye))
        np.testing.assert_array_equal(shown.channels["G"], made.channels["G"])
        assert shown.attributes["framesPerSecond"] == 60
        assert shown.attributes["view"] == eye


def test_swapped_eyes_are_swapped(out):
    write_stereo(out, out / "a", StereoOptions("side-by-side", "facet"))
    write_stereo(out, out / "b", StereoOptions("side-by-side", "facet", swap=True))
    a, b = (read_exr(out / folder / "facet_0001.0001.exr").channels["R"] for folder in "ab")
    np.testing.assert_array_equal(a, np.hstack((b[:, 7:], b[:, :7])))


def test_three_grey_frames_in_one(out):
    written = write_stereo(out, out / "new", StereoOptions("rgb-frames", "facet"))
    assert [path.name for path in written] == ["facet_0001.0001.exr", "facet_0001.0002.exr"]
    first, second = (read_exr(path) for path in written)
    assert first.attributes["framesPerSecond"] == 20
    for channel, (frame, eye) in zip("RGB", ((1, "left"), (1, "right"), (2, "left")), strict=True):
        image = read_exr(facet_path(out, 1, frame, eye)).channels
        grey = luma(np.stack([image[name] for name in "RGB"]).astype(np.float32))
        assert np.abs(first.channels[channel] - grey).max() < 1e-3
    assert not second.channels["G"].any()


def test_one_eye_is_not_enough(out):
    facet_path(out, 1, 2, "right").unlink()
    with pytest.raises(OutputError, match="frames 2 have facets of one eye only"):
        write_stereo(out, out / "new", StereoOptions("anaglyph", "facet"))
    assert write_stereo(out, out / "new", StereoOptions("anaglyph", "facet", frames=(1,)))


def test_the_command_says_what_it_wrote_and_knows_what_the_library_does(out):
    assert command.MODES == MODES
    assert tuple(MATRICES) == command.MATRICES
    result = CliRunner().invoke(main, ["stereo", str(out), "-o", str(out / "new"), "--as", "rows", "-f", "1"])
    assert result.exit_code == 0
    assert "page_01.0001.exr" in result.output
    wrong = CliRunner().invoke(main, ["stereo", str(out), "-o", "x", "--as", "rows", "--sync-line"])
    assert wrong.exit_code == 2
    assert "--sync-line goes with --as sequential" in wrong.output
