"""The octree that sorting is compared with: what its leaves hold, and what facets are sent."""

from __future__ import annotations

import numpy as np
import pytest

import tests.helpers.in_memory as rig
from quiltcli.display import lit_facets
from quiltcli.layout import align
from quiltcli.visibility.binning.cones import facet_parts, lit_cones
from quiltcli.visibility.binning.octree import build_octree, facet_leaves, sent
from tests.helpers.packed_layouts import pack


def held_in(tree, leaf: int) -> list[int]:
    return tree.triangle[tree.start[leaf] : tree.start[leaf + 1]].tolist()


def corners_of(*triangles):
    vertices = np.array(triangles, np.float64).reshape(-1, 3)
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)


def test_small_triangles_are_in_the_leaf_that_holds_them_and_large_ones_in_those_they_meet() -> None:
    """A unit cube in 8 leaves: two tiny triangles at opposite corners, one in the plane x + y + z = 0.75."""
    tiny = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]])
    slanted = np.diag([0.75, 0.75, 0.75])
    vertices, triangles = corners_of(tiny, 1 - tiny, slanted)
    tree = build_octree(vertices, triangles, np.arange(3), depth=1)
    places = {tuple((tree.centre[k] > 0.5).astype(int)): held_in(tree, k) for k in range(len(tree.centre))}
    # The plane leaves out the leaf at (1, 1, 1), and touches those with two high axes in no point.
    assert places == {(0, 0, 0): [0, 2], (1, 0, 0): [2], (0, 1, 0): [2], (0, 0, 1): [2], (1, 1, 1): [1]}
    assert tree.half == pytest.approx(0.25, abs=1e-6)


def test_every_point_of_a_triangle_lies_in_a_leaf_that_holds_it() -> None:
    chance = np.random.default_rng(3)
    middles, size = chance.uniform(-1, 1, (200, 1, 3)), 10 ** chance.uniform(-3, 0.3, (200, 1, 1))
    vertices, triangles = corners_of(*(middles + size * chance.normal(size=(200, 3, 3))))
    drawn = np.flatnonzero(np.arange(200) % 5 > 0)
    tree = build_octree(vertices, triangles, drawn)
    assert len(tree.centre) <= 512
    holds = np.zeros((200, len(tree.centre)), bool)
    for leaf in range(len(tree.centre)):
        holds[held_in(tree, leaf), leaf] = True
    assert not holds[::5].any()
    weights = chance.dirichlet((0.5, 0.5, 0.5), 400)
    for t in drawn:
        points = weights @ vertices[triangles[t]]
        inside = (np.abs(points[:, None] - tree.centre) <= tree.half).all(axis=2)
        assert (inside & holds[t]).any(axis=1).all()


def test_a_triangle_is_kept_out_of_leaves_that_only_its_box_meets() -> None:
    """A long thin diagonal passes some twenty of the 512 leaves of its box."""
    vertices, triangles = corners_of(
        [[0, 0, 0], [0.96, 0.93, 0.87], [0.961, 0.93, 0.87]], [[1, 1, 1], [0.99, 1, 1], [1, 0.99, 1]]
    )
    tree = build_octree(vertices, triangles, np.arange(2))
    assert 8 <= np.count_nonzero(tree.triangle == 0) <= 22


@pytest.mark.parametrize("eye", [(2.2, 1.8, 3.2), (0.1, 0.2, -0.3)])
def test_facets_are_sent_all_that_sorting_finds_for_them(eye) -> None:
    """From outside the display and from inside it, where facets are on all sides."""
    v, t = rig.icosphere(1)
    turned = t.tolist() if eye[0] > 1 else t[:, ::-1].tolist()
    facets = rig.display(v, turned, 60)
    vertices, triangles = rig.icosphere(2)
    vertices = vertices * (0.8 if eye[0] > 1 else 3.0) - np.array(eye)
    layout = align(pack(facets, "rows", padding=2), facets)
    lit = lit_facets(facets, np.array(eye))
    parts = facet_parts(facets, layout, 2)
    all_of = np.arange(len(triangles))
    exact = rig.bin_triangles(vertices, triangles, all_of >= 0, parts, lit, np.array(eye))
    tree = build_octree(vertices, triangles, all_of)
    leaves = facet_leaves(tree, lit_cones(parts, lit, np.array(eye)), facets.count)
    found = {(facet, t) for facet, some, _ in sent(tree, leaves) for t in some.tolist()}
    needed = set(zip(exact.facet.tolist(), exact.triangle.tolist(), strict=True))
    assert needed <= found
    assert len(found) < 0.5 * lit.sum() * len(triangles)
    assert all(repeats >= some.size > 0 for _, some, repeats in sent(tree, leaves))


def test_nothing_to_draw_is_no_leaf() -> None:
    tree = build_octree(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32), np.zeros(0, np.int64))
    assert tree.start.tolist() == [0]
    assert len(tree.centre) == 0


def test_a_scene_in_one_plane_has_leaves_too() -> None:
    vertices, triangles = corners_of(*(np.array([[x, 0, 0], [x + 1, 0, 0], [x, 1, 0]]) for x in range(8)))
    tree = build_octree(vertices, triangles, np.arange(8))
    assert sorted(set(tree.triangle.tolist())) == list(range(8))
