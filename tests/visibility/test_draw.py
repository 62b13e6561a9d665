"""Rasterization: closed forms, watertight meshes, exact depth, ties, and the limits of depth."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pytest

from quiltcli.geometry import dot
from quiltcli.visibility import draw as raster
from quiltcli.visibility.scan import small
from quiltcli.visibility.setup import blocks as raster_blocks
from tests.helpers.in_memory import cube, display, icosphere, panel, picture, pixel_rays, viewer

FRONT = viewer((0, 0, 2))
# One panel of 64 × 64 pixels, whose pixel (i, j) is the point (i/32 − 1, 1 − j/32, 0).
PIXELS = 64


def on_panel(points):
    """World points of the panel's pixel coordinates."""
    points = np.asarray(points, np.float64)
    return np.column_stack((points[:, 0] / 32 - 1, 1 - points[:, 1] / 32, np.zeros(len(points))))


def drawn(points, triangles, **keys):
    """Which triangle each of the panel's own pixels shows, −1 for none."""
    shown = picture(panel(), on_panel(points), triangles, FRONT, bleed=0, **keys)
    return shown.page(shown.triangle)[:PIXELS, :PIXELS]


def test_a_rectangle_of_two_triangles_covers_its_pixels_once():
    covered = drawn([(3, 5), (43, 5), (43, 25), (3, 25)], [(0, 1, 2), (0, 2, 3)])
    expected = np.zeros((64, 64), bool)
    expected[5:25, 3:43] = True
    np.testing.assert_array_equal(covered >= 0, expected)


def test_the_diagonal_belongs_to_one_side_of_it():
    covered = drawn([(0, 0), (64, 0), (0, 64)], [(0, 1, 2)])
    below = np.add.outer(np.arange(64), np.arange(64))  # pixel centres lie on x + y = 64 where this is 63
    assert (covered[below < 63] == 0).all()
    assert (covered[below > 63] == -1).all()


def split_grid(rng, cells, jitter):
    """A square of pixels cut into jittered triangles, its border in place."""
    at = np.linspace(4, 60, cells + 1)
    x, y = np.meshgrid(at, at)
    inner = np.zeros_like(x)
    inner[1:-1, 1:-1] = jitter * (56 / cells)
    points = np.stack((x + inner * rng.uniform(-1, 1, x.shape), y + inner * rng.uniform(-1, 1, x.shape)), -1)
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return points.reshape(-1, 2), triangles


@pytest.mark.parametrize("cells", [1, 2, 5, 14, 56, 80])
@pytest.mark.parametrize("lattice", [False, True])
def test_a_mesh_covers_every_pixel_exactly_once(cells, lattice):
    rng = np.random.default_rng(cells)
    points, triangles = split_grid(rng, cells, 0.35 if cells < 9 or not lattice else 0.0)
    if lattice:  # vertices, and with them edges, exactly on pixel centres; too small cells would fold over
        inner = (points > 4) & (points < 60)
        points[inner] = np.floor(points[inner]) + 0.5
    whole = drawn(points, triangles) >= 0
    assert whole[4:60, 4:60].all()
    assert not whole[:4].any()
    for _ in range(3):  # a pixel that two triangles claim shows when they are drawn apart
        some = rng.random(len(triangles)) < 0.5
        one, other = (drawn(points, triangles[pick]) >= 0 for pick in (some, ~some))
        assert not (one & other).any()
        np.testing.assert_array_equal(one | other, whole)


def test_slivers_close_the_gap_between_their_neighbours():
    fan = [(4.5 + k * 1e-7, 4) for k in range(8)] + [(60, 4), (30, 60), (4, 60), (4, 4)]
    triangles = [(k, k + 1, 9) for k in range(8)] + [(9, 10, 11), (9, 11, 0)]
    covered = drawn(fan, triangles) >= 0
    clean = drawn([(4, 4), (60, 4), (30, 60), (4, 60)], [(0, 1, 2), (0, 2, 3)]) >= 0
    np.testing.assert_array_equal(covered, clean)


def sphere_shells():
    vertices, triangles = icosphere(3)
    front = (
        dot(np.cross(*np.diff(vertices[triangles], axis=1).transpose(1, 0, 2)), vertices[triangles[:, 0]]) > 0
    )
    assert front.all()
    return vertices * 0.8, triangles


@pytest.mark.parametrize("eye", [(2.2, 1.8, 3.2), (1.05, 0.2, 0.3), (0.3, 4, 0.1)])
def test_front_and_back_of_a_closed_mesh_cover_the_same_pixels(eye):
    vertices, triangles = sphere_shells()
    seen_by = viewer(eye)
    local = vertices - seen_by.eye
    a, b, c = (local[triangles[:, k]] for k in range(3))
    facing = dot(a, np.cross(b, c)) < 0
    one, other = (picture(cube(), vertices, triangles[pick], seen_by) for pick in (facing, ~facing))
    assert (one.triangle >= 0).any()
    np.testing.assert_array_equal(one.triangle >= 0, other.triangle >= 0)


def test_depth_is_that_of_the_plane_behind_the_pixel():
    rng = np.random.default_rng(3)
    vertices = rng.uniform(-1, 1, (300, 3))
    triangles = rng.integers(0, 300, (100, 3))
    triangles = triangles[(np.diff(np.sort(triangles)) > 0).all(axis=1)]
    shown = picture(cube(), vertices, triangles, viewer((2.2, 1.8, 3.2)))
    seen = np.flatnonzero(shown.triangle >= 0)
    ray = pixel_rays(shown, seen)
    a, b, c = (vertices[triangles[shown.triangle[seen], k]] - shown.frame.viewer.eye for k in range(3))
    normal = np.cross(b - a, c - a)
    exact = dot(normal, a) / dot(normal, ray) * (ray @ shown.frame.viewer.look)
    steep = np.abs(dot(normal, ray)) < 1e-3 * np.sqrt(dot(normal, normal) * dot(ray, ray))
    assert seen.size > 5000
    np.testing.assert_allclose(shown.depth[seen][~steep], exact[~steep], rtol=2e-7)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_equal_depths_the_lower_triangle_is_seen(order):
    points = [(4, 4), (60, 8), (20, 60)]
    triangles = np.array([(0, 1, 2), (1, 2, 0)])[list(order)]
    covered = drawn(points, triangles)
    assert set(np.unique(covered)) == {-1, 0}


def test_nearer_triangles_hide_farther_ones_in_any_order():
    square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float64)
    vertices = np.concatenate([square * 0.5 + (0, 0, z) for z in (-2, 0.5, -1, 0.2)])
    triangles = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * k for k in range(4)])
    shown = picture(panel(), vertices, triangles, FRONT)
    assert set(np.unique(shown.triangle)) == {-1, 2, 3}
    np.testing.assert_allclose(shown.depth[shown.triangle >= 0], 1.5, rtol=1e-12)


WIDE = 9.013, 30.07  # no ray through a pixel's centre ends exactly on the floor's edge


def floor_and_back():
    """A floor that runs through below the eye, from far ahead to far behind it."""
    x, z = WIDE
    return np.array([(-x, -1, -z), (x, -1, -z), (x, -1, z), (-x, -1, z)]), [(0, 1, 2), (0, 2, 3)]


@pytest.mark.parametrize("depth", ["planar", "radial"])
def test_a_triangle_beside_and_behind_the_eye_needs_no_clipping(depth):
    vertices, triangles = floor_and_back()
    facets = cube(viewing_side="back")  # seen from inside, all around
    shown = picture(facets, vertices, triangles, viewer((0, 0, 0), (0, 0, -1), 0.01, 1000, depth))
    ray = pixel_rays(shown, np.flatnonzero(shown.mine))
    at = -1 / np.where(ray[:, 1] < 0, ray[:, 1], np.nan)
    hit = (np.abs(at * ray[:, 0]) < WIDE[0]) & (np.abs(at * ray[:, 2]) < WIDE[1])
    length = -at * ray[:, 2] if depth == "planar" else at * np.linalg.norm(ray, axis=1)
    hit &= length >= 0.01
    np.testing.assert_array_equal(shown.triangle[shown.mine] >= 0, hit)
    np.testing.assert_allclose(shown.depth[shown.mine][hit], length[hit], rtol=1e-6)


@pytest.mark.parametrize("depth", ["planar", "radial"])
def test_near_and_far_cut_through_triangles(depth):
    vertices, triangles = floor_and_back()
    near, far = 1.5, 4.0
    shown = picture(panel(density=64), vertices, triangles, viewer((0, 0, 1), (0, 0, 0), near, far, depth))
    everything = picture(
        panel(density=64), vertices, triangles, viewer((0, 0, 1), (0, 0, 0), 0.001, 1e6, depth)
    )
    inside = (everything.depth >= near) & (everything.depth <= far)
    assert 100 < inside.sum() < (everything.triangle >= 0).sum()
    np.testing.assert_array_equal(shown.triangle >= 0, inside)
    np.testing.assert_array_equal(shown.depth[inside], everything.depth[inside])


def test_what_lies_before_near_does_not_hide_what_lies_behind():
    square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float64)
    vertices = np.concatenate((square + (0, 0, 1.95), square * 3 + (0, 0, -1)))
    triangles = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    shown = picture(panel(), vertices, triangles, viewer((0, 0, 2), near=0.5))
    np.testing.assert_allclose(shown.depth[shown.mine], 3, rtol=1e-12)


def random_scene(seed):
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-1, 1, (250, 1, 3))
    size = 10 ** rng.uniform(-3, 0, (250, 1, 1))
    vertices = (centre + size * rng.uniform(-1, 1, (250, 3, 3))).reshape(-1, 3)
    return vertices, np.arange(750).reshape(-1, 3)


def test_small_and_large_paths_see_the_same(monkeypatch):
    vertices, triangles = random_scene(5)
    small_too = picture(cube(), vertices, triangles, viewer((2.2, 1.8, 3.2)))
    monkeypatch.setattr(raster, "LIMIT", 0)
    large_only = picture(cube(), vertices, triangles, viewer((2.2, 1.8, 3.2)))
    assert (small_too.triangle >= 0).sum() > 300
    np.testing.assert_array_equal(small_too.triangle, large_only.triangle)
    np.testing.assert_allclose(small_too.depth, large_only.depth, rtol=1e-13)


@pytest.mark.parametrize("classes", [0, 1, 2])
@pytest.mark.parametrize("width", [3, 8, 11, 40])
def test_coarse_classes_of_boxes_see_what_large_paths_see(monkeypatch, classes, width):
    """On facets as wide as they like, of which the narrowest are a microtile."""
    rng = np.random.default_rng(width)
    at = rng.uniform(-0.5, 0.5, (400, 1, 2)) * (width, 40)
    pixel = (at + rng.uniform(-1, 1, (400, 3, 2)) * rng.uniform(0.2, 7, (400, 1, 1))).reshape(-1, 2)
    points = np.column_stack((pixel / 32, rng.uniform(-0.1, 0, 1200)))
    facets, triangles = panel(width / 32, 40 / 32), np.arange(1200).reshape(-1, 3)
    monkeypatch.setattr(small, "_CLASSES", ((0, small._CLASSES[classes][1]),))
    by_boxes = picture(facets, points, triangles, FRONT, bleed=0)
    monkeypatch.setattr(raster, "LIMIT", 0)
    by_tiles = picture(facets, points, triangles, FRONT, bleed=0)
    assert (by_boxes.triangle >= 0).sum() > 20 * width
    np.testing.assert_array_equal(by_boxes.triangle, by_tiles.triangle)
    np.testing.assert_allclose(by_boxes.depth, by_tiles.depth, rtol=1e-13)


def test_blocks_do_not_show(monkeypatch):
    vertices, triangles = random_scene(6)
    seen_by = viewer((2.2, 1.8, 3.2))
    whole = picture(cube(60), vertices, triangles, seen_by)
    monkeypatch.setattr(raster_blocks, "SIDE", 64)
    monkeypatch.setattr("quiltcli.visibility.setup.prewarp.SIDE", 64)
    monkeypatch.setattr(raster_blocks, "BATCH_PIXELS", 5000)
    pieces = picture(cube(60), vertices, triangles, seen_by)
    assert len(pieces.frame.blocks.facet) > 2 * len(whole.frame.blocks.facet)
    np.testing.assert_array_equal(pieces.triangle, whole.triangle)
    # Planes of 1/t are rounded to 2⁻⁵⁰ of their greatest value in a block, over 512 pixels at most.
    np.testing.assert_allclose(pieces.depth, whole.depth, rtol=2.0**-38)


def test_workers_get_several_batches_each_and_none_shows(monkeypatch):
    monkeypatch.setattr(raster_blocks, "SIDE", 64)
    monkeypatch.setattr("quiltcli.visibility.setup.prewarp.SIDE", 64)
    monkeypatch.setattr(raster_blocks, "BATCH_PIXELS", 20_000)
    monkeypatch.setattr(raster_blocks, "_LEAST_PIXELS", 5000)
    shown = picture(cube(60), *random_scene(6), viewer((2.2, 1.8, 3.2)))
    blocks, seen = shown.frame.blocks, np.flatnonzero(shown.frame.pairs.per_block)
    pixels = 64 * np.add.reduceat(blocks.used.astype(int), blocks.tile_start[:-1])
    pixels[shown.frame.pairs.per_block == 0] = 0
    counts = []
    for workers in (1, 2, 3, 50):
        work = raster.batches(shown.frame, workers=workers)
        counts.append(len(work))
        held = np.concatenate([np.arange(*batch) for batch in work])
        assert np.isin(seen, held).all()
        assert (np.diff(held) > 0).all()
        assert max(pixels[slice(*batch)].sum() for batch in work) <= 20_000
        triangle = np.full(shown.owners.size, -1)
        for hits in chain.from_iterable(raster.rasterize(shown.frame, batch) for batch in work):
            hits.put(triangle, hits.triangle[:, None])
        np.testing.assert_array_equal(triangle, shown.triangle)
    assert counts[0] < counts[1] <= counts[2] <= counts[3]
    assert counts[1] >= 6


def test_bleed_continues_the_picture_past_the_edge():
    wall = np.array([(-99, -99, -5), (99, -99, -5), (99, 99, -5), (-99, 99, -5.0)])
    shown = picture(cube(), wall, [(0, 1, 2), (0, 2, 3)], viewer((2.2, 1.8, 3.2)), bleed=2)
    bleed = np.flatnonzero(shown.mine & (shown.owners < 0))
    ray = pixel_rays(shown, bleed)
    assert bleed.size > 100
    np.testing.assert_allclose(
        shown.depth[bleed], -8.2 / ray[:, 2] * (ray @ shown.frame.viewer.look), rtol=1e-6
    )
    assert (shown.triangle[shown.owners == 0] == -1).all()


def test_pixels_outside_a_facets_polygon_stay_empty():
    triangle = display([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [[0, 1, 2]], 32)
    wall = np.array([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1.0)])
    shown = picture(triangle, wall, [(0, 1, 2), (0, 2, 3)], FRONT, bleed=0)
    np.testing.assert_array_equal(shown.triangle >= 0, shown.owners == 1)


def test_the_picture_does_not_depend_on_which_way_the_viewer_looks():
    vertices, triangles = random_scene(7)
    one = picture(cube(), vertices, triangles, viewer((2.2, 1.8, 3.2), depth="radial"))
    other = picture(cube(), vertices, triangles, viewer((2.2, 1.8, 3.2), (0.4, -0.7, 0.1), depth="radial"))
    np.testing.assert_array_equal(one.triangle, other.triangle)
    np.testing.assert_array_equal(one.depth, other.depth)


def test_samples_look_beside_the_centre():
    points = [(10.25, 0), (20.25, 0), (20.25, 64), (10.25, 64)]
    left = drawn(points, [(0, 1, 2), (0, 2, 3)], sample=(-0.4, 0.0))[32] >= 0
    right = drawn(points, [(0, 1, 2), (0, 2, 3)], sample=(0.4, 0.0))[32] >= 0
    assert np.flatnonzero(left).tolist() == list(range(11, 21))
    assert np.flatnonzero(right).tolist() == list(range(10, 20))


def test_hits_and_missed_pixels_are_all_that_the_facets_own():
    vertices, triangles = icosphere(1)
    rng = np.random.default_rng(5)
    for points, faces in (
        (vertices * 0.6, triangles),
        (rng.normal(size=(90, 3)) * 0.5, np.arange(90).reshape(-1, 3)),
    ):
        shown = picture(display(vertices, triangles.tolist(), 70), points, faces, viewer((2.2, 1.8, 3.2)))
        count = np.zeros(shown.owners.size, int)
        for batch in raster.batches(shown.frame):
            drawing = raster.draw(shown.frame, batch)
            tiles = np.ones(shown.frame.blocks.used.size, bool)
            for part in (*(h.places for h in drawing.hits()), *drawing.missed(tiles, 0)):
                np.add.at(count, part.pixel, 1)
        facet = shown.frame.blocks.facet[shown.frame.pairs.per_block > 0]
        np.testing.assert_array_equal(count, np.isin(np.abs(shown.owners), facet + 1))
        assert np.count_nonzero((count > 0) & (shown.triangle < 0)) > 1000


def test_a_canvas_in_memory_that_was_used_shows_nothing_of_it():
    points = np.random.default_rng(8).normal(size=(300, 3)) * 0.4
    facets, eye = display(icosphere(1)[0], icosphere(1)[1].tolist(), 70), viewer((2.2, 1.8, 3.2))
    shown = [picture(facets, points * k, np.arange(300).reshape(-1, 3), eye) for k in (1.0, 0.8)]
    for _ in range(2):
        for one in shown:
            seen = np.full(one.owners.size, -1)
            for batch in raster.batches(one.frame):
                drawing = raster.draw(one.frame, batch)
                for hits in drawing.hits():
                    hits.put(seen, hits.triangle[:, None])
                drawing.done()
            np.testing.assert_array_equal(seen, one.triangle)


def evaluated(monkeypatch, points, triangles):
    """How many pixels large triangles take to evaluate, and what is seen."""
    count = []
    draw_large = raster.draw_large
    monkeypatch.setattr(raster, "draw_large", lambda *given: count.append(draw_large(*given)))
    shown = picture(panel(density=150), points, triangles, FRONT)
    monkeypatch.setattr(raster, "draw_large", draw_large)
    return sum(count), shown


def test_the_far_side_of_a_thin_wall_takes_no_work(monkeypatch):
    """Seen at a slant, depth differs by more across a microtile than from one side to the other."""
    near = np.array([(-6, -2, -3.5), (6, -2, 1), (0, 8, -1.2)])
    alone, one = evaluated(monkeypatch, near, [(0, 1, 2)])
    both = np.concatenate((near, near - (0, 0, 0.001)))
    together, two = evaluated(monkeypatch, both, [(0, 1, 2), (3, 5, 4)])
    assert together == 2 * alone < 1000  # where the walls end
    assert (one.triangle >= 0).sum() > 10_000
    np.testing.assert_array_equal(two.triangle, one.triangle)
    np.testing.assert_array_equal(two.depth, one.depth)


def test_what_several_surfaces_hide_together_takes_little_work(monkeypatch):
    """Patches of some ten pixels, none of which fills a microtile, before the same turned over."""
    points, triangles = split_grid(np.random.default_rng(3), 12, 0)
    front = on_panel(points)
    triangles = triangles[:, ::-1]  # counter-clockwise
    alone, one = evaluated(monkeypatch, front, triangles)
    count, size = len(front), len(triangles)
    both = np.concatenate((front, front - (0, 0, 0.1)))
    together, two = evaluated(monkeypatch, both, np.concatenate((triangles, count + triangles[:, ::-1])))
    assert alone > size * 64
    assert together < 1.4 * alone
    seen = one.triangle >= 0
    np.testing.assert_array_equal(two.triangle[seen], one.triangle[seen])


def test_the_least_key_of_a_microtile_is_that_of_pixels_the_facet_owns():
    vertices, triangles = icosphere(1)
    facets = display(vertices, triangles.tolist(), 140)
    shown = picture(facets, vertices * 0.7, triangles, viewer((2.2, 1.8, 3.2)))
    found = 0
    for batch in raster.batches(shown.frame):
        canvas = raster.draw(shown.frame, batch).canvas
        owned = np.unpackbits(canvas.owned, axis=1).view(bool)
        least = raster_blocks.least_keys(canvas)
        none = np.iinfo(np.int64).max
        for tile in np.flatnonzero(canvas.touched & canvas.used):
            assert least[tile] == np.where(owned[tile], canvas.keys[tile], none).min()
            found += bool(least[tile] and not canvas.keys[tile].all())
        assert (least[~canvas.used] > least[canvas.used].max()).all()
    assert found > 20
