"""The optional search for few facets: valid whatever it finds, and close to what it is known to reach."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from quiltcli.errors import LayoutError
from quiltcli.layout import check_layout, fill, whole_pixel
from quiltcli.layout.packing import pack
from quiltcli.layout.packing.outlines.grown import grown_by_square, hull
from tests.helpers.flat_displays import flat_display, random_polygons, rectangle
from tests.helpers.packed_layouts import collisions

needs_spyrrow = pytest.mark.skipif(
    importlib.util.find_spec("spyrrow") is None, reason="spyrrow, an optional extra, is not installed"
)
FLAGS = [[[0, 0], [60, 0], [60, 20], [20, 20], [20, 60], [0, 60]], rectangle(37, 37)]


def test_a_polygon_grows_by_a_square():
    square = [[0, 0], [4, 0], [4, 4], [0, 4]]
    expected = [[-1, -1], [5, -1], [5, 5], [-1, 5]]
    assert grown_by_square(np.array(square, dtype=float), 1).tolist() == expected
    turned = grown_by_square(np.array(square[::-1], dtype=float), 1)
    assert sorted(turned.tolist()) == sorted(expected)


def test_an_edge_gets_the_corners_between_its_normals():
    triangle = np.array([[0.0, 0], [4, 0], [2, 3]])
    expected = [[-1, 1], [-1, -1], [5, -1], [5, 1], [3, 4], [1, 4]]
    assert grown_by_square(triangle, 1).tolist() == expected


def test_a_notch_shrinks_and_one_that_closes_is_gone():
    notched = np.array([[0.0, 0], [6, 0], [6, 6], [4, 6], [4, 2], [2, 2], [2, 6], [0, 6]])
    expected = [[-0.5, -0.5], [6.5, -0.5], [6.5, 6.5], [3.5, 6.5]]
    expected += [[3.5, 2.5], [2.5, 2.5], [2.5, 6.5], [-0.5, 6.5]]
    assert grown_by_square(notched, 0.5).tolist() == expected
    assert grown_by_square(notched, 1).tolist() == [[-1, -1], [7, -1], [7, 7], [-1, 7]]


@pytest.mark.parametrize("seed", range(20))
def test_a_grown_polygon_holds_every_shifted_one(seed):
    (polygon,) = random_polygons(1, 20, 60, seed)
    grown, half = grown_by_square(polygon, 1.5), 1.5
    corners = [polygon + half * np.array(sign) for sign in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    x, y = hull(grown).T
    for point in np.concatenate(corners):
        around = np.stack((x - point[0], y - point[1]), axis=1)
        turn = around[:, 0] * np.roll(around[:, 1], -1) - around[:, 1] * np.roll(around[:, 0], -1)
        assert turn.min() > -1e-6


@needs_spyrrow
@pytest.mark.parametrize(("padding", "align", "seed"), [(2, 1, 2), (3, 4, 3)])
def test_nothing_meets_in_what_the_search_finds(padding, align, seed):
    facets = flat_display(random_polygons(14, 20, 60, seed) + [np.array(flag, dtype=float) for flag in FLAGS])
    layout = pack(facets, "sparrow", padding=padding, align=align, seconds=0.4)
    check_layout(layout)
    assert whole_pixel(layout).all()
    assert collisions(layout, padding) == 0
    maps = layout.quilt_from_facet
    low = np.minimum(maps[:, :, :2] * layout.size[:, None], 0).sum(axis=2) + maps[:, :, 2]
    assert (low % align == 0).all()


@needs_spyrrow
def test_the_search_beats_the_default_for_few_shapes():
    facets = flat_display(random_polygons(24, 200, 900, seed=5))
    found, usual = (fill(pack(facets, method, seconds=4)) for method in ("sparrow", "auto"))
    assert found > usual


@needs_spyrrow
def test_around_pins_and_over_pages_it_packs_as_the_default_does():
    facets = flat_display([rectangle(30, 20)] * 6)
    layout = pack(facets, "sparrow", (64, 44), seconds=0.4)
    assert len(layout.pages) == 2
    again = pack(facets, "sparrow", pins=layout, seconds=0.4)
    assert again.quilt_from_facet.tolist() == layout.quilt_from_facet.tolist()
    with pytest.raises(LayoutError, match=r"at most 1 may be used; .* density of at most"):
        pack(facets, "sparrow", (64, 44), max_pages=1, seconds=0.4)


def test_without_the_library_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(LayoutError, match=r"^the method sparrow needs the package spyrrow \(pip install"):
        pack(flat_display([rectangle(4, 3)]), "sparrow")
