"""Regions of a drawn canvas: what they are, and that parts of them see what they see."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.visibility import draw as raster
from quiltcli.visibility.draw import MixedTiles, WholeTiles
from quiltcli.visibility.resolve.visibility import SQUARE
from tests.helpers.in_memory import icosphere, panel, picture, viewer

EYE = viewer((0.3, 0.2, 2))
WALL = np.array([(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1.5)])


def scene(wall_alone: bool):
    """A bent wall behind the panel, and a ball before it."""
    ball, faces = icosphere(3)
    if wall_alone:
        return WALL, np.array([(0, 1, 2), (0, 2, 3)])
    return np.concatenate((WALL, ball * 0.3)), np.concatenate(([(0, 1, 2), (0, 2, 3)], faces + 4))


def drawings(shown):
    return [raster.draw(shown.frame, batch) for batch in raster.batches(shown.frame)]


def put(regions, shown):
    """Triangle and depth of every pixel, and how often each came."""
    triangle, depth = np.full(shown.owners.size, -1), np.full(shown.owners.size, np.inf)
    count = np.zeros(shown.owners.size, int)
    for region in regions:
        for hits in region.hits():
            hits.put(triangle, hits.triangle[:, None])
            hits.put(depth, hits.depth)
            np.add.at(count, hits.pixel, 1)
    return triangle, depth, count


@pytest.mark.parametrize("wall_alone", [True, False])
@pytest.mark.parametrize("largest", [1, SQUARE])
def test_every_pixel_that_sees_something_is_in_one_region(wall_alone, largest):
    shown = picture(panel(density=100), *scene(wall_alone), EYE)
    regions = [region for drawing in drawings(shown) for region in drawing.regions(largest=largest)]
    triangle, depth, count = put(regions, shown)
    np.testing.assert_array_equal(count, shown.triangle >= 0)
    np.testing.assert_array_equal(triangle, shown.triangle)
    np.testing.assert_allclose(depth, shown.depth, rtol=2.0**-45)
    sides = {region.side if isinstance(region, WholeTiles) else 0 for region in regions}
    assert sides == {0, 1, largest}


def test_squares_that_are_split_are_the_microtiles_that_would_have_been_found():
    shown = picture(panel(density=100), *scene(wall_alone=False), EYE)
    squares = 0
    smaller = []
    for drawing in drawings(shown):
        for region in drawing.regions():
            if isinstance(region, MixedTiles) or region.side == 1:
                smaller.append(region)
                continue
            one = np.arange(region.triangle.size) % 3 == 0
            parts = [*region.split(one), *region.split(~one)]
            assert sum(part.triangle.size for part in parts) == SQUARE**2 * region.triangle.size
            assert not any(list(part.split()) for part in parts)
            squares += region.triangle.size
            smaller += parts
    assert squares > 10
    triangle, depth, count = put(smaller, shown)
    np.testing.assert_array_equal(count, shown.triangle >= 0)
    np.testing.assert_array_equal(triangle, shown.triangle)
    np.testing.assert_array_equal(depth, shown.depth)


def test_a_part_of_a_region_and_the_rest_are_the_region():
    shown = picture(panel(density=100), *scene(wall_alone=False), EYE)
    parts = []
    for drawing in drawings(shown):
        for region in drawing.regions():
            if isinstance(region, WholeTiles):
                chosen = np.random.default_rng(3).random(region.triangle.size) < 0.4
                parts += [region.of(chosen), region.of(~chosen)]
                assert [part.triangle.size for part in parts[-2:]] == [chosen.sum(), (~chosen).sum()]
            else:
                parts.append(region)
    triangle, depth, count = put(parts, shown)
    np.testing.assert_array_equal(count, shown.triangle >= 0)
    np.testing.assert_array_equal(triangle, shown.triangle)
    np.testing.assert_allclose(depth, shown.depth, rtol=2.0**-45)
