"""Binning: no pair is lost, none is kept without need, and the first pass is sound on any display."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from quiltcli.display import lit_facets
from quiltcli.geometry import dot
from quiltcli.layout import align
from quiltcli.visibility.binning import pairs as binning
from quiltcli.visibility.binning.broad import ConeGrids, candidate_pairs, cube_faces, footprints
from quiltcli.visibility.binning.cones import by_corner, cone_planes, overlapping
from quiltcli.visibility.binning.cores import facet_cores
from quiltcli.visibility.binning.pairs import Cores, facet_parts, lit_cones
from quiltcli.visibility.draw import triangles_in_range
from tests.helpers.in_memory import CUBE, CUBE_FACES, bin_triangles, cube, display, icosphere, panel, viewer
from tests.helpers.packed_layouts import pack


def sphere_display():
    vertices, faces = icosphere(2)
    return display(vertices, faces.tolist(), 60)


def l_shape():
    """Two concave facets, one before the other."""
    corners = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]) - 1.0
    vertices = [(x, y, z) for z in (0.0, -0.7) for x, y in corners]
    return display(vertices, [list(range(6)), list(range(6, 12))], 40)


def crossed_panels():
    """Two panels that cut through each other, and a third that both hide in part."""
    vertices = [
        *[(-1, -1, -0.4), (1, -1, 0.4), (1, 1, 0.4), (-1, 1, -0.4)],
        *[(-1, -1, 0.4), (1, -1, -0.4), (1, 1, -0.4), (-1, 1, 0.4)],
        *[(-0.5, -0.5, -1), (1.5, -0.5, -1), (1.5, 0.5, -1), (-0.5, 0.5, -1)],
    ]
    return display(vertices, [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]], 40)


def room():
    """A cube seen from inside, on all sides of the viewer."""
    return display(CUBE, CUBE_FACES, 40, viewing_side="back")


def prism(strips, half=2.4):
    """Tall strips all around the origin, seen from inside, as a cylinder panorama cut into planes."""
    angle = 2 * np.pi * np.arange(strips) / strips
    ring = np.stack((np.sin(angle), np.zeros(strips), -np.cos(angle)), axis=1)
    low, ahead = np.arange(strips), np.roll(np.arange(strips), -1)
    faces = np.stack((low, ahead, ahead + strips, low + strips), axis=1)
    vertices = np.concatenate((ring + (0, -half, 0), ring + (0, half, 0)))
    return display(vertices, faces.tolist(), 100, viewing_side="both")


CASES = {
    "sphere": (sphere_display, (2.2, 1.8, 3.2)),
    "sphere, near": (sphere_display, (1.02, 0.1, 0.2)),
    "concave": (l_shape, (0.3, 0.2, 2.5)),
    "concave, one degree off its plane": (l_shape, (2.5, 0, 2.5 * np.tan(np.radians(1)))),
    "self-intersecting": (crossed_panels, (0.2, 0.3, 3)),
    "surround": (room, (0.3, 0.1, -0.2)),
    "strips around the eye": (lambda: prism(24), (0, 0, 0)),
    "strips around, one next to the eye": (lambda: prism(24), (0.131, 0.0, -0.98)),
}


class Binned:
    """A random scene, binned."""

    def __init__(self, make, eye, seed, bleed=2):
        rng = np.random.default_rng(seed)
        size = 10 ** rng.uniform(-2.5, 0.7, (400, 1, 1))
        corners = rng.uniform(-2.5, 2.5, (400, 1, 3)) + size * rng.uniform(-1, 1, (400, 3, 3))
        self.facets = make()
        self.layout = align(pack(self.facets, "rows"), self.facets)
        self.viewer = viewer(eye, depth="radial", near=1e-3)
        self.vertices = corners.reshape(-1, 3) - self.viewer.eye
        self.triangles = np.arange(1200, dtype=np.int32).reshape(-1, 3)
        depth = self.viewer.depth_of(self.vertices.T)
        wanted, _ = triangles_in_range(depth, self.vertices, self.triangles, self.viewer)
        self.parts = facet_parts(self.facets, self.layout, bleed)
        self.lit = lit_facets(self.facets, self.viewer.eye)
        self.pairs = bin_triangles(
            self.vertices, self.triangles, wanted, self.parts, self.lit, self.viewer.eye
        )
        self.cones = lit_cones(self.parts, self.lit, self.viewer.eye)

    def keys(self):
        return set(zip(self.pairs.triangle.tolist(), self.pairs.facet.tolist(), strict=True))

    def all_pairs(self):
        """Every pair that the exact test of all triangles against all cones finds."""
        corners = self.vertices[self.triangles]
        first, second = (g.ravel() for g in np.mgrid[: len(corners), : len(self.cones.facet)])
        meets = overlapping(by_corner(corners), self.cones.planes, self.cones.wide, first, second)
        return set(zip(first[meets].tolist(), self.cones.facet[second[meets]].tolist(), strict=True))

    def ahead(self):
        """Which triangles (T, F) lie in the half-space of each facet's middle: there the test is exact."""
        ahead = np.zeros((len(self.triangles), self.facets.count), bool)
        for k, facet in enumerate(self.cones.facet.tolist()):
            middle = self.cones.corners[k].mean(axis=0)
            ahead[:, facet] |= (self.vertices[self.triangles] @ middle > 0).all(axis=1)
        return ahead

    def sampled_pairs(self):
        """Pairs that random points of the triangles prove: a ray to them meets the facet."""
        rng = np.random.default_rng(1)
        weights = rng.dirichlet((0.5, 0.5, 0.5), 300)
        points = np.einsum("sk,tkc->tsc", weights, self.vertices[self.triangles])
        found = set()
        for k, facet in enumerate(self.cones.facet.tolist()):
            corners = self.cones.corners[k]
            planes = np.cross(corners, np.roll(corners, -1, axis=0))
            planes *= np.sign(planes @ corners.mean(axis=0))[:, None]
            inside = (points @ planes[np.abs(planes).max(axis=1) > 1e-12].T > 1e-12).all(axis=2).any(axis=1)
            found |= {(t, facet) for t in np.flatnonzero(inside).tolist()}
        return found


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", [1, 2])
def test_no_pair_that_a_ray_proves_is_lost(case, seed):
    binned = Binned(*CASES[case], seed)
    proven = binned.sampled_pairs()
    assert len(proven) > 10
    assert proven - binned.keys() == set()


@pytest.mark.parametrize("case", CASES)
def test_every_pair_passes_the_exact_test_and_every_triangle_that_does_is_paired(case):
    binned = Binned(*CASES[case], 3)
    exact, found = binned.all_pairs(), binned.keys()
    assert found - exact == set()
    core = Cores(binned.cones).met_by(binned.vertices)[binned.triangles]
    settled = {t for t in range(len(core)) if core[t, 0] >= 0 and (core[t] == core[t, 0]).all()}
    ahead = binned.ahead()
    assert {pair for pair in exact - found if ahead[pair]} == set()
    assert len([t for t, _ in found if t in settled]) == len(settled) == binned.pairs.settled


def test_pairs_come_by_facet_then_triangle_and_once():
    pairs = Binned(*CASES["self-intersecting"], 4).pairs
    keys = pairs.facet.astype(np.int64) << 32 | pairs.triangle
    assert (np.diff(keys) > 0).all()
    assert pairs.reaching == len(np.unique(pairs.triangle))


def test_among_very_many_pairs_small_triangles_are_kept_with_little_waste(monkeypatch):
    exact = Binned(*CASES["sphere"], 5)
    monkeypatch.setattr(binning, "_MANY", 0)
    quick = Binned(*CASES["sphere"], 5)
    assert exact.keys() < quick.keys()
    assert quick.pairs.facet.size <= 1.02 * exact.pairs.facet.size


def test_most_small_triangles_are_settled_by_the_first_pass():
    vertices, triangles = icosphere(5)
    layout = align(pack(facets := cube(200), "rows"), facets)
    eye = np.array([2.2, 1.8, 3.2])
    everything = np.ones(len(triangles), bool)
    parts = facet_parts(facets, layout, 2)
    pairs = bin_triangles(vertices - eye, triangles, everything, parts, lit_facets(facets, eye), eye)
    assert pairs.reaching == len(triangles)
    assert pairs.settled > 0.8 * pairs.reaching
    assert pairs.facet.size < 1.15 * pairs.reaching


def test_a_facet_alone_is_its_own_core():
    layout = align(pack(facets := panel(), "rows"), facets)
    lit = lit_cones(facet_parts(facets, layout, 2), np.ones(1, bool), np.array([0.0, 0, 3]))
    corners, counts = facet_cores(lit)
    np.testing.assert_array_equal(corners[0, : counts[0]], lit.corners[0])


def test_cores_of_neighbours_leave_the_bleed_between_them():
    strip = display(
        [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (0, 1, 0)], [[0, 1, 4, 5], [1, 2, 3, 4]], 100
    )
    facets, layout = strip, align(pack(strip, "rows"), strip)
    lit = lit_cones(facet_parts(facets, layout, 2), np.ones(2, bool), np.array([1.0, 0.5, 3]))
    corners, counts = facet_cores(lit)
    assert counts.tolist() == [4, 4]
    assert corners[0, :, 0].max() == pytest.approx(-0.03, abs=1e-4)  # two pixels of bleed and one more
    assert corners[1, :, 0].min() == pytest.approx(0.03, abs=1e-4)


def test_facets_behind_each_other_keep_only_what_they_do_not_share():
    two = display(
        [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-2, -2, -1), (2, -2, -1), (2, 2, -1), (-2, 2, -1)],
        [[0, 1, 2, 3], [4, 5, 6, 7]],
        40,
    )
    facets, layout = two, align(pack(two, "rows"), two)
    lit = lit_cones(facet_parts(facets, layout, 2), np.ones(2, bool), np.array([0.0, 0, 3]))
    _, counts = facet_cores(lit)
    assert counts.tolist() == [0, 4]  # of the larger one a side remains that the smaller does not reach


def test_nothing_is_lit_nothing_is_paired():
    vertices, triangles = icosphere(1)
    layout = align(pack(facets := panel(), "rows"), facets)
    eye = np.array([0.0, 0, -3])
    parts = facet_parts(facets, layout, 2)
    pairs = bin_triangles(vertices - eye, triangles, np.ones(80, bool), parts, lit_facets(facets, eye), eye)
    assert (pairs.facet.size, pairs.settled, pairs.reaching) == (0, 0, 0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31))
def test_the_cone_test_agrees_with_a_search_for_a_common_direction(seed):
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(2, 1, 3, 3)) + rng.normal(size=(2, 1, 1, 3)) * 2
    one = cone_planes(second)
    meets = bool(overlapping(by_corner(first), one, second, np.zeros(1, int), np.zeros(1, int))[0])
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), 4000)
    inside = (weights @ first[0] @ one[0].T > 1e-9).all(axis=1).any()
    other = cone_planes(first)
    inside |= (weights @ second[0] @ other[0].T > 1e-9).all(axis=1).any()
    assert meets or not inside


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31))
@example(72037)
def test_the_broad_phase_keeps_all_that_overlaps(seed):
    rng = np.random.default_rng(seed)
    polygons = rng.normal(size=(60, 1, 3)) * 2 + 10 ** rng.uniform(-2, 0.5, (60, 1, 1)) * rng.normal(
        size=(60, 3, 3)
    )
    targets = rng.normal(size=(40, 1, 3)) * 2 + 0.4 * rng.normal(size=(40, 3, 3))
    first, second = (g.ravel() for g in np.mgrid[:60, :40])
    meets = overlapping(by_corner(polygons), cone_planes(targets), targets, first, second)
    middle = targets.mean(axis=1)[second]
    meets &= (np.einsum("nkc,nc->nk", polygons[first], middle) > 0).all(axis=1)
    found = set(
        zip(*(i.tolist() for i in candidate_pairs(by_corner(polygons), ConeGrids(targets))), strict=True)
    )
    # A cone that reaches behind the eye may be taken for one that meets another, where nothing does.
    lost = set(zip(first[meets].tolist(), second[meets].tolist(), strict=True)) - found
    assert all(apart(polygons[a], targets[b]) for a, b in lost)


def apart(a, b):
    """Whether two cones of directions, a corner a row (3, 3), have none in common: by linear programming."""
    rows = np.vstack((np.hstack((a.T, -b.T)), [1, 1, 1, 0, 0, 0]))
    return linprog(np.zeros(6), A_eq=rows, b_eq=[0, 0, 0, 1], bounds=[(0, None)] * 6).status == 2


@pytest.mark.parametrize("eye", [(0, 0, 0), (0.2, -0.3, 0.1)])
def test_strips_around_the_eye_meet_their_neighbours_alone(eye):
    """Tall strips reach behind the planes of the faces above and below, and are no candidates there."""
    facets = prism(96)
    layout = align(pack(facets, "rows"), facets)
    cones = lit_cones(facet_parts(facets, layout, 1), np.ones(96, bool), np.array(eye, float))
    first, second = candidate_pairs(by_corner(cones.corners), cones.grids)
    apart = np.abs(first - second)
    assert set(np.unique(np.minimum(apart, 96 - apart))) >= {0, 1}
    # Strips narrow towards the middle of the faces above and below, where rectangles are a poor measure.
    assert first.size < 96 * 30


@pytest.mark.parametrize("seed", range(4))
def test_a_polygon_shows_on_a_face_only_within_its_rectangle(seed):
    rng = np.random.default_rng(seed)
    polygons = rng.normal(size=(300, 1, 3)) * 10 ** rng.uniform(-6, 1, (300, 1, 1)) + rng.normal(
        size=(300, 3, 3)
    )
    weights = rng.dirichlet((0.4, 0.4, 0.4), 500)
    shown = 0
    for frame in cube_faces(rng.normal(size=3)):
        prints = footprints(by_corner(polygons), frame)
        low, high = np.full((2, 300), np.inf), np.full((2, 300), -np.inf)
        low[:, prints.index], high[:, prints.index] = prints.low, prints.high
        points = np.einsum("sk,tkc->tsc", weights, polygons) @ frame.T
        x, y, w = np.moveaxis(points, 2, 0)
        seen = (w > 0) & (np.abs(x) <= w) & (np.abs(y) <= w)
        for axis, value in ((0, x), (1, y)):
            place = np.divide(value, w, out=np.zeros_like(w), where=seen)
            within = (place >= low[axis][:, None] - 1e-9) & (place <= high[axis][:, None] + 1e-9)
            assert within[seen].all()
        shown += int(seen.sum())
        covering = (prints.high - prints.low == 2).all(axis=0)
        assert covering.sum() < 0.4 * covering.size
    assert shown > 10_000


def test_cube_faces_are_six_right_handed_frames():
    for frame in (frames := cube_faces(np.array([0.3, -0.2, 0.9]))):
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert {tuple(np.round(f, 9)) for f in frames[:, 2]} == {tuple(-np.round(f, 9)) for f in frames[:, 2]}
    assert dot(frames[0, 2], np.array([0.3, -0.2, 0.9])) == pytest.approx(np.sqrt(0.94))
