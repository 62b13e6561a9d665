"""Binning in shares: however the work is divided, the pairs are the same."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from quiltcli.display import lit_facets
from quiltcli.projection.planar import quilt_rays
from quiltcli.render.buffers import new_buffers
from quiltcli.render.crew import plan_of
from quiltcli.render.frame import draw_frame
from quiltcli.visibility.draw import pairs_by_block
from quiltcli.visibility.setup.prewarp import triangles_of
from quiltcli.visibility.shares import (
    bin_frame,
    bin_share,
    faces_eye,
    join,
    may_face,
    see_vertices,
    sight_of,
    unseen,
)
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import cube, display, viewer
from tests.helpers.wall_scene import lights, wall


@pytest.mark.parametrize("culling", [False, True])
@pytest.mark.parametrize("depth", ["planar", "radial"])
def test_shares_together_have_the_pairs_of_the_whole(culling, depth):
    stage = stage_of_facets(cube(), ball_scene(3))
    render = stage.job.render.model_copy(update={"backface_culling": culling})
    stage = replace(stage, job=stage.job.model_copy(update={"render": render}))
    # Some triangles are cut by near and far, some are left out.
    eye = viewer((2.2, 1.8, 3.2), near=3.7, far=4.2, depth=depth)
    rays = quilt_rays(stage.layout, lit_facets(stage.facets, eye.eye), eye.eye)
    plan = plan_of(stage, eye, rays)
    whole = bin_frame(plan)
    seen = unseen(stage.scene)
    for first, last in pairwise([0, 1, 100, 101, len(stage.scene.vertices)]):
        see_vertices(plan, slice(first, last), seen)
    ends = [0, 3, 500, 501, len(stage.scene.triangles)]
    shares = [bin_share(plan, slice(*part), seen) for part in pairwise(ends)]
    pairs = pairs_by_block([share.keys for share in shares], stage.blocks)
    found = join(sight_of(stage.scene, seen, culling=culling), shares, pairs)
    assert whole.sight.cut.any()
    assert whole.triangles < len(stage.scene.triangles)
    np.testing.assert_array_equal(found.sight.cut, whole.sight.cut)
    np.testing.assert_array_equal(found.pairs.per_block, whole.pairs.per_block)
    some = np.arange(0, stage.blocks.facet.size, 2)
    for ours, theirs in zip(found.pairs.of(some), whole.pairs.of(some), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    triangle, place = whole.pairs.of(some)
    assert (np.diff(place.astype(np.int64) << 32 | triangle) > 0).all()
    for count in ("triangles", "reaching", "settled", "facet_pairs"):
        assert getattr(found, count) == getattr(whole, count) > 0


@pytest.mark.parametrize("density", [100, 400, 700])
def test_triangles_well_inside_a_block_are_found_where_their_boxes_are(density):
    """Facets of one block and of several; what is settled at once is what the boxes of all pairs say."""
    stage = stage_of_facets(cube(density), ball_scene(5))
    eye = viewer((2.2, 1.8, 3.2))
    rays = quilt_rays(stage.layout, lit_facets(stage.facets, eye.eye), eye.eye)
    plan = plan_of(stage, eye, rays)
    seen = unseen(stage.scene)
    see_vertices(plan, slice(0, len(stage.scene.vertices)), seen)
    quick = bin_share(plan, slice(0, len(stage.scene.triangles)), seen)
    assert np.count_nonzero(seen.block >= 0) > 0.5 * seen.block.size
    if density > 256:
        assert len(np.unique(seen.block)) > 3
    seen.block[:] = -1
    slow = bin_share(plan, slice(0, len(stage.scene.triangles)), seen)
    assert quick.pairs == slow.pairs
    assert quick.settled == slow.settled
    # What is settled is not asked whether it meets the centre of a pixel at all.
    assert np.isin(slow.keys, quick.keys).all()
    more = np.setdiff1d(quick.keys, slow.keys)
    assert not np.isin(triangles_of(more), triangles_of(slow.keys)).any()
    assert more.size < 0.2 * slow.keys.size


@pytest.mark.parametrize("density", [60, 600])
def test_a_triangle_across_a_notch_is_seen_in_the_notch(density):
    """Of a facet that is not convex, corners in its arms do not tell what is between them."""
    corners = [(-1, -1), (1, -1), (1, 1), (0.4, 1), (0.4, -0.4), (-0.4, -0.4), (-0.4, 1), (-1, 1)]
    plug = [(-0.38, -0.38), (0.38, -0.38), (0.38, 1), (-0.38, 1)]
    facets = display([(x, y, 0.0) for x, y in corners + plug], [list(range(8)), [8, 9, 10, 11]], density)
    bar = np.array([(-0.7, 0.5, -0.5), (0.7, 0.5, -0.5), (0.7, 0.6, -0.5)])
    scene = replace(wall(lights(ambient=(1, 1, 1))), vertices=bar)
    stage = stage_of_facets(facets, scene)
    buffers = new_buffers(stage)
    draw_frame(stage, viewer((0, 0, 3)), buffers)
    seen = np.isfinite(buffers["Z"])
    for facet in (1, 2):
        assert np.count_nonzero(seen & (stage.owners == facet)) > 20


def test_vertices_seen_from_in_front_are_those_of_triangles_that_face_the_eye():
    ball = ball_scene(4)
    rng = np.random.default_rng(3)
    for eye in rng.normal(size=(20, 3)) * 2:
        towards = may_face(ball.facing, ball.vertices - eye)
        facing = np.zeros(len(ball.vertices), bool)
        facing[ball.triangles[faces_eye(ball.planes, eye)]] = True
        assert towards[facing].all()
        assert np.count_nonzero(towards & ~facing) < 0.1 * len(ball.vertices)


def test_vertices_of_triangles_that_face_every_way_are_seen_from_everywhere():
    back = replace(wall(lights()), triangles=np.array([[0, 1, 2], [0, 2, 1]], np.int32))
    for eye in ([0.0, 0, 2], [0.0, 0, -2]):
        assert may_face(back.facing, back.vertices - np.array(eye)).all()
