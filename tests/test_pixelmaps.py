"""Layouts to other forms and back: what agrees, what is exact, and what is said when it cannot be."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flatdisplays import flat_display, moved, placed, rectangle
from turnedlayout import SIZE, turned_display, turned_layout

from quiltcli.display import build_facets, load_display
from quiltcli.errors import JobError, LayoutError, OutputError
from quiltcli.job import ResolutionSpec, load_display_file
from quiltcli.layout import (
    layout_from_uv,
    layout_text,
    pixel_owners,
    quilt_polygons,
    read_layout,
    write_layout,
)
from quiltcli.meshfile import read_mesh
from quiltcli.packing import pack
from quiltcli.pixelmaps import (
    FORMATS,
    facet_label,
    known_display,
    page_files,
    parse_label,
    read_map,
    write_map,
)
from quiltcli.pixelmaps.naming import existing_pages
from quiltcli.pixelmaps.placing import panel

MODELS = Path(__file__).parent.parent / "display_models"
PLACES = ("facet", "page", "size", "corner_start", "pages")
MEASURES = ("quilt_from_facet", "origin", "du", "dv", "polygon")
BOTH_WAYS = [name for name, entry in FORMATS.items() if entry.read]


def model(name, density):
    spec = load_display_file(MODELS / f"{name}.yaml")
    own = {facet: choice.model_copy(update={"facet_pixels": None}) for facet, choice in spec.facets.items()}
    resolution = ResolutionSpec(pixels_per_metre=density)
    return load_display(spec.model_copy(update={"resolution": resolution, "facets": own}))


@cache
def cube():
    facets = model("cube5", 60)
    return facets, pack(facets, size=(40, 40))


@cache
def cave():
    facets = model("cave5", 12)
    return facets, pack(facets)


@cache
def sphere():
    facets = model("sphere840", 200)
    return facets, pack(facets, size=(300, 200))


@cache
def turned():
    return turned_display(), turned_layout()


CASES = [cube, cave, sphere, turned]
every_case = pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)


def suffixed(path, name):
    return path / f"map{FORMATS[name].suffix}"


def assert_same_places(expected, actual, tolerance):
    for key in PLACES:
        np.testing.assert_array_equal(getattr(expected, key), getattr(actual, key), err_msg=key)
    for key in MEASURES:
        np.testing.assert_allclose(
            getattr(actual, key), getattr(expected, key), rtol=0, atol=tolerance, err_msg=key
        )


def world_of_pixels(layout):
    """Facet, and world position (P, 3), of every owned quilt pixel."""
    owners = pixel_owners(layout)
    address = np.flatnonzero(owners)
    facet = owners[address]
    row = np.searchsorted(layout.facet, facet)
    page = layout.page[row]
    local = address - layout.page_offset[page]
    xy = np.stack((local % layout.pages[page, 0] + 0.5, local // layout.pages[page, 0] + 0.5), axis=1)
    linear, shift = layout.quilt_from_facet[row, :, :2], layout.quilt_from_facet[row, :, 2]
    ij = np.linalg.solve(linear, (xy - shift)[:, :, None])[:, :, 0]
    return address, facet, layout.origin[row] + ij[:, :1] * layout.du[row] + ij[:, 1:] * layout.dv[row]


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
    layout = pack(facets)
    for name in BOTH_WAYS:
        write_map(layout, facets, suffixed(tmp_path, name), name)
        for display in (facets, None):
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
         " (expected .obj, .csv, .json, .mpcdi, .exr, .png, .svg)"),
        ("m", "has no suffix, which names no format (expected .obj, .csv, .json, .mpcdi, .exr, .png, .svg)"),
        ("m.exr", "holds ST maps of pages and facets, a format that is only written"
         " (formats to read: obj, csv, json, mpcdi, mpcdi1)"),
        ("m.csv", "cannot be read: No such file or directory"),
        ("m.json", "cannot be read: No such file or directory"),
        ("m.mpcdi", "cannot be read: No such file or directory"),
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
    known = "obj, csv, json, mpcdi, mpcdi1, st, png, svg"
    assert str(caught.value) == f"unknown format 'mpcd' (known: {known}; did you mean mpcdi?)"


def test_a_display_that_is_not_the_layouts(tmp_path):
    _, layout = cube()
    with pytest.raises(LayoutError, match="made for other geometry"):
        write_map(layout, turned_display(), tmp_path / "m.csv")
    assert list(tmp_path.iterdir()) == []


def test_the_display_a_layout_names_is_found(tmp_path):
    facets = load_display(load_display_file(MODELS / "cube5.yaml"))
    write_layout(pack(facets), tmp_path / "layout.yaml")
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


# --- CSV ---


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_table_is_for_people_to_read(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.csv")
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert lines[0].startswith(
        "id,name,page,x,y,width,height,rotation,mirror,page_width,page_height,origin_x"
    )
    assert [line.split(",0,")[0] for line in lines[1:3]] == ["1,a,1,1,2,13,9", "2,,2,1,2,9,13,90"]
    assert lines[3].startswith(
        "3,left wing,1,16,2,13,9,180,0,64,24,2,0,0,0.0009765625,0,0,0,-0.0009765625,0,0 2; 6.5 0;"
    )
    assert len(lines) == 9


def test_a_short_table_is_enough_with_a_display(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.csv")
    keep = ("id", "page", "x", "y", "width", "height", "rotation", "mirror")
    rows = rows_of(tmp_path / "m.csv")
    lines = ["; ".join(keep), *("; ".join(row[key] for key in keep) for row in reversed(rows))]
    lines[0] = lines[0].upper()
    (tmp_path / "short.csv").write_text("\ufeff" + "\r\n".join(lines))
    back = read_map(tmp_path / "short.csv", facets, size=(64, 24))
    assert_same_places(replace(layout, pages=np.array([[64, 24]] * 2, np.int32)), back, 0)


def test_names_find_facets_where_there_are_no_ids(tmp_path):
    facets = flat_display([rectangle(4, 3)] * 2, names=["one", "two"])
    (tmp_path / "m.csv").write_text("name,x,y,width,height\ntwo,0,0,4,3\n\none,5,1,4,3\n")
    layout = read_map(tmp_path / "m.csv", facets, size=(9, 4))
    assert layout.quilt_from_facet.tolist() == [moved(5, 1), moved(0, 0)]


HEAD = "id,page,x,y,width,height,rotation,mirror,page_width,page_height"
BAD_TABLES = {
    "": ["m.csv: is empty (expected a line of column names)"],
    "id,x,y\n1,2,3\n": ["m.csv:1: has no column width, height (columns found: id, x, y)"],
    f"{HEAD}\n": ["m.csv:1: has no lines below its column names (expected a line a facet)"],
    f"{HEAD}\n1,1,0,0,4,3,0,0,16,16\n1,1,5,0,4,3,0,0,16,16\n9,1,0,5,4,3,0,0,16,16": [
        "m.csv:3: id: facet 1 stands in line 2 already",
        "m.csv:4: id: facet 9 is not in flat.yaml, which has facets 1 to 2",
    ],
    f"{HEAD}\n1,1,a,0.5,4,3,45,maybe,16,16\n2,0,,0,4,0,0,0,16,16,7": [
        "m.csv:2: x: found 'a', expected a whole number",
        "m.csv:2: y: found '0.5', expected a whole number",
        "m.csv:2: rotation: found 45, expected 0, 90, 180 or 270",
        "m.csv:2: mirror: found 'maybe', expected 0 or 1",
        "m.csv:3: has 11 cells, but there are 10 columns",
        "m.csv:3: x: found '', expected a whole number",
        "m.csv:3: page: found 0, but pages count from 1",
        "m.csv:3: height: found 0, expected at least 1 pixel",
    ],
    f"{HEAD}\n1,1,0,0,4,3,0,0,16,16\n2,1,5,0,4,3,0,0,16,17": [
        "m.csv:3: page 1 is 16×17 here, but 16×16 in line 2"
    ],
    f"{HEAD}\n1,1,0,0,4,3,0,0,,\n2,1,5,0,4,3,0,0,,": [
        "m.csv: does not say how large page 1 is (expected the columns page_width and page_height, or a size)"
    ],
    f"{HEAD}\n1,1,0,0,4,3,90,0,16,16\n2,1,5,0,4,4,0,0,16,16": [
        "m.csv:2: width: facet 1 is 4×3 pixels turned by 90°, but its raster in flat.yaml is 4×3",
        "m.csv:3: width: facet 2 is 4×4 pixels, but its raster in flat.yaml is 4×3",
    ],
    f"{HEAD}\n1,1,0,0,4,3,0,0,16,16\n2,1,3,0,4,3,0,0,16,16": [
        "m.csv: facets 1 and 2 overlap in 3 pixels, the first at (3, 0) of page 1"
    ],
    f"{HEAD}\n1,1,0,0,4,3,0,0,16,16": [
        "flat.yaml: facet 2 of flat.yaml has no place; run quilt pack again, or disable it"
    ],
}


@pytest.mark.parametrize("text", BAD_TABLES)
def test_tables_that_make_no_layout(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    Path("m.csv").write_text(text)
    with pytest.raises(LayoutError) as caught:
        read_map("m.csv", flat_display([rectangle(4, 3)] * 2))
    found = [line.replace("facets: ", "").replace("m.csv: facet 2 of", "flat.yaml: facet 2 of")
             for line in str(caught.value).splitlines()]  # fmt: skip
    assert found == BAD_TABLES[text]


def test_a_table_without_rasters_needs_the_display(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("m.csv").write_text("id,x,y,width,height\n1,0,0,4,3\n")
    with pytest.raises(LayoutError) as caught:
        read_map("m.csv")
    vectors = ", ".join(f"{vector}_{axis}" for vector in ("origin", "du", "dv") for axis in "xyz")
    assert str(caught.value) == (
        f"m.csv:1: has no column {vectors}, polygon (columns found: id, x, y, width, height;"
        " name the display, and it says the rest)"
    )


def test_a_wrong_polygon_is_shown(tmp_path):
    write_map(turned_layout([0]), None, tmp_path / "m.csv")
    text = (tmp_path / "m.csv").read_text()
    (tmp_path / "m.csv").write_text(text.replace("0 2; 6.5 0; 13 4.25;", "0 2; 6.5; 13 4.25;"))
    with pytest.raises(LayoutError) as caught:
        read_map(tmp_path / "m.csv")
    assert str(caught.value) == (
        f"{tmp_path}/m.csv:2: polygon: found '0 2; 6.5; 13 4.25; 9 9; 2 7.5',"
        " expected 3 or more pairs such as 0 0; 9 0; 9 9"
    )


# --- JSON ---


def test_json_holds_what_programs_want_to_know(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.json")
    found = json.loads((tmp_path / "m.json").read_text())
    assert [page["size"] for page in found["pages"]] == [[64, 24], [72, 27]]
    entry = found["facets"][2]
    words = {"id": 3, "name": "left wing", "page": 1, "x": 16, "y": 2, "width": 13, "height": 9}
    words |= {"rotation": 180, "mirror": False}
    assert {key: entry[key] for key in words} == words
    corners = slice(*layout.corner_start[2:4])
    assert entry["quilt_polygon"] == quilt_polygons(layout)[corners].tolist()
    assert entry["polygon"] == layout.polygon[corners].tolist()


def test_json_is_the_layout_file_in_other_words(tmp_path):
    layout = replace(turned_layout(), display=str(tmp_path / "up" / "display.yaml"), method="rows", padding=3)
    write_map(layout, None, tmp_path / "m.json")
    back = read_map(tmp_path / "m.json")
    assert layout_text(back, tmp_path) == layout_text(layout, tmp_path)
    assert '"display": "up/display.yaml"' in (tmp_path / "m.json").read_text()


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        ('"method"', "method", ["5:3: is not JSON: expecting property name enclosed in double quotes"]),
        (
            '"page": 1',
            '"page": "1"',
            ["9:23: facets[0].page: expected a whole number, got the text '1' (write 1 without quotes)"],
        ),
        (
            '"du"',
            '"dw"',
            [
                "9:5: facets[0].du: missing key (world step to the next pixel right, metres)",
                "9:200: facets[0].dw: unknown key (known: id, page, size, quilt_from_facet, origin, du, dv,"
                " polygon)",
            ],
        ),
        ("[64, 24]", "[64]", ["7:22: pages[0].size: expected 2 whole numbers, width and height, got 1"]),
        ('"id": 2', '"id": 1', ["10:12: facets[1].id: facet 1 already has a place, at facets[0]"]),
    ],
)
def test_json_with_something_wrong(tmp_path, old, new, messages):
    write_map(turned_layout(), None, tmp_path / "m.json")
    text = (tmp_path / "m.json").read_text()
    assert old in text
    (tmp_path / "m.json").write_text(text.replace(old, new, 1))
    with pytest.raises((LayoutError, JobError)) as caught:
        read_map(tmp_path / "m.json")
    assert str(caught.value).splitlines() == [f"{tmp_path}/m.json:{message}" for message in messages]


# --- OBJ ---


def test_a_mesh_holds_metres_and_texture_coordinates(tmp_path):
    facets = flat_display([rectangle(4, 2)], names=["wall"])
    layout = placed(facets, [moved(2, 4)], (16, 8))
    assert write_map(layout, facets, tmp_path / "m.obj") == [tmp_path / "m.obj"]
    assert (tmp_path / "m.obj").read_text().splitlines() == [
        "# quilt page 1 of 1, 16x8 pixels",
        "# metres, Y up; u * 16 = pixels from the left, v * 8 = pixels from the bottom",
        "o facet_0001_wall",
        "v 0 0 0",
        "v 0.00390625 0 0",
        "v 0.00390625 -0.001953125 0",
        "v 0 -0.001953125 0",
        *("vt 0.125 0.5", "vt 0.375 0.5", "vt 0.375 0.25", "vt 0.125 0.25"),
        "f 4/4 3/3 2/2 1/1",
    ]


def test_faces_show_their_front_where_they_are_lit(tmp_path):
    for facets, layout in (cave(), turned(), cube()):
        write_map(layout, facets, tmp_path / "m.obj")
        for path in existing_pages(tmp_path / "m.obj"):
            mesh = read_mesh(path)
            for face in range(mesh.count):
                corners = mesh.vertices[mesh.corners[mesh.corner_start[face] : mesh.corner_start[face + 1]]]
                local = corners - corners[0]
                front = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
                facet, _ = parse_label(mesh.names[face])
                assert front @ facets.normal[facet - 1] > 0
            path.unlink()


def test_every_page_is_a_mesh_and_any_of_them_names_all(tmp_path):
    facets, layout = turned()
    written = write_map(layout, facets, tmp_path / "m.obj")
    assert [path.name for path in written] == ["m_page_01.obj", "m_page_02.obj"]
    assert_same_places(layout, read_map(tmp_path / "m.obj", facets), 0)
    assert_same_places(layout, read_map(written[1], facets), 0)


def test_other_programs_may_rename_and_reorder_faces_and_cut_digits(tmp_path):
    facets, layout = cube()
    one = pack(facets, size=(100, 100))
    write_map(one, facets, tmp_path / "m.obj")
    blocks = (tmp_path / "m.obj").read_text().split("o facet")[1:]
    lines, count = [], 0
    for block in reversed(blocks):  # vertices all on top, 6 digits, other winding and first corner
        rows = [line.split() for line in block.splitlines()[1:]]
        corners = [row[1:] for row in rows]
        points, uvs = corners[:4], corners[4:8]
        lines += [f"g wall.{count}", *(f"v {' '.join(f'{float(n):.6f}' for n in p)}" for p in points)]
        lines += [f"vt {' '.join(f'{float(n):.6f}' for n in uv)}" for uv in uvs]
        lines.append("f " + " ".join(f"{count + k}/{count + k}" for k in (3, 2, 1, 4)))
        count += 4
    (tmp_path / "other.obj").write_text("\n".join(lines))
    back = read_map(tmp_path / "other.obj", facets, size=(100, 100))
    assert_same_places(one, back, 0)
    assert layout.pages.tolist() != one.pages.tolist()


def test_a_mesh_that_is_not_the_display(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.obj")
    page = tmp_path / "m_page_01.obj"
    page.write_text(page.read_text().replace("v 0 -0.001953125 0", "v 0 -0.001963125 0", 1))
    (tmp_path / "m_page_02.obj").unlink()
    page.rename(tmp_path / "one.obj")
    with pytest.raises(LayoutError) as caught:
        read_map(tmp_path / "one.obj", facets)
    line = (tmp_path / "one.obj").read_text().splitlines().index("f 5/5 4/4 3/3 2/2 1/1") + 1
    assert str(caught.value) == (
        f"{tmp_path}/one.obj:{line}: face 1 (facet_0001_a) lies on no facet of flat.yaml; the nearest is 1"
    )


def test_a_mesh_that_does_not_say_enough(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    with pytest.raises(LayoutError) as caught:
        read_map(path)
    assert (
        str(caught.value) == f"{path}: does not say how large its page is, expected a size such as 3840x2160"
    )
    layout = read_map(path, size=(10, 10))
    assert (layout.size.tolist(), layout.pages.tolist()) == ([[10, 10]], [[10, 10]])
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(LayoutError) as caught:
        read_map(path, size=(10, 10))
    assert str(caught.value) == f"{path}: the mesh has no texture coordinates, which a layout is read from"


def test_a_mesh_with_a_facet_twice(tmp_path):
    facets, layout = turned()
    write_map(layout, facets, tmp_path / "m.obj")
    page = tmp_path / "m_page_01.obj"
    page.write_text(page.read_text().replace("o facet_0003_left_wing", "o facet_0005_e"))
    (tmp_path / "m_page_02.obj").unlink()
    text = page.read_text().replace("o facet_0005_e", "o facet_0005_x", 1)
    page.write_text(text)
    with pytest.raises(LayoutError) as caught:
        read_map(page)
    assert str(caught.value) == f"{page}: facet 5 is in the mesh twice"


def test_an_exported_mesh_is_display_and_layout_at_once(tmp_path):
    """What media servers do with it: the mesh is the display, its texture coordinates the layout."""
    facets, _ = cube()
    layout = pack(facets)
    write_map(layout, facets, tmp_path / "m.obj")
    width, height = layout.pages[0]
    (tmp_path / "d.yaml").write_text(
        f"quilt_display: 1\nmesh: m.obj\nresolution: {{pixels_per_metre: 60}}\n"
        f"layout: {{from_uv: true, size: [{width}, {height}]}}\n"
    )
    spec = load_display_file(tmp_path / "d.yaml")
    again = layout_from_uv(build_facets(read_mesh(spec.mesh), spec), (int(width), int(height)))
    for expected, found in zip(world_of_pixels(layout), world_of_pixels(again), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
