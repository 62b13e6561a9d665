"""Settling moves facets up and left as far as counting pixels says they can go."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.layout.packing.model import PackInput, PackResult, used_height
from quiltcli.layout.packing.outlines.settle import settle
from quiltcli.layout.packing.outlines.shapes import Shapes, facet_shapes
from quiltcli.layout.packing.outlines.shelves import ShelfRule, pack_shelves
from tests.helpers.flat_displays import flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import wanted_of


def scattered(count: int) -> PackResult:
    """Shapes in a row with plenty of room around each, in all orientations."""
    index = np.arange(count, dtype=np.int32)
    corner = np.stack((index % 4 * 64 + 9, index // 4 * 64 + 17), axis=1)
    return PackResult(np.zeros(count, np.int32), index % 4, index % 8 > 3, corner)


def painted(wanted: PackInput, shapes: Shapes, result: PackResult, at: int, grow: int = 0) -> np.ndarray:
    """Pixels a shape touches, or comes within `grow` of."""
    page = np.zeros((700, 300), dtype=np.bool_)
    where = int(result.turn[at]) + 4 * int(result.mirror[at])
    rows = shapes.rows(at, where)
    x, y = result.corner[at].tolist()
    for row, (left, right) in enumerate(zip(shapes.left[rows], shapes.right[rows], strict=True)):
        if right > left:
            page[max(y + row - grow, 0) : y + row + grow + 1, max(x + left - grow, 0) : x + right + grow] = 1
    return page


def collides(wanted: PackInput, shapes: Shapes, result: PackResult, at: int) -> bool:
    mine = painted(wanted, shapes, result, at, wanted.padding)
    others = [painted(wanted, shapes, result, other) for other in range(len(result.page)) if other != at]
    return bool((mine & np.any(others, axis=0)).any())


@pytest.mark.parametrize(("padding", "align"), [(0, 1), (2, 1), (3, 4)])
def test_facets_end_where_the_next_step_would_meet_another(padding, align):
    facets = flat_display(random_polygons(16, 20, 55, seed=padding))
    wanted = wanted_of(facets, (300, 700), padding, align, mirror=True)
    shapes = facet_shapes(wanted)
    start = scattered(16)
    start = PackResult(start.page, start.turn, start.mirror, start.corner // align * align)
    settled = settle(wanted, shapes, start, passes=50)
    assert (settled.corner <= start.corner).all()
    assert (settled.corner % align == 0).all()
    assert used_height(wanted, settled) < used_height(wanted, start)
    for at in range(16):
        assert not collides(wanted, shapes, settled, at)
        for axis in (0, 1):
            corner = settled.corner.copy()
            corner[at, axis] -= align
            moved = PackResult(settled.page, settled.turn, settled.mirror, corner)
            assert corner[at, axis] < 0 or collides(wanted, shapes, moved, at)


def test_a_facet_jumps_into_a_hole():
    facets = flat_display([rectangle(40, 10), rectangle(10, 10), rectangle(40, 10), rectangle(10, 10)])
    wanted = wanted_of(facets, (40, 100), padding=0)
    corner = np.array([[0, 0], [0, 10], [0, 20], [15, 30]], dtype=np.int32)
    none = np.zeros(4, np.int32)
    result = settle(wanted, facet_shapes(wanted), PackResult(none, none, none > 0, corner))
    assert result.corner.tolist() == [[0, 0], [0, 10], [0, 20], [10, 10]]


def test_pages_with_something_on_them_are_left_alone():
    facets = flat_display([rectangle(10, 10)] * 2)
    wanted = wanted_of(facets, (40, 100), padding=0, begun=1)
    corner = np.array([[9, 9], [9, 9]], dtype=np.int32)
    none = np.zeros(2, np.int32)
    page = np.array([0, 1], dtype=np.int32)
    result = settle(wanted, facet_shapes(wanted), PackResult(page, none, none > 0, corner))
    assert result.corner.tolist() == [[9, 9], [0, 0]]


def test_rows_of_shelves_sink_into_each_other():
    facets = flat_display(random_polygons(60, 20, 90, seed=4))
    wanted = wanted_of(facets, (400, 4000), padding=2)
    shapes = facet_shapes(wanted)
    shelves = pack_shelves(wanted, shapes, ShelfRule())
    assert used_height(wanted, settle(wanted, shapes, shelves)) < used_height(wanted, shelves)
