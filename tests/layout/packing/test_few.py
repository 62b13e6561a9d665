"""A few rectangles are arranged in every way there is: nothing better exists, and nothing is searched for."""

from __future__ import annotations

import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from quiltcli.layout import check_layout
from quiltcli.layout.packing.model import extents, page_count
from quiltcli.layout.packing.rectangles.few import few_enough, fewest_of_few, smallest_of_few
from quiltcli.layout.packing.rectangles.skyline import pack_skyline
from tests.helpers.flat_displays import flat_display, rectangle
from tests.helpers.packed_layouts import collisions, model, pack, wanted_of

PINWHEEL = [(64, 32), (32, 64), (64, 32), (32, 64), (32, 32)]


def display(*sizes):
    return flat_display([rectangle(*size) for size in sizes])


@pytest.fixture
def no_search(monkeypatch):
    """Whatever is packed now is packed without a search."""
    for name in ("best_page", "best_pages"):
        monkeypatch.setattr(sys.modules["quiltcli.layout.packing.pack"], name, None)


@pytest.mark.usefixtures("no_search")
@pytest.mark.parametrize("method", ["auto", "rects", "nest"])
@pytest.mark.parametrize("size", [None, (3840, 2160)])
@pytest.mark.parametrize("name", ["corner_billboard", "cube5", "cave5"])
def test_boxes_and_corners_are_packed_without_a_search(name, size, method):
    layout = pack(model(name), method, size)
    check_layout(layout)
    assert collisions(layout, 2) == 0


@pytest.mark.usefixtures("no_search")
def test_no_cut_from_edge_to_edge_divides_a_pinwheel():
    # Four bars around a square fill 96 × 96 pixels in one way only, in which no straight cut goes through.
    layout = pack(display(*PINWHEEL), padding=0)
    assert layout.pages.tolist() == [[96, 96]]
    assert collisions(layout, 0) == 0
    (page,) = pack(display(*PINWHEEL), padding=0, size=(96, 96)).pages.tolist()
    assert page == [96, 96]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("align", [1, 4])
def test_no_order_on_a_skyline_finds_a_smaller_page(seed, align):
    rng = np.random.default_rng(seed)
    facets = display(*rng.integers(20, 300, (4, 2)).tolist())
    wanted = wanted_of(facets, (16384, 16384), 3, align)
    result, (width, height) = smallest_of_few(wanted, None)
    assert page_count(result) == 1
    assert (extents(wanted, result) <= (width, height)).all()
    assert not (result.corner % align).any()
    for _ in range(300):
        order, lock = rng.permutation(4), rng.integers(0, 2, 4)
        page = (int(rng.integers(300, 1200)), 16384)
        tried = extents(wanted, pack_skyline(replace(wanted, page=page), order, lock)).max(axis=0)
        w, h = -(-tried // 16) * 16
        assert max(w, h) > 3 * min(w, h) or w * h >= width * height


def test_the_page_of_an_aspect_is_the_smallest_there_is():
    wanted = wanted_of(display((70, 30), (70, 30), (20, 60)), (16384, 16384), 2)
    # Two bars above each other take 70 × 62 pixels, and 92 with the third beside them.
    assert smallest_of_few(wanted, Fraction(3, 2))[1] == (96, 64)
    assert smallest_of_few(wanted, Fraction(1))[1] == (96, 96)


def test_the_fewest_pages_and_the_lowest_last_one():
    wanted = wanted_of(display((60, 90), (60, 50), (40, 100), (30, 40)), (100, 100), 0)
    result = fewest_of_few(wanted)
    # By area two pages would do for 14200 pixels; the two bars that fill one leave 60 × 50 and 30 × 40.
    assert page_count(result) == 2
    last = result.page == 1
    assert extents(wanted, result)[last, 1].max() == 50
    assert (extents(wanted, result) <= (100, 100)).all()


def test_as_few_as_can_be_are_turned():
    layout = pack(display((60, 20), (20, 60)), padding=0)
    turned = (layout.quilt_from_facet[:, 0, 0] == 0).sum()
    assert turned == 1  # side by side they take 64 × 48 pixels, one above the other unturned 64 × 80


def test_many_are_not_gone_through():
    assert not few_enough(wanted_of(display(*[(30, 20 + at) for at in range(6)]), (99, 99), 0))
    assert not few_enough(wanted_of(display(*[(30, 30)] * 8), (99, 99), 0))
    assert few_enough(wanted_of(display(*[(30, 30)] * 7), (99, 99), 0))
    assert not few_enough(wanted_of(display((30, 20)), (99, 99), 0, begun=1))
