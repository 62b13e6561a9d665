from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quiltcli.errors import QuiltError
from quiltcli.layout import check_layout, fill, layout_text, whole_pixel
from quiltcli.layout.packing import METHODS, PackResult
from quiltcli.layout.packing.model import quilt_from_facet
from tests.helpers.flat_displays import flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import claimed, collisions, pack

every_method = pytest.mark.parametrize("method", METHODS)
BOXES = ("rows", "rects")
WHOLE = tuple(method for method in METHODS if method != "net")
QUICK = 0.1  # seconds of effort


def display(*sizes, **more):
    return flat_display([rectangle(*size) for size in sizes], **more)


def corners(layout):
    """Page (from 1) and top-left pixel of each placed raster."""
    maps = layout.quilt_from_facet
    low = np.minimum(maps[:, :, :2] * layout.size[:, None, :], 0).sum(axis=2) + maps[:, :, 2]
    return [(int(page) + 1, int(x), int(y)) for page, (x, y) in zip(layout.page, low, strict=True)]


def boxes(layout):
    """Page, left, top, right, bottom of each placed raster."""
    spread = np.abs(layout.quilt_from_facet[:, :, :2]) @ layout.size[:, :, None]
    return [
        (page, x, y, x + int(w), y + int(h))
        for (page, x, y), (w, h) in zip(corners(layout), spread[:, :, 0], strict=True)
    ]


def closest(layout):
    """Fewest free pixels, along x or y, between two rasters on the same page."""
    found = boxes(layout)
    gaps = [
        max(b[1] - a[3], a[1] - b[3], b[2] - a[4], a[2] - b[4])
        for i, a in enumerate(found)
        for b in found[:i]
        if a[0] == b[0]
    ]
    return min(gaps, default=10**9)


def said(facets, *arguments, **more):
    with pytest.raises(QuiltError) as caught:
        pack(facets, *arguments, **more)
    return str(caught.value).splitlines()


def test_rows_run_left_to_right_row_under_row_page_after_page():
    facets = display((4, 3), (5, 2), (3, 4), (9, 3), (6, 2))
    layout = pack(facets, "rows", (10, 9), padding=1)
    assert corners(layout) == [(1, 0, 0), (1, 5, 0), (1, 0, 4), (2, 0, 0), (2, 0, 4)]
    assert layout.pages.tolist() == [[10, 9], [10, 9]]


def test_rows_fill_a_page_to_its_last_pixel():
    layout = pack(display((4, 3), (4, 3), (4, 3), (4, 3)), "rows", (10, 8), padding=2)
    assert corners(layout) == [(1, 0, 0), (1, 6, 0), (1, 0, 5), (1, 6, 5)]


def test_a_higher_facet_takes_its_row_to_the_next_page():
    layout = pack(display((4, 3), (4, 3), (4, 6)), "rows", (9, 8), padding=0)
    assert corners(layout) == [(1, 0, 0), (1, 4, 0), (2, 0, 0)]


def test_rows_turn_only_what_does_not_fit():
    layout = pack(display((4, 3), (12, 3)), "rows", (10, 12), padding=1)
    assert layout.quilt_from_facet.tolist() == [[[1, 0, 0], [0, 1, 0]], [[0, -1, 8], [1, 0, 0]]]


def test_rects_fill_what_rows_cannot():
    facets = display((6, 2), (2, 6), (4, 4), (6, 2), (2, 4))
    assert pack(facets, "rects", (8, 8), padding=0).pages.shape[0] == 1
    assert pack(facets, "rows", (8, 8), padding=0).pages.shape[0] == 2


def test_rects_go_back_to_earlier_pages():
    layout = pack(display((8, 6), (8, 5), (8, 2), (8, 3)), "rects", (8, 8), padding=0)
    assert [page for page, _, _ in corners(layout)] == [1, 2, 1, 2]


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("mirror", [False, True])
def test_every_turn_and_mirror_is_a_copy_of_pixels(turn, mirror):
    facet = np.arange(12).reshape(3, 4)
    expected = np.rot90(facet[:, ::-1] if mirror else facet, -turn)
    result = PackResult(
        page=np.zeros(1, np.int32),
        turn=np.array([turn], np.int32),
        mirror=np.array([mirror]),
        corner=np.array([[5, 7]], np.int32),
    )
    linear = quilt_from_facet(np.array([[4, 3]], np.int32), result)[0]
    y, x = np.mgrid[0:3, 0:4] + 0.5
    quilt = np.einsum("ij,jyx->iyx", linear, np.stack((x, y, np.ones_like(x)))) - 0.5
    found = np.full(expected.shape, -1)
    found[quilt[1].astype(int) - 7, quilt[0].astype(int) - 5] = facet
    assert found.tolist() == expected.tolist()
    assert (quilt == quilt.round()).all()


@pytest.mark.parametrize("method", BOXES)
@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10**6), padding=st.integers(0, 3), size=st.sampled_from([None, (40, 30), (33, 64)])
)
def test_rectangles_never_come_nearer_than_the_padding(method, seed, padding, size):
    layout = pack(flat_display(random_polygons(12, 4, 28, seed)), method, size, padding, seconds=QUICK)
    assert closest(layout) >= padding


@every_method
@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    padding=st.integers(0, 3),
    size=st.sampled_from([None, (40, 30), (33, 64)]),
    align=st.sampled_from([1, 1, 2, 5]),
    mirror=st.booleans(),
)
def test_no_two_facets_ever_meet(method, seed, padding, size, align, mirror):
    facets = flat_display(random_polygons(9, 4, 28, seed))
    wishes = {} if method == "net" else {"align": align, "mirror": mirror}
    layout = pack(facets, method, size, padding, seconds=QUICK, **wishes)
    check_layout(layout)
    assert whole_pixel(layout).all()
    assert collisions(layout, padding) == 0
    if method != "net":
        assert all(x % align == 0 and y % align == 0 for _, x, y in corners(layout))
        assert abs(claimed(layout) - claimed(pack(facets, "rows", (64, 64)))) <= 12


@every_method
def test_same_display_same_layout(method):
    facets = flat_display(random_polygons(60, 5, 40, seed=5))
    one, other = (layout_text(pack(facets, method, seconds=QUICK)) for _ in range(2))
    assert one == other


@every_method
def test_disabled_facets_take_no_room(method):
    facets = display((4, 3), (100, 100), (4, 3), enabled=[True, False, True])
    layout = pack(facets, method, (16, 16))
    assert layout.facet.tolist() == [1, 3]
    assert np.ptp(layout.polygon.reshape(2, 4, 2), axis=1).tolist() == [[4, 3], [4, 3]]


@every_method
def test_layout_records_what_it_was_made_for(method):
    facets = display((4, 3))
    layout = pack(facets, method, (16, 16), padding=3)
    assert (layout.method, layout.padding, layout.display) == (method, 3, "flat.yaml")
    assert layout.display_sha256 == facets.sha256
    assert method == "net" or layout.origin.tolist() == facets.origin.tolist()


def test_better_methods_pack_better():
    facets = flat_display(random_polygons(80, 5, 90, seed=2))
    fills = [fill(pack(facets, method, seconds=2)) for method in ("rows", "rects", "nest", "auto")]
    assert fills[0] + 0.1 < fills[1]
    assert fills[1] + 0.1 < fills[2]
    assert fills[2] <= fills[3] + 0.02


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("size", "aspect"), [(None, None), (None, Fraction(16, 9)), ((200, 150), None)])
def test_auto_is_never_worse_than_what_it_tries(seed, size, aspect):
    facets = flat_display([*random_polygons(10, 20, 60, seed), *[rectangle(40 + at, 30) for at in range(12)]])
    pages = {}
    for method in ("auto", "rects", "nest"):
        layout = pack(facets, method, size, aspect=aspect, seconds=0.5)
        lowest = np.array([box[4] for box in boxes(layout)])[layout.page == layout.page.max()].max()
        pages[method] = (len(layout.pages), int(layout.pages[0].prod()) if size is None else int(lowest))
    assert pages["auto"] == min(pages["rects"], pages["nest"])


@pytest.mark.parametrize("turned", [False, True])
def test_equal_panels_stand_in_some_rows_and_lie_in_others(turned):
    # With their padding 15 panels 270 wide take 4078 of 4096 pixels, and 14 panels 276 wide take 3890. Any 15
    # rows hold 225 panels less one for each row that lies, and lying rows are 6 pixels lower: 9 may lie.
    size = (276, 270) if turned else (270, 276)
    lowest = 6 * 278 + 9 * 272 - 2
    layout = pack(display(*[size] * 216), "rects", (4096, lowest), padding=2, max_pages=1)
    assert len(layout.pages) == 1


@pytest.mark.parametrize("method", WHOLE)
def test_automatic_page_is_one_small_page_of_whole_blocks(method):
    layout = pack(display(*[(32, 32)] * 9), method, padding=0, seconds=1)
    assert layout.pages.tolist() == [[96, 96]]


@pytest.mark.parametrize("method", WHOLE)
def test_automatic_page_of_one_facet_is_that_facet(method):
    assert pack(display((320, 160)), method, seconds=QUICK).pages.tolist() == [[320, 160]]


@every_method
def test_automatic_pages_are_no_larger_than_hardware_takes(method):
    layout = pack(display(*[(16384, 9000)] * 2), method, seconds=QUICK)
    assert layout.pages.tolist() == [[16384, 16384]] * 2


def test_automatic_page_is_not_a_strip():
    width, height = pack(display(*[(1920, 1080)] * 5), seconds=QUICK).pages[0]
    assert max(width, height) <= 3 * min(width, height)


def test_facet_larger_than_the_page():
    facets = display((4, 3), (300, 200), names=["", "top"])
    assert said(facets, "rows", (100, 250)) == [
        "flat.yaml: facet 2 (top) is 300×200 pixels, more than a 100×250 page holds turned or not;"
        " a page of 300×200 would, or a density of at most 50 % of the present one"
    ]


def test_only_the_first_large_facets_are_listed():
    lines = said(display(*[(20, 20)] * 12), "rows", (16, 16))
    assert len(lines) == 11
    assert lines[-1] == "flat.yaml: 2 more facets are larger than the page"


def test_too_many_pages():
    assert said(display(*[(10, 10)] * 3), "rows", (16, 16), max_pages=2) == [
        "flat.yaml: 3 facets take 3 pages of 16×16 pixels by the method rows, but at most 2 may be used;"
        " 100 pixels of 1 facet find no place; a density of at most 70 % of the present one would do, or"
        " pages of 22×22 would"
    ]


def test_bad_arguments_are_told_together():
    facets = display((4, 3), enabled=[False])
    assert said(facets, "maxrect", (0, 16), padding=-1, max_pages=0) == [
        "method: expected auto, rows, rects, maxrects, nest or net, got the text 'maxrect' (did you mean"
        " 'maxrects'?)",
        "size[0]: must be at least 1, got 0",
        "max_pages: must be at least 1, got 0",
        "padding: must be at least 0, got -1",
    ]


def test_a_display_without_an_enabled_facet():
    facets = display((4, 3), enabled=[False])
    assert said(facets) == ["flat.yaml: no facet is enabled, so there is nothing to pack"]


def test_maxrects_is_another_name_of_rects():
    facets = flat_display(random_polygons(12, 4, 28, seed=3))
    one, other = (pack(facets, method, (70, 60)) for method in ("maxrects", "rects"))
    assert (one.method, other.method) == ("maxrects", "rects")
    assert one.quilt_from_facet.tolist() == other.quilt_from_facet.tolist()
