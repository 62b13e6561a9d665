"""Places where renderers go wrong, held against rays: nothing may be missed there, by either side."""

from __future__ import annotations

import numpy as np
import pytest

from tests.helpers.in_memory import CUBE, CUBE_FACES, icosphere
from tests.helpers.verified_jobs import ball, found, shoot, write_job

RADIAL = "render: {depth: radial}\n"
WALL = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
PANEL = (WALL, [[0, 1, 2, 3]])


def good(job, covered):
    """The verdict on a frame in which nothing is wrong and at least so many pixels are covered."""
    verdict = shoot(job).verify()
    assert found(verdict) == {}, verdict.faults[:3]
    assert verdict.inside["covered"] > covered
    assert verdict.inside["triangles"] > covered // 4
    return verdict


def soup(count, seed, size=0.5, spread=1.0):
    """Triangles anywhere, through each other."""
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-spread, spread, (count, 1, 3)) + rng.normal(0, size, (count, 3, 3))
    return vertices.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def grid(side, low, high, z=0.0):
    """A square of 2·side² triangles in a plane of constant z."""
    at = np.linspace(low, high, side + 1)
    x, y = np.meshgrid(at, at)
    vertices = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, z)))
    a = (np.arange(side) + (side + 1) * np.arange(side)[:, None]).ravel()
    corners = ((a, a + 1, a + side + 2), (a, a + side + 2, a + side + 1))
    return vertices, np.concatenate([np.stack(c, axis=1) for c in corners])


@pytest.mark.parametrize("seed", range(3))
def test_a_soup_of_triangles_around_a_cube(tmp_path, seed):
    good(write_job(tmp_path, (CUBE, CUBE_FACES), soup(300, seed), (2.1, 1.7, 2.9)), 5000)


def test_a_facet_with_a_notch(tmp_path):
    corners = [(-1, -1, 0), (1, -1, 0), (1, 0.1, 0), (-0.2, 0.1, 0), (-0.2, 1, 0), (-1, 1, 0)]
    scene = soup(200, 4, 0.3, 0.8)
    good(write_job(tmp_path, (corners, [[0, 1, 2, 3, 4, 5]]), scene, (0.4, 0.3, 3)), 3000)


def test_facets_that_cross_each_other(tmp_path):
    crossing = [(-1, -1, -0.8), (1, -1, 0.8), (1, 1, 0.8), (-1, 1, -0.8)]
    display = (WALL + crossing, [[0, 1, 2, 3], [4, 5, 6, 7]])
    verdict = good(write_job(tmp_path, display, ball(0.8, 3), (-1.2, 0.3, 2.5)), 2000)
    assert verdict.lit == 2


def test_a_facet_behind_another_is_held_to_the_same(tmp_path):
    behind = [(x, y, -1) for x, y, _ in WALL]
    verdict = good(
        write_job(tmp_path, (WALL + behind, [[0, 1, 2, 3], [4, 5, 6, 7]]), ball(), (0, 0, 3)), 1500
    )
    assert verdict.lit == 2


@pytest.mark.parametrize("depth", ["planar", "radial"])
def test_from_inside_with_triangles_beside_and_behind_the_eye(tmp_path, depth):
    shell = np.array([(-20.0, -20, -20), (20, 20, -20), (20, -20, 20), (-20, 20, 20)])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    small, triangles = soup(200, 7, 0.6, 3)
    scene = (np.concatenate((shell, small)), [*faces, *(triangles + 4).tolist()])
    more = f"render: {{depth: {depth}}}\n"
    job = write_job(
        tmp_path, (CUBE, CUBE_FACES), scene, (0.2, 0.1, 0.3), (0.3, 0, -4), more=more, side="back"
    )
    verdict = good(job, 12000)
    assert verdict.lit == 6
    if depth == "radial":
        assert verdict.inside["covered"] == verdict.inside["pixels"]


@pytest.mark.parametrize("degrees", [1, 0.1, 0.01])
def test_just_off_the_plane_of_a_facet(tmp_path, degrees):
    eye = (3, 0.2, 3 * np.tan(np.radians(degrees)))
    job = write_job(tmp_path, PANEL, soup(400, 3, 0.3, 1), eye, density=100)
    good(job, 20000)


@pytest.mark.parametrize("step", [1, 2, 7])
def test_corners_exactly_on_pixel_centres(tmp_path, step):
    half = 32 - 0.5
    side = 63 // step * step
    scene = grid(side // step, -half / 32, (-half + side) / 32)
    verdict = shoot(write_job(tmp_path, PANEL, scene, (0, 0, 2), density=32)).verify()
    assert found(verdict) == {}
    assert verdict.inside["covered"] == side**2


def test_edges_that_run_through_pixel_centres(tmp_path):
    vertices, triangles = grid(21, -2, 2)
    turned = vertices @ np.array([[1, 1, 0], [-1, 1, 0], [0, 0, 1.0]])
    turned[:, :2] += 1 / 64
    verdict = good(write_job(tmp_path, PANEL, (turned, triangles), (0, 0, 2), density=32), 0)
    assert verdict.inside["covered"] == verdict.inside["pixels"] == 4096


def test_a_wall_of_slivers_much_narrower_than_pixels(tmp_path):
    rng = np.random.default_rng(5)
    top, bottom = (np.sort(rng.uniform(-2, 2, 3000)) for _ in range(2))
    top[[0, -1]] = bottom[[0, -1]] = (-2, 2)
    height, tilt = np.repeat((1.5, -1.5), 3000), np.concatenate((0.3 * top, 0.3 * bottom))
    vertices = np.column_stack((np.concatenate((top, bottom)), height, tilt))
    a = np.arange(2999)
    triangles = np.concatenate((np.stack((a, a + 3000, a + 1), 1), np.stack((a + 1, a + 3000, a + 3001), 1)))
    verdict = shoot(write_job(tmp_path, PANEL, (vertices, triangles), (0.1, 0.2, 2))).verify()
    assert found(verdict) == {}
    assert verdict.inside["covered"] == verdict.inside["pixels"] == 6400
    assert verdict.inside["several"] > 5000


def test_a_fan_of_needles(tmp_path):
    angle = np.linspace(0, 2 * np.pi, 2001)[:-1]
    rim = np.column_stack((1.5 * np.cos(angle), 1.5 * np.sin(angle), 0.2 * np.cos(7 * angle)))
    k = np.arange(2000)
    triangles = np.stack((np.full(2000, 2000), k, (k + 1) % 2000), axis=1)
    scene = (np.concatenate((rim, [(0.013, 0.007, 0.1)])), triangles)
    verdict = shoot(write_job(tmp_path, PANEL, scene, (0.1, 0.2, 2))).verify()
    assert found(verdict) == {}
    assert verdict.inside["covered"] > 5000


@pytest.mark.parametrize("height", [0.1, 0.01, 0.001])
def test_a_floor_up_to_the_horizon(tmp_path, height):
    """The steepest depths there are: a row of pixels a tenth of a pixel below the horizon."""
    far = 1e4
    floor = ([(-far, 0, far), (far, 0, far), (far, 0, -far), (-far, 0, -far)], [[0, 1, 2], [0, 2, 3]])
    eye = (0.1, height, 3)
    # The horizon lies at the height of the eye; the panel is moved so that centres are just below.
    panel = [(x, y + height + 0.5 / 32 - 0.1 / 32, z) for x, y, z in WALL]
    job = write_job(tmp_path, (panel, [[0, 1, 2, 3]]), floor, eye, (0.1, height, 0), density=32, far=1e6)
    good(job, 100)


@pytest.mark.parametrize("depth", ["planar", "radial"])
@pytest.mark.parametrize(("near", "far"), [(3.9, 100), (0.05, 3.6), (3.4, 3.9)])
def test_near_and_far_cut_triangles(tmp_path, depth, near, far):
    more = f"render: {{depth: {depth}}}\n"
    job = write_job(
        tmp_path, (CUBE, CUBE_FACES), ball(0.8, 3), (2.1, 1.7, 2.9), near=near, far=far, more=more
    )
    verdict = good(job, 400)
    whole = tmp_path / "whole"
    whole.mkdir()
    everything = good(write_job(whole, (CUBE, CUBE_FACES), ball(0.8, 3), (2.1, 1.7, 2.9), more=more), 400)
    assert verdict.inside["covered"] < everything.inside["covered"] or near == 3.9


def test_backface_culling(tmp_path):
    vertices, triangles = icosphere(2)
    scene = (vertices * 0.8, triangles[::2])
    culled = "render: {backface_culling: true}\n"
    one = good(write_job(tmp_path, (CUBE, CUBE_FACES), scene, (2.1, 1.7, 2.9), more=culled), 500)
    other = good(write_job(tmp_path, (CUBE, CUBE_FACES), scene, (2.1, 1.7, 2.9)), 500)
    assert one.inside["covered"] < other.inside["covered"]


def test_facets_lit_on_both_sides(tmp_path):
    verdict = good(write_job(tmp_path, (CUBE, CUBE_FACES), ball(), (2.1, 1.7, 2.9), side="both"), 2000)
    assert verdict.lit == 6


def test_two_surfaces_in_one_place_are_neither_wrong(tmp_path):
    vertices, triangles = ball()
    twice = (np.concatenate((vertices, vertices)), np.concatenate((triangles, triangles + len(vertices))))
    verdict = good(write_job(tmp_path, (CUBE, CUBE_FACES), twice, (2.1, 1.7, 2.9)), 0)
    assert verdict.inside["close"] + verdict.inside["triangles"] > 1000


def test_a_floor_seen_exactly_edge_on_shows_nothing(tmp_path):
    floor = ([(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)], [[0, 1, 2], [0, 2, 3]])
    panel = [(x, y + 1 / 64, z) for x, y, z in WALL]
    job = write_job(tmp_path, (panel, [[0, 1, 2, 3]]), floor, (0.1, 0, 3), (0.1, 0, 0), density=32)
    verdict = shoot(job).verify()
    assert found(verdict) == {}
