from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.errors import LayoutError
from quiltcli.layout import check_layout, whole_pixel
from tests.helpers.flat_displays import flat_display, moved, placed, rectangle

TWO = flat_display([rectangle(4, 3), rectangle(4, 3)])
GOOD = placed(TWO, [moved(0, 0), moved(5, 0)])


def changed(name, index, value):
    """The good layout with one number of one array changed."""
    array = getattr(GOOD, name).astype(np.int32 if name in ("page", "size", "pages") else float)
    array[index] = value
    return replace(GOOD, **{name: array})


def said(layout):
    with pytest.raises(LayoutError) as caught:
        check_layout(layout)
    return str(caught.value).splitlines()


def test_a_good_layout_passes():
    check_layout(GOOD)


BAD = {
    "no pages": (
        replace(GOOD, pages=np.zeros((0, 2), np.int32), page=np.array([-1, -1], np.int32)),
        "no pages; a layout needs at least one",
    ),
    "no facets": (
        replace(
            GOOD,
            facet=GOOD.facet[:0],
            page=GOOD.page[:0],
            corner_start=GOOD.corner_start[:1],
            polygon=GOOD.polygon[:0],
        ),
        "no facets; a layout needs at least one",
    ),
    "empty page": (changed("pages", (0, 1), 0), "page 1 is 16×0 pixels; both must be at least 1"),
    "id zero": (replace(GOOD, facet=np.array([0, 1])), "facet id 0; ids count from 1"),
    "id twice": (replace(GOOD, facet=np.array([2, 2])), "facet 2 is placed twice; an id may occur once"),
    "no such page": (changed("page", 1, 2), "facet 2 is on page 3, but there are only 1"),
    "empty raster": (changed("size", (0, 0), 0), "facet 1 is 0×3 pixels; both must be at least 1"),
    "map not finite": (
        changed("quilt_from_facet", (0, 0, 2), np.nan),
        "facet 1 has numbers in quilt_from_facet that are not finite",
    ),
    "origin not finite": (
        changed("origin", (1, 0), np.inf),
        "facet 2 has numbers in origin that are not finite",
    ),
    "du not finite": (changed("du", (1, 0), np.nan), "facet 2 has numbers in du that are not finite"),
    "corner not finite": (changed("polygon", (2, 0), np.nan), "facet 1 has corners that are not finite"),
    "two corners": (
        replace(GOOD, corner_start=np.array([0, 2, 8])),
        "facet 1 has 2 corners; a polygon has at least 3",
    ),
    "singular map": (
        changed("quilt_from_facet", 1, [[1, 2, 0], [2, 4, 0]]),
        "facet 2 is squeezed to a line; the determinant of quilt_from_facet is 0",
    ),
    "du along dv": (
        changed("du", 0, GOOD.dv[0]),
        "facet 1 has no area in the world: du and dv are parallel",
    ),
    "corner outside its raster": (
        changed("polygon", (2, 0), 4.25),
        "facet 1: corner 3 at (4.25, 3) lies outside its raster of 4×3 pixels",
    ),
    "off the page": (
        changed("quilt_from_facet", (1, 0, 2), 13.5),
        "facet 2: corner 2 at (17.5, 0) lies outside page 1 of 16×16 pixels",
    ),
    "above the page": (
        changed("quilt_from_facet", (1, 1, 2), -1),
        "facet 2: corner 1 at (5, -1) lies outside page 1 of 16×16 pixels",
    ),
    "overlap": (
        changed("quilt_from_facet", 1, moved(3, 1)),
        "facets 1 and 2 overlap in 2 pixels, the first at (3, 1) of page 1",
    ),
    "overlap in one pixel": (
        changed("quilt_from_facet", 1, moved(3, 2)),
        "facets 1 and 2 overlap in 1 pixel, the first at (3, 2) of page 1",
    ),
    "the same place": (
        changed("quilt_from_facet", 1, moved(0, 0)),
        "facets 1 and 2 overlap in 12 pixels, the first at (0, 0) of page 1",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_layout(name):
    layout, message = BAD[name]
    assert [f"flat.yaml: {message}"] == said(layout)


def test_raster_past_the_page_is_refused_though_the_polygon_is_inside():
    facets = replace(flat_display([rectangle(4, 3)]), size=np.array([[6, 3]], np.int32))
    message = "flat.yaml: facet 1: its raster reaches outside page 1 of 16×16 pixels"
    assert [message] == said(placed(facets, [moved(12, 0)]))


def test_raster_past_the_page_is_fine_for_a_facet_that_is_resampled():
    facets = replace(flat_display([rectangle(4, 3)]), size=np.array([[6, 3]], np.int32))
    check_layout(placed(facets, [moved(11.5, 0)]))


def test_every_problem_is_found_at_once():
    layout = replace(changed("page", 1, 7), size=np.array([[0, 3], [4, 3]], np.int32))
    assert said(layout) == [
        "flat.yaml: facet 2 is on page 8, but there are only 1",
        "flat.yaml: facet 1 is 0×3 pixels; both must be at least 1",
    ]


def test_places_and_overlaps_are_told_together_in_quilt_order():
    facets = flat_display([rectangle(4, 4)] * 4)
    layout = placed(facets, [moved(8, 8), moved(0, 0), moved(2, 0), moved(9, 9)])
    assert said(layout) == [
        "flat.yaml: facets 2 and 3 overlap in 8 pixels, the first at (2, 0) of page 1",
        "flat.yaml: facets 1 and 4 overlap in 9 pixels, the first at (9, 9) of page 1",
    ]


def test_only_the_first_overlaps_are_listed():
    facets = flat_display([rectangle(2, 2)] * 8)
    lines = said(placed(facets, [moved(0, 0)] * 8))
    assert len(lines) == 21
    assert lines[-1] == "flat.yaml: 8 more pairs of facets overlap"


def test_overlap_is_found_on_the_page_it_is_on():
    layout = placed(TWO, [moved(1, 2), moved(4, 4)], on=[1, 1], pages=2)
    assert said(layout) == ["flat.yaml: facets 1 and 2 overlap in 1 pixel, the first at (4, 4) of page 2"]


def test_the_same_place_on_two_pages_is_no_overlap():
    check_layout(placed(TWO, [moved(1, 2), moved(1, 2)], on=[0, 1], pages=2))


def test_facets_that_touch_do_not_overlap():
    check_layout(placed(TWO, [moved(0, 0), moved(4, 0)]))


@pytest.mark.parametrize(
    ("linear", "offset", "expected"),
    [
        ([[1, 0], [0, 1]], [3, 4], True),
        ([[0, -1], [1, 0]], [3, 4], True),
        ([[-1, 0], [0, 1]], [-3, 4], True),
        ([[0, 1], [1, 0]], [3, 4], True),
        ([[1, 0], [0, 1]], [3.5, 4], False),
        ([[1, 0], [0, 2]], [3, 4], False),
        ([[1, 1], [0, 1]], [3, 4], False),
        ([[1, 0], [1, 0]], [3, 4], False),
        ([[1, 1], [0, 0]], [3, 4], False),
        ([[0.6, -0.8], [0.8, 0.6]], [3, 4], False),
    ],
)
def test_whole_pixel_maps(linear, offset, expected):
    layout = placed(flat_display([rectangle(2, 2)]), [np.column_stack((linear, offset))])
    assert [expected] == whole_pixel(layout).tolist()
