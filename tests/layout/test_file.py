from __future__ import annotations

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quiltcli.errors import JobError, LayoutError, OutputError
from quiltcli.formats.yaml.source import read_yaml
from quiltcli.layout import check_layout, layout_text, read_layout, write_layout
from quiltcli.layout.file import number_text
from tests.helpers.flat_displays import flat_display, moved, placed, random_polygons, rectangle
from tests.helpers.packed_layouts import pack

GOOD = """\
quilt_layout: 1
display: "flat.yaml"
display_sha256: {sha}
method: "manual"
padding: 0
pages:
- size: [16, 8]
facets:
- id: 1
  page: 1
  size: [4, 3]
  quilt_from_facet: [[1, 0, 0], [0, 1, 0]]
  origin: [0, 0, 0]
  du: [0.0009765625, 0, 0]
  dv: [0, -0.0009765625, 0]
  polygon: [[0, 0], [4, 0], [4, 3], [0, 3]]
- id: 2
  page: 1
  size: [4, 3]
  quilt_from_facet: [[1, 0, 5], [0, 1, 0]]
  origin: [0, 0, 0]
  du: [0.0009765625, 0, 0]
  dv: [0, -0.0009765625, 0]
  polygon: [[0, 0], [4, 0], [4, 3], [0, 3]]
"""
TWO = flat_display([rectangle(4, 3)] * 2)


def same(a, b):
    """Whether two layouts say the same, bit for bit."""
    for field in fields(a):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if field.name in ("path", "place", "file_row"):
            continue
        if isinstance(left, np.ndarray):
            if left.dtype != right.dtype or left.shape != right.shape or left.tobytes() != right.tobytes():
                return False
        elif left != right:
            return False
    return True


def test_the_file_is_for_people_to_read():
    layout = placed(TWO, [moved(0, 0), moved(5, 0)], (16, 8))
    assert layout_text(layout) == GOOD.format(sha=TWO.sha256)


def test_facets_without_a_place_are_left_out():
    layout = placed(TWO, [moved(0, 0), moved(5, 0)], (16, 8), on=[-1, 0])
    assert re.findall("id: (.*)", layout_text(layout)) == ["2"]


def test_display_is_named_from_where_the_file_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    write_layout(placed(TWO, [moved(0, 0), moved(5, 0)]), "out/layout.yaml")
    assert 'display: "../flat.yaml"' in Path("out/layout.yaml").read_text()
    assert read_layout("out/layout.yaml").display == "flat.yaml"


def test_what_was_written_is_read_bit_for_bit(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    facets = flat_display(random_polygons(40, 5, 60, seed=3))
    layout = pack(facets, "rows", (128, 200))
    layout = replace(layout, origin=np.random.default_rng(3).normal(size=(40, 3)))
    write_layout(layout, "layout.yaml")
    assert same(layout, read_layout("layout.yaml"))


def test_facets_are_sorted_by_id_and_still_know_their_lines(tmp_path):
    head, first, second = re.split("(?=- id)", GOOD.format(sha="a" * 64))
    path = tmp_path / "layout.yaml"
    path.write_text(head + second.replace("[1, 0, 5]", "[1, 0, 14]") + first)
    with pytest.raises(LayoutError, match=r"layout\.yaml:12:21: facets\[0\]\.quilt_from_facet: facet 2: "):
        read_layout(path)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_read_back_as_themselves(value):
    back = float(number_text(value))
    assert (back, np.signbit(back)) == (value, np.signbit(value))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1"),
        (-12.0, "-12"),
        (0.5, "0.5"),
        (-0.0, "-0.0"),
        (1e-5, "1.0e-05"),
        (1.5e-7, "1.5e-07"),
        (1e300, "1.0e+300"),
    ],
)
def test_numbers_are_numbers_to_old_yaml_readers_too(value, text, tmp_path):
    assert number_text(value) == text
    path = tmp_path / "n.yaml"
    path.write_text(f"n: {text}\n")
    assert read_yaml(path)[0] == {"n": value}


def test_nothing_is_left_when_the_folder_is_missing(tmp_path):
    with pytest.raises(OutputError, match="No such file or directory"):
        write_layout(placed(TWO, [moved(0, 0), moved(5, 0)]), tmp_path / "no" / "layout.yaml")
    assert list(tmp_path.iterdir()) == []


def test_written_file_replaces_the_old_one_whole(tmp_path):
    path = tmp_path / "layout.yaml"
    path.write_text("old")
    write_layout(placed(TWO, [moved(0, 0), moved(5, 0)]), path)
    check_layout(read_layout(path))
    assert [file.name for file in tmp_path.iterdir()] == ["layout.yaml"]


BAD = {
    "overlap": (
        ("[1, 0, 5]", "[1, 0, 3]"),
        "20:21: facets[1].quilt_from_facet: facets 1 and 2 overlap in 3 pixels,"
        " the first at (3, 0) of page 1",
    ),
    "off the page": (
        ("[1, 0, 5]", "[1, 0, 13]"),
        "20:21: facets[1].quilt_from_facet: facet 2: corner 2 at (17, 0) lies outside page 1 of 16×8 pixels",
    ),
    "outside the raster": (
        ("  size: [4, 3]\n  quilt_from_facet: [[1, 0, 5]", "  size: [4, 2]\n  quilt_from_facet: [[1, 0, 5]"),
        "24:12: facets[1].polygon: facet 2: corner 3 at (4, 3) lies outside its raster of 4×2 pixels",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_problems_point_into_the_file(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (old, new), message = BAD[name]
    text = GOOD.format(sha="a" * 64)
    assert old in text
    Path("layout.yaml").write_text(text.replace(old, new))
    with pytest.raises(LayoutError) as caught:
        read_layout("layout.yaml")
    assert str(caught.value) == f"layout.yaml:{message}"


BROKEN = {
    "page missing": (
        (
            "page: 1\n  size: [4, 3]\n  quilt_from_facet: [[1, 0, 5]",
            "page: 2\n  size: [4, 3]\n  quilt_from_facet: [[1, 0, 5]",
        ),
        "facets[1].page",
    ),
    "same id": (("id: 2", "id: 1"), "facets[1].id"),
    "singular": (("[[1, 0, 5], [0, 1, 0]]", "[[1, 0, 5], [2, 0, 0]]"), "facets[1].quilt_from_facet"),
    "not finite": (("[1, 0, 5]", "[1, 0, .nan]"), "facets[1].quilt_from_facet"),
    "typo": (("padding: 0", "paddin: 0"), "paddin"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused_where_they_are_broken(name, tmp_path):
    (old, new), key = BROKEN[name]
    text = GOOD.format(sha="a" * 64)
    assert old in text
    path = tmp_path / "layout.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(JobError, match=re.escape(key)):
        read_layout(path)
