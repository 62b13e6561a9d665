import math
import os

import numpy as np
import OpenEXR
import pytest

from quiltcli.formats.exr.image import write_exr
from quiltcli.images.diff import COLUMNS, FILE, Limits, diff, diff_rows

INF, NAN = math.inf, math.nan


def image(**changes):
    """Two channels of 600 × 5 pixels (more rows than are compared at a time), changed at (row, column)."""
    channels = {
        "R": np.linspace(0, 1, 3000, dtype=np.float32).reshape(600, 5),
        "Z": np.ones((600, 5), np.float32),
    }
    channels["Z"][:, 4] = INF
    for name, pixels in changes.items():
        for at, value in pixels.items():
            channels[name][at] = value
    return channels


def compare(tmp_path, a, b, **limits):
    write_exr(tmp_path / "a.exr", a, {})
    write_exr(tmp_path / "b.exr", b, {"some": "attribute"}, "piz")
    return diff(tmp_path / "a.exr", tmp_path / "b.exr", Limits(**limits))


def rows(result):
    return {row.channel: row for file in result.files for row in file.channels}


# --- pixels ---


def test_the_same_pixels_match(tmp_path):
    result = compare(tmp_path, image(), image())
    assert result.code == 0
    assert all(row.maximum == row.mean == row.rms == row.over == 0 for row in rows(result).values())
    assert all(row.first is None for row in rows(result).values())


def test_figures_of_a_difference(tmp_path):
    result = compare(tmp_path, image(), image(Z={(299, 1): 1.5, (300, 3): 3.0}))
    assert result.code == 2
    row = rows(result)["Z"]
    assert row.maximum == 2.0
    assert row.mean == pytest.approx(2.5 / 3000)
    assert row.rms == pytest.approx(math.sqrt(4.25 / 3000))
    assert (row.over, row.nonfinite, row.first) == (2, 0, (1, 299))
    assert rows(result)["R"].over == 0


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({}, 2),
        ({"fail": 0.49}, 2),
        ({"fail": 0.5}, 1),
        ({"fail": 0.5, "warn": 0.5}, 0),
        ({"fail": 0.5, "hard_fail": 0.4}, 2),
        ({"fail_percent": 0.1}, 1),
        ({"fail_percent": 0.1, "warn_percent": 0.1}, 0),
        ({"fail_percent": 0.09, "warn_percent": 0.1}, 2),
    ],
)
def test_limits(tmp_path, limits, expected):
    changed = image(Z={(7, 0): 1.5, (8, 0): 0.5, (9, 0): 1.5})  # 3 of 3000 pixels are 0.1 %
    assert expected == compare(tmp_path, image(), changed, **limits).code


def test_a_pixel_counts_once_however_many_channels_differ(tmp_path):
    changed = image(Z={(7, 0): 2.0}, R={(7, 0): 2.0})
    assert compare(tmp_path, image(), changed, fail_percent=0.0334, warn_percent=0.0334).code == 0
    assert compare(tmp_path, image(), changed, fail_percent=0.0332).code == 2


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (NAN, NAN, 0),
        (INF, INF, 0),
        (-INF, -INF, 0),
        (INF, -INF, 1),
        (NAN, INF, 1),
        (NAN, 1.0, 1),
        (1.0, NAN, 1),
        (INF, 1.0, 1),
    ],
)
def test_what_is_not_finite_must_be_the_same(tmp_path, one, other, expected):
    result = compare(tmp_path, image(Z={(450, 2): one}), image(Z={(450, 2): other}), fail=1e30)
    row = rows(result)["Z"]
    assert (row.nonfinite, row.over) == (expected, expected)
    assert row.first == ((2, 450) if expected else None)
    assert result.code == 2 * expected
    assert row.maximum == 0


def test_the_unlike_can_be_forgiven_by_share_but_not_by_a_hard_limit(tmp_path):
    a, b = image(), image(Z={(0, 0): INF})
    assert compare(tmp_path, a, b, fail_percent=1, warn_percent=1).code == 0
    assert compare(tmp_path, a, b, fail_percent=1, warn_percent=1, hard_fail=1e9).code == 2


def test_the_last_bit_of_every_type_counts(tmp_path):
    base = {
        "h": np.full((2, 2), 1000, np.float16),
        "f": np.full((2, 2), 1e-30, np.float32),
        "u": np.full((2, 2), 2**32 - 1, np.uint32),
    }
    for name, pixels in base.items():
        changed = {key: value.copy() for key, value in base.items()}
        bits = changed[name].view(np.uint16 if pixels.dtype == np.float16 else np.uint32)
        bits[1, 0] -= 1
        result = compare(tmp_path, base, changed)
        assert result.code == 2
        assert {key: row.over for key, row in rows(result).items()} == {**dict.fromkeys(base, 0), name: 1}
        assert rows(result)[name].first == (0, 1)


# --- what cannot be compared pixel by pixel ---


def only(result):
    (file,) = result.files
    return file.code, file.message


def test_sizes_that_differ(tmp_path):
    narrow = {name: pixels[:, :4] for name, pixels in image().items()}
    assert only(compare(tmp_path, image(), narrow)) == (3, "pixels 5×600 against 4×600")


def test_places_that_differ(tmp_path):
    write_exr(tmp_path / "a.exr", image(), {})
    write_exr(tmp_path / "b.exr", image(), {}, data_window=((1, 2), (5, 601)))
    result = diff(tmp_path / "a.exr", tmp_path / "b.exr")
    assert only(result) == (3, "pixels 5×600 against 5×600 at (1, 2)")


def test_channels_that_differ(tmp_path):
    a = image()
    assert only(compare(tmp_path, a, {"R": a["R"]})) == (3, "channels R, Z against R")


def test_part_counts_that_differ(tmp_path):
    write_exr(tmp_path / "a.exr", image(), {})
    write_parts(tmp_path / "b.exr", [image(), image()])
    assert only(diff(tmp_path / "a.exr", tmp_path / "b.exr")) == (3, "parts: 1 against 2")


def write_parts(path, images):
    parts = [OpenEXR.Part({}, dict(channels), f"part{n}") for n, channels in enumerate(images)]
    OpenEXR.File(parts).write(str(path))


def test_every_part_is_compared(tmp_path):
    write_parts(tmp_path / "a.exr", [image(), image(), image()])
    write_parts(tmp_path / "b.exr", [image(), image(), image(Z={(1, 1): 2})])
    result = diff(tmp_path / "a.exr", tmp_path / "b.exr")
    assert result.code == 2
    over = {(row.part, row.channel): row.over for row in result.files[0].channels}
    assert over == {(0, "R"): 0, (0, "Z"): 0, (1, "R"): 0, (1, "Z"): 0, (2, "R"): 0, (2, "Z"): 1}


def test_a_file_that_cannot_be_read(tmp_path):
    write_exr(tmp_path / "a.exr", image(), {})
    (tmp_path / "b.exr").write_bytes((tmp_path / "a.exr").read_bytes()[:-5])
    size = (tmp_path / "a.exr").stat().st_size
    expected = f"{tmp_path / 'b.exr'}: is truncated: {size - 5} of {size} bytes"
    assert only(diff(tmp_path / "a.exr", tmp_path / "b.exr")) == (4, expected)
    expected = f"{tmp_path / 'no.exr'}: no such file (expected an EXR)"
    assert only(diff(tmp_path / "no.exr", tmp_path / "a.exr")) == (4, expected)


# --- folders, sequences, other formats ---


def write_all(folder, names, channels=None):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_exr(folder / name, channels or image(), {})


def test_folders_are_compared_by_relative_name(tmp_path):
    names = ["quilt/page_01.0001.exr", "facets/facet_0001.0001.exr"]
    for folder in ("a", "b"):
        write_all(tmp_path / folder, names)
        (tmp_path / folder / "report.json").write_text(folder)
        (tmp_path / folder / ".page_01.0001.exr.7.tmp").write_text(folder)
    result = diff(tmp_path / "a", tmp_path / "b")
    assert [file.name for file in result.files] == sorted(names)
    assert result.code == 0
    write_all(tmp_path / "b", names[1:], image(R={(0, 0): 9}))
    assert [file.code for file in diff(tmp_path / "a", tmp_path / "b").files] == [2, 0]


def test_a_file_missing_from_one_folder(tmp_path):
    write_all(tmp_path / "a", ["1.exr", "2.exr"])
    write_all(tmp_path / "b", ["1.exr", "3.exr"])
    result = diff(tmp_path / "a", tmp_path / "b")
    assert result.code == 4
    assert [(file.name, file.code, file.message) for file in result.files] == [
        ("1.exr", 0, ""),
        ("2.exr", 4, f"only {tmp_path / 'a' / '2.exr'} exists"),
        ("3.exr", 4, f"only {tmp_path / 'b' / '3.exr'} exists"),
    ]


@pytest.mark.parametrize("pattern", ["page_01.####.exr", "page_01.%04d.exr"])
def test_sequences_are_compared_by_frame(tmp_path, pattern):
    write_all(tmp_path / "a", ["page_01.0001.exr", "page_01.-0002.exr", "page_02.0001.exr"])
    write_all(tmp_path / "b", ["page_01.0001.exr", "page_01.-0002.exr", "page_01.0003.exr"])
    result = diff(tmp_path / "a" / pattern, tmp_path / "b" / pattern)
    names = [(file.name, file.code) for file in result.files]
    assert names == [("frame -0002", 0), ("frame 0001", 0), ("frame 0003", 4)]


def test_nothing_to_compare(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    expected = f"no images in {tmp_path / 'a'}, nor in {tmp_path / 'b'}"
    assert only(diff(tmp_path / "a", tmp_path / "b")) == (4, expected)


def test_an_image_against_a_folder(tmp_path):
    write_all(tmp_path, ["1.exr"])
    one, many = tmp_path / "1.exr", tmp_path
    expected = f"{one} is one image, but {many} is many; expected two of a kind"
    assert only(diff(one, many)) == (4, expected)
    assert only(diff(many, one)) == (4, expected)


def test_other_formats(tmp_path):
    from PIL import Image

    pixels = np.zeros((4, 6, 3), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    pixels[2, 3, 1] = 51
    Image.fromarray(pixels).save(tmp_path / "b.png")
    result = diff(tmp_path / "a.png", tmp_path / "b.png")
    assert result.code == 2
    assert rows(result)["G"].maximum == pytest.approx(0.2)
    assert rows(result)["G"].first == (3, 2)
    (tmp_path / "b.png").write_text("no picture")
    assert diff(tmp_path / "a.png", tmp_path / "b.png").code == 4


# --- the table ---


def test_the_table_has_a_line_for_each_channel(tmp_path):
    result = compare(tmp_path, image(), image(Z={(300, 3): 3.0, (301, 0): NAN}))
    assert diff_rows(result) == [
        ("a.exr", "0", "R", "match", "0", "0", "0", "0", "0", ""),
        ("a.exr", "0", "Z", "fail", "2", "0.000666889", "0.0365209", "2", "1", "3, 300"),
    ]


def test_each_channel_has_a_verdict_of_its_own(tmp_path):
    pixels = {"A": np.ones((10, 10), np.float32), "R": np.zeros((10, 10), np.float32)}
    other = {name: values.copy() for name, values in pixels.items()}
    other["R"][0, :3], other["A"][0, 0] = 0.5, 1.25
    a, b = tmp_path / "a.exr", tmp_path / "b.exr"
    write_exr(a, pixels, {})
    write_exr(b, other, {})

    def verdicts(**limits):
        return [(row[2], row[3]) for row in diff_rows(diff(a, b, Limits(**limits)))]

    assert verdicts() == [("A", "fail"), ("R", "fail")]
    assert verdicts(fail=0.3, warn=0.1) == [("A", "warn"), ("R", "fail")]
    assert verdicts(fail=0.3, warn=0.3) == [("A", "match"), ("R", "fail")]
    assert verdicts(fail_percent=2, warn_percent=2) == [("A", "match"), ("R", "fail")]
    other["R"][0, :3], other["A"][1, :3] = 0, 0.5
    other["R"][2, :3] = 1
    write_exr(b, other, {})
    assert verdicts(fail_percent=5, warn_percent=5) == [("A", "match"), ("R", "match"), ("together", "fail")]


def test_the_table_says_what_went_wrong(tmp_path):
    write_exr(tmp_path / "a.exr", image(), {})
    (line,) = diff_rows(diff(tmp_path / "a.exr", tmp_path / "no.exr"))
    said = f"{tmp_path / 'no.exr'}: no such file (expected an EXR)"
    assert line == ("a.exr", "", "", "file error", said, "", "", "", "", "")
    assert len(line) == len(COLUMNS)


@pytest.mark.parametrize("name", ["pipe.exr", "pipe.png", "x" * 300 + ".exr", "no.png", "text.png"])
def test_a_file_that_cannot_be_read_is_verdict_4(tmp_path, name):
    write_exr(tmp_path / "a.exr", {"R": np.zeros((2, 2), np.float16)}, {})
    if name.startswith("pipe"):
        os.mkfifo(tmp_path / name)
    if name == "text.png":
        (tmp_path / name).write_text("no picture")
    for pair in ((name, "a.exr"), ("a.exr", name)):
        assert diff(*(tmp_path / one for one in pair)).code == FILE


def test_an_image_whose_text_is_not_utf_8_is_verdict_4(tmp_path):
    write_exr(tmp_path / "a.exr", {"R": np.zeros((2, 2), np.float16)}, {"owner": "abc"})
    (tmp_path / "b.exr").write_bytes((tmp_path / "a.exr").read_bytes().replace(b"abc", b"\xffbc"))
    result = diff(tmp_path / "a.exr", tmp_path / "b.exr")
    assert result.code == FILE
    assert "holds text that is not UTF-8: the attribute 'owner'" in result.files[0].message
