from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.errors import LayoutError
from quiltcli.layout import align, read_layout, write_layout
from tests.helpers.flat_displays import PITCH, flat_display, moved, placed, rectangle
from tests.helpers.packed_layouts import pack

TWO = flat_display([rectangle(4, 3)] * 2, names=["left", "right"])
GOOD = placed(TWO, [moved(0, 0), moved(5, 0)])


def said(layout, facets=TWO):
    with pytest.raises(LayoutError) as caught:
        align(layout, facets)
    return str(caught.value).splitlines()


def only(layout, *rows):
    """The layout with these facets alone."""
    corners = [layout.polygon[layout.corner_start[r] : layout.corner_start[r + 1]] for r in rows]
    parts = {key: getattr(layout, key)[list(rows)] for key in ("facet", "page", "size", "quilt_from_facet")}
    steps = {key: getattr(layout, key)[list(rows)] for key in ("origin", "du", "dv")}
    start = np.cumsum([0, *map(len, corners)])
    return replace(layout, **parts, **steps, corner_start=start, polygon=np.concatenate(corners))


def test_rows_become_one_per_facet_of_the_display():
    facets = replace(TWO, enabled=np.array([False, True]))
    layout = align(only(pack(TWO), 1), facets)
    assert layout.facet.tolist() == [1, 2]
    assert layout.page.tolist() == [-1, 0]
    assert layout.polygon.tolist() == rectangle(4, 3) * 2


def test_disabled_facet_loses_its_place():
    layout = align(GOOD, replace(TWO, enabled=np.array([True, False])))
    assert layout.page.tolist() == [0, -1]


def test_rasters_of_the_layout_win():
    # The same rectangle in half the pixels, its raster's corner moved one pixel out.
    layout = replace(
        GOOD,
        origin=GOOD.origin - [2 * PITCH, 0, 0],
        du=GOOD.du * 2,
        size=np.array([[3, 3], [3, 3]], np.int32),
        polygon=GOOD.polygon / [2, 1] + [1, 0],
    )
    aligned = align(layout, TWO)
    assert aligned.du.tolist() == layout.du.tolist()
    assert aligned.origin.tolist() == layout.origin.tolist()
    assert aligned.size.tolist() == [[3, 3], [3, 3]]
    assert aligned.polygon.tolist() == layout.polygon.tolist()


def test_arguments_are_left_alone():
    before = TWO.origin.tobytes(), GOOD.page.tobytes()
    align(GOOD, replace(TWO, enabled=np.array([True, False])))
    assert (TWO.origin.tobytes(), GOOD.page.tobytes()) == before


def test_other_geometry_is_told_with_both_hashes():
    layout = replace(GOOD, display_sha256="0123456789abcdef" * 4)
    found = TWO.sha256[:12]
    assert said(layout) == [
        f"flat.yaml: made for other geometry: found the hash 0123456789ab…, but flat.yaml has {found}…;"
        " run quilt pack again"
    ]


def test_unknown_and_missing_facets_are_told_together():
    layout = replace(GOOD, facet=np.array([2, 5]))
    assert said(layout) == [
        "flat.yaml: facet 5 is not in flat.yaml, which has facets 1 to 2",
        "flat.yaml: facet 1 (left) of flat.yaml has no place; run quilt pack again, or disable it",
    ]


def test_other_corner_count():
    facets = flat_display([rectangle(4, 3), [[0, 0], [4, 0], [0, 3]]])
    layout = replace(GOOD, display_sha256="")
    assert said(layout, facets) == ["flat.yaml: facet 2 has 4 corners, but 3 in flat.yaml"]


def test_raster_beside_its_facet():
    layout = replace(GOOD, origin=np.array([[0, 0, 0], [0, 0, 0.25]]))
    assert said(layout) == [
        "flat.yaml: facet 2: corner 1 lies 0.25 m from where flat.yaml has it;"
        " origin, du, dv and polygon must agree with the display"
    ]


def test_problems_point_into_the_layout_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_layout(replace(GOOD, facet=np.array([2, 7]), display_sha256=""), "layout.yaml")
    layout = read_layout("layout.yaml")
    assert said(layout) == [
        "layout.yaml:16:7: facets[1].id: facet 7 is not in flat.yaml, which has facets 1 to 2",
        "layout.yaml:7:1: facets: facet 1 (left) of flat.yaml has no place;"
        " run quilt pack again, or disable it",
    ]
