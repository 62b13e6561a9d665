"""Layouts to other forms and back: what agrees, what is exact, and what is said when it cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.display import load_display
from quiltcli.errors import LayoutError, OutputError
from quiltcli.exchange.pixelmaps import (
    FORMATS,
    facet_label,
    known_display,
    page_files,
    parse_label,
    read_map,
    write_map,
)
from quiltcli.exchange.pixelmaps.naming import existing_pages
from quiltcli.exchange.pixelmaps.placing import panel
from quiltcli.job import load_display_file
from quiltcli.layout import read_layout, write_layout
from tests.helpers.flat_displays import flat_display, placed, rectangle
from tests.helpers.map_displays import (
    BOTH_WAYS,
    CASES,
    MODELS,
    assert_same_places,
    cube,
    suffixed,
    turned,
    world_of_pixels,
)
from tests.helpers.packed_layouts import pack
from tests.helpers.turned_layout import SIZE, turned_display, turned_layout

every_case = pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)


# --- round trips ---


@every_case
@pytest.mark.parametrize("name", BOTH_WAYS)
def test_there_and_back_with_the_display_changes_no_bit(tmp_path, case, name):
    facets, layout = case()
    write_map(layout, facets, suffixed(tmp_path, name), name)
    back = read_map(suffixed(tmp_path, name), facets)
    assert_same_places(layout, back, 0)
    assert back.display == facets.path
    assert back.display_sha256 == facets.sha256


@every_case
@pytest.mark.parametrize("name", ["csv", "json", "mpcdi", "mpcdi1"])
def test_there_and_back_without_the_display_changes_no_bit(tmp_path, case, name):
    _, layout = case()
    write_map(layout, None, suffixed(tmp_path, name), name)
    assert_same_places(layout, read_map(suffixed(tmp_path, name)), 0)


@every_case
def test_a_mesh_alone_says_where_every_pixel_lies_in_the_world(tmp_path, case):
    facets, layout = case()
    write_map(layout, facets, tmp_path / "map.obj")
    back = read_map(tmp_path / "map.obj")
    for expected, found in zip(world_of_pixels(layout), world_of_pixels(back), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_layout_that_leaves_facets_out_comes_back_with_their_ids(tmp_path):
    facets = replace(turned_display(), enabled=np.array([True, False, True, True, False, True, True, True]))
    layout = pack(facets, "rows")
    for name in BOTH_WAYS:
        write_map(layout, facets, suffixed(tmp_path, name), name)
        for display in (facets,) if name == "resolume" else (facets, None):
            back = read_map(suffixed(tmp_path, name), display)
            assert back.facet.tolist() == [1, 3, 4, 6, 7, 8]


def test_sheared_facets_go_through_json_obj_and_mpcdi(tmp_path):
    facets = flat_display([rectangle(8, 6), rectangle(8, 5)])
    sheared = [[[1, 0.5, 2], [0, 1, 1]], [[0.8, -0.6, 30], [0.6, 0.8, 3]]]
    layout = placed(facets, sheared, (48, 20))
    for name, exact in (("json", True), ("mpcdi", True), ("obj", False)):
        write_map(layout, facets, suffixed(tmp_path, name), name)
        back = read_map(suffixed(tmp_path, name), facets)
        if exact:
            assert_same_places(layout, back, 0)
        for expected, found in zip(world_of_pixels(layout), world_of_pixels(back), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_table_of_panels_holds_no_sheared_facets(tmp_path):
    layout = placed(flat_display([rectangle(8, 6)]), [[[1, 0.5, 2], [0, 1, 1]]], (20, 20))
    with pytest.raises(OutputError) as caught:
        write_map(layout, None, tmp_path / "map.csv")
    assert str(caught.value) == (
        f"{tmp_path}/map.csv: facet 1 is not moved by whole pixels with quarter turns, and so cannot stand"
        " in a table of panels (json and obj hold it)"
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_layout_gives_the_same_bytes(tmp_path, name):
    facets, layout = turned()
    first = write_map(layout, facets, suffixed(tmp_path, name), name)
    before = {path: path.read_bytes() for path in first}
    assert write_map(layout, facets, suffixed(tmp_path, name), name) == first
    assert {path: path.read_bytes() for path in first} == before


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path, name):
    facets, layout = cube()
    path = tmp_path / "gone" / f"map{FORMATS[name].suffix}"
    with pytest.raises(OutputError, match=r"cannot be written: No such file or directory$"):
        write_map(layout, facets, path)
    assert list(tmp_path.iterdir()) == []


# --- names ---


def test_labels_hold_id_and_name():
    assert facet_label(7, ["", "b"]) == "facet_0007"
    assert facet_label(2, ["", "left wing/ü #1"]) == "facet_0002_left_wing_ü_1"
    assert parse_label("facet_0002_left_wing") == (2, "left_wing")
    assert parse_label("facet_12345") == (12345, "")
    assert [parse_label(text) for text in ("face_1", "facet_", "facet_0000", "")] == [None] * 4


def test_pages_are_files_of_a_family(tmp_path):
    assert page_files(tmp_path / "a.obj", 1) == [tmp_path / "a.obj"]
    pages = page_files(tmp_path / "a.obj", 3)
    assert [path.name for path in pages] == ["a_page_01.obj", "a_page_02.obj", "a_page_03.obj"]
    for path in pages:
        path.touch()
    assert existing_pages(tmp_path / "a.obj") == pages
    assert existing_pages(pages[1]) == pages
    (tmp_path / "a.obj").touch()
    assert existing_pages(tmp_path / "a.obj") == [tmp_path / "a.obj"]
    assert existing_pages(tmp_path / "b.obj") == []


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("m.txt", "has the suffix '.txt', which names no format"
         " (expected .obj, .csv, .json, .mpcdi, .xml, .exr, .png, .svg)"),
        ("m", "has no suffix, which names no format"
         " (expected .obj, .csv, .json, .mpcdi, .xml, .exr, .png, .svg)"),
        ("m.exr", "holds ST maps of pages and facets, a format that is only written"
         " (formats to read: obj, csv, json, mpcdi, mpcdi1, resolume)"),
        ("m.csv", "no such file"),
        ("m.json", "no such file"),
        ("m.mpcdi", "no such file"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_read(tmp_path, name, message):
    with pytest.raises(LayoutError) as caught:
        read_map(tmp_path / name)
    assert str(caught.value) == f"{tmp_path / name}: {message}"


def test_formats_by_name(tmp_path):
    layout = turned_layout()
    assert write_map(layout, None, tmp_path / "m.txt", "csv") == [tmp_path / "m.txt"]
    assert_same_places(layout, read_map(tmp_path / "m.txt", format_name="csv"), 0)
    with pytest.raises(LayoutError) as caught:
        write_map(layout, None, tmp_path / "m.txt", "mpcd")
    known = "obj, csv, json, mpcdi, mpcdi1, resolume, st, png, svg"
    assert str(caught.value) == f"unknown format 'mpcd' (known: {known}; did you mean mpcdi?)"


def test_a_display_that_is_not_the_layouts(tmp_path):
    _, layout = cube()
    with pytest.raises(LayoutError, match="made for other geometry"):
        write_map(layout, turned_display(), tmp_path / "m.csv")
    assert list(tmp_path.iterdir()) == []


def test_the_display_a_layout_names_is_found(tmp_path):
    facets = load_display(load_display_file(MODELS / "cube5.yaml"))
    write_layout(pack(facets, "rows"), tmp_path / "layout.yaml")
    found = known_display(read_layout(tmp_path / "layout.yaml"))
    assert found is not None
    assert found.names == facets.names
    assert known_display(turned_layout()) is None
    assert known_display(turned_layout(), MODELS / "cube5.yaml").names == facets.names


# --- places in words ---


@pytest.mark.parametrize("turn", range(8))
def test_a_panel_is_its_matrix_in_words(turn):
    layout = turned_layout([turn])
    place = panel(layout, 0)
    assert (place.x, place.y, place.rotation, place.mirror) == (1, 2, 90 * (turn % 4), turn > 3)
    assert place.raster == tuple(SIZE)
    assert (place.width, place.height) == (tuple(SIZE) if turn % 2 == 0 else tuple(SIZE[::-1]))
    np.testing.assert_array_equal(layout.quilt_from_facet[0], place.quilt_from_facet)
