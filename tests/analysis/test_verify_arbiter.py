"""The arbiter against closed forms, with rays that name the wrong triangle on purpose."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.analysis.verify.arbiter import CLOSE_BY, FAULT, IMPRECISE, judge
from quiltcli.visibility.rays.embree import MISS, UNSURE, aim, cast
from quiltcli.visibility.rays.exact import Neighbours, intersect
from quiltcli.visibility.rays.pixels import Places
from tests.helpers.in_memory import viewer

# Two triangles make the square 0…8 in the plane z = −2; a third lies at −3, a fourth just behind it.
VERTICES = np.array(
    [(0, 0, -2), (8, 0, -2), (8, 8, -2), (0, 8, -2)]
    + [(-9, -9, -3), (30, -9, -3), (-9, 30, -3)]
    + [(-9, -9, -3.00002), (30, -9, -3.00002), (-9, 30, -3.00002)],
    dtype=np.float64,
)
TRIANGLES = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (7, 8, 9)], np.int32)
EYE = viewer((0, 0, 0), (0, 0, -1))


def places(*centres):
    """Pixels of size 1 in the plane z = −2 with these centres; one step right is +x, one down is +y."""
    at = np.array(centres, float) - 0.5
    count = len(at)
    ray = np.tile(np.array([(1.0, 0, 0), (0, 1.0, 0), (0, 0, -2.0)]), (count, 1, 1))
    zero = np.zeros(count, np.int64)
    return Places(zero, zero, zero > 0, zero, at[:, 0], at[:, 1], ray)


def ruling(centre, named, drawn, z):
    target = aim(VERTICES, TRIANGLES, EYE, False)
    neighbours = Neighbours(VERTICES, TRIANGLES)
    named = np.array(named, np.int64)[:, None]
    verdict, shown = judge(target, neighbours, places(centre), named, np.array([drawn]), np.array([z], float))
    return int(verdict[0]), int(shown[0])


def test_distances_from_the_edges_and_depths_are_exact():
    target = aim(VERTICES, TRIANGLES, EYE, False)
    tests = intersect(target, places((5, 1), (5, 1), (5, 1)), np.arange(3), np.array([0, 1, 2]))
    assert tests.inside[:2] == pytest.approx([1, -(8**0.5)], abs=1e-12)
    assert tests.depth == pytest.approx([2, 2, 3], abs=1e-14)


def test_rays_that_name_the_neighbour_are_overruled():
    assert ruling((5, 1), [1] * 5, 0, 2) == (IMPRECISE, 0)


def test_rays_that_name_the_right_triangle_are_not():
    assert ruling((5, 1), [0] * 5, 1, 2) == (FAULT, -1)


def test_rays_that_miss_what_is_there_are_overruled():
    assert ruling((5, 1), [MISS] * 5, 0, 2) == (IMPRECISE, 0)
    assert ruling((5, -1), [MISS] * 5, 0, 2) == (FAULT, -1)


def test_a_hole_is_a_crack_inside_and_on_the_edge_of_two_triangles():
    assert ruling((5, 1), [0] * 5, -1, np.inf)[0] == FAULT
    assert ruling((4, 4), [0, 1, 0, 1, 0], -1, np.inf)[0] == FAULT
    assert ruling((60, 60), [0] * 5, -1, np.inf)[0] == IMPRECISE


def test_nothing_shows_through_the_edge_of_two_triangles():
    assert ruling((4, 4), [0, 1, 0, 1, 0], 2, 3)[0] == FAULT
    assert ruling((5, 0), [0, 2, 0, 2, 0], 2, 3)[0] == IMPRECISE  # the outline itself, on one edge only


def test_what_is_hidden_is_not_shown():
    assert ruling((5, 1), [0] * 5, 2, 3) == (FAULT, 2)


def test_two_surfaces_as_far_away_as_each_other():
    assert ruling((-1, -1), [2] * 5, 3, 3.00002) == (CLOSE_BY, 3)
    assert ruling((-1, -1), [2] * 5, -1, 3.00002) == (FAULT, -1)  # not among what the rays named
    assert ruling((-1, -1), [2, 2, 2, 2, 2, 3], -1, 3.00002) == (CLOSE_BY, 3)


def test_the_right_triangle_at_the_wrong_depth():
    assert ruling((5, 1), [0] * 5, 0, 2 * (1 + 1e-5))[0] == FAULT


class TestRays:
    """Rays straight down −z meet the square at 2, then the sheet at 3."""

    AHEAD = np.array([(1.0, 0.5, -2.0)]) / 5.25**0.5

    def shoot(self, near, far, depth="planar", culled=False):
        eye = viewer((0, 0, 0), (0, 0, -1), near, far, depth)
        return int(cast(aim(VERTICES, TRIANGLES, eye, culled), self.AHEAD)[0])

    def test_near_is_passed_and_far_is_not(self):
        assert (self.shoot(0.1, 9), self.shoot(2.5, 9), self.shoot(0.1, 1.9)) == (0, 2, MISS)

    def test_radial_depth_counts_along_the_ray(self):
        assert (self.shoot(0.1, 2.2, "radial"), self.shoot(0.1, 2.3, "radial")) == (MISS, 0)
        assert self.shoot(2.3, 9, "radial") == 2

    def test_a_surface_on_the_limit_is_left_open(self):
        assert (self.shoot(2, 9), self.shoot(0.1, 2)) == (UNSURE, UNSURE)

    def test_backfaces_are_passed(self):
        turned = TRIANGLES.copy()
        turned[:2] = turned[:2, ::-1]
        eye = viewer((0, 0, 0), (0, 0, -1))
        assert cast(aim(VERTICES, turned, eye, True), self.AHEAD).tolist() == [2]
        assert cast(aim(VERTICES, turned, eye, False), self.AHEAD).tolist() == [0]

    def test_an_empty_scene(self):
        nothing = np.empty((0, 3))
        target = aim(nothing, nothing.astype(np.int32), EYE, False)
        assert cast(target, self.AHEAD).tolist() == [MISS]
