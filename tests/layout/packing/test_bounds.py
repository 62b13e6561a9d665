"""What no packing can be better than, and that a search ends there."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from quiltcli.layout.packing.bounds import fewest_pages, outline_area, smallest_page
from quiltcli.layout.packing.model import polygon_areas
from quiltcli.layout.packing.rectangles import rects
from tests.helpers.flat_displays import flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import model, pack, wanted_of


def squares(count, side=32):
    return flat_display([rectangle(side, side)] * count)


def test_the_smallest_page_by_area_in_closed_form():
    wanted = wanted_of(squares(12), (1, 1), 0)
    assert smallest_page(wanted, 12 * 32 * 32, 32, None) == (False, 128 * 96, 32)
    # A page of 2:1 in whole blocks: 144 × 72 is too small.
    assert smallest_page(wanted, 12 * 32 * 32, 32, Fraction(2)) == (False, 160 * 80, 80)
    assert smallest_page(wanted, 1e12, 32, None) == (False, 0, 0)


def test_padding_may_lie_beyond_the_edge():
    # Three squares and two paddings are 100 pixels wide, the third padding is past the page's end.
    wanted = wanted_of(squares(9), (100, 100), 2)
    least = 9 * 34 * 34
    assert fewest_pages(wanted, least) == 1
    assert fewest_pages(wanted, least + 1) == 2


def test_a_grown_disc_is_the_least_that_outlines_grow_to():
    side = np.array([30.0, 30.0])
    wanted = wanted_of(squares(2, 30), (1, 1), 4)
    assert outline_area(wanted, side * 30) == 2 * 34**2
    assert outline_area(wanted, side * 15) < 2 * (450**0.5 + 4) ** 2 < 2 * (450 + 4 * 60)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("method", ["rects", "nest"])
def test_no_page_is_smaller_than_the_bound(seed, method):
    facets = flat_display(random_polygons(12, 10, 60, seed))
    wanted = wanted_of(facets, (1, 1), 2)
    boxes = (wanted.size + 2.0).prod(axis=1).sum()
    least = boxes if method == "rects" else outline_area(wanted, polygon_areas(wanted))
    (width, height) = pack(facets, method, seconds=0.5).pages[0].tolist()
    assert smallest_page(wanted, least, 10, None) <= (False, width * height, abs(width - height))


def test_a_search_ends_when_nothing_can_be_better(monkeypatch):
    runs = []

    def counted(*arguments, **more):
        runs.append(1)
        return place(*arguments, **more)

    place = rects.pack_skyline
    monkeypatch.setattr(rects, "pack_skyline", counted)
    assert pack(squares(64), "auto", padding=0).pages.tolist() == [[256, 256]]
    assert len(runs) < 24


def test_rectangles_are_not_tried_when_outlines_take_less_than_they_can(monkeypatch):
    def never(*arguments, **more):
        raise AssertionError

    monkeypatch.setattr(rects, "pack_skyline", never)
    monkeypatch.setattr(rects, "place_maxrects", never)
    assert len(pack(model("sphere840")).pages) == 1
