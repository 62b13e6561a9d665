"""Tables of panels: what they hold, what is enough, and what is wrong with bad ones; and JSON."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import JobError, LayoutError
from quiltcli.exchange.pixelmaps import read_map, write_map
from quiltcli.layout import layout_text, quilt_polygons
from tests.helpers.flat_displays import flat_display, moved, rectangle
from tests.helpers.map_displays import assert_same_places, turned
from tests.helpers.turned_layout import turned_layout


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
                " polygon, surface)",
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
