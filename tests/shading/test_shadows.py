"""Shadows against closed forms: what is dark is what one can write down, to the pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from quiltcli.scene.lights import area, spot
from quiltcli.shading import adaptive
from quiltcli.shading.shadows import CENTRE, Sample, places
from quiltcli.visibility.rays.embree import has_embree
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import cube, viewer
from tests.helpers.shadow_scene import (
    CENTRE as DISC_CENTRE,
)
from tests.helpers.shadow_scene import (
    DISC,
    RADIUS,
    WALL,
    fine_panel,
    lamp,
    mesh,
    scene,
    seen,
    sun,
    two_panels,
)

pytestmark = pytest.mark.skipif(not has_embree(), reason="embreex is not installed")


def on_wall(found):
    """Places (n, 2) of the pixels that see the wall, their red, and their facet."""
    some = found["object"] == 1
    place = np.stack((found["P.X"], found["P.Y"]), axis=1)[some]
    return place, found["R"][some], found["facet"][some]


def circle_of(place):
    """Middle and radius of the disc's shadow on the wall in the light of a place."""
    x, y, z = place
    grown = (z - WALL) / (z - DISC)
    return np.array([x, y]) + (DISC_CENTRE - (x, y)) * grown, RADIUS * grown


def check_circle(found, middle, radius):
    """The pixels in a circle are dark and all others are not; there are some of each on both facets."""
    place, red, facet = on_wall(found)
    distance = np.linalg.norm(place - middle, axis=1)
    sure = np.abs(distance - radius) > 2e-4  # a disc of 720 sides is no circle
    assert np.count_nonzero(~sure) < 5
    np.testing.assert_array_equal((red == 0)[sure], (distance < radius)[sure])
    for number in (1, 2):
        dark = red[facet == number] == 0
        assert dark.sum() > 30
        assert (~dark).sum() > 30


LAMP = (-1.2, 0.2, 0.6)


def test_the_umbra_of_a_point_is_the_projected_circle_to_the_pixel_on_both_sides_of_a_seam():
    middle, radius = circle_of(LAMP)
    check_circle(seen(scene(lamp(LAMP))), middle, radius)


def test_the_shadow_of_a_sun_is_the_disc_itself():
    way = np.array((0.5, -0.1, -1.0))
    middle = DISC_CENTRE + way[:2] * (DISC - WALL)
    check_circle(seen(scene(sun(way))), middle, RADIUS)


def test_a_spot_is_dark_outside_its_cone_and_in_its_shadow():
    light = spot(LAMP, (0.5, 0, -1), (9, 9, 9), (0.3, 0.5), shadows=True)
    place, red, _ = on_wall(seen(scene((light,))))
    way = np.column_stack((place, np.full(len(place), WALL))) - LAMP
    cosine = way @ light.direction / np.linalg.norm(way, axis=1)
    middle, radius = circle_of(LAMP)
    distance = np.linalg.norm(place - middle, axis=1)
    sure = (np.abs(distance - radius) > 2e-4) & (np.abs(cosine - np.cos(0.5)) > 1e-3)
    expected = (cosine < np.cos(0.5)) | (distance < radius)
    np.testing.assert_array_equal((red == 0)[sure], expected[sure])


def test_what_lets_light_by_has_no_shadow():
    thin = replace(scene(lamp(LAMP)), lets_light_by=(1,))
    assert (on_wall(seen(thin))[1] > 0).all()


def test_a_light_without_shadows_shines_through_everything():
    lights = tuple(replace(light, shadows=False) for light in lamp(LAMP))
    assert (on_wall(seen(scene(lights)))[1] > 0).all()


@pytest.mark.parametrize("light", [lamp(LAMP), sun()])
def test_light_is_what_it_would_be_without_what_is_not_in_its_way(light):
    """Where nothing hides a lamp its light is the same to the bit, between the nodes and at pixels."""
    shadowed = seen(scene(light, roughness=0.4), fine_panel())
    plain = seen(scene(tuple(replace(one, shadows=False) for one in light), roughness=0.4), fine_panel())
    some = (shadowed["object"] == 1) & (shadowed["R"] > 0)
    assert np.count_nonzero(some) > 5000
    steps = shadowed["R"].view(np.int16).astype(int) - plain["R"].view(np.int16)
    assert np.abs(steps[some]).max() <= 1
    np.testing.assert_array_equal(shadowed["diffuse.R"][~some & (shadowed["object"] == 1)], 0)


@pytest.mark.parametrize("size", [False, True])
def test_nothing_is_interpolated_over_a_shadows_edge(size, monkeypatch):
    """Pixel by pixel and between nodes, light differs by a step of half floats at most."""
    square = area((0, 1.5, 0), (0, -0.5, -1), (0.5, 0.5), 0, (5, 4, 3))
    lights = (*lamp(LAMP), *sun(), square) if size else lamp(LAMP)
    drawn = scene(lights, color=(0.9, 0.5, 0.2))
    by_nodes = seen(drawn, fine_panel())
    asked, calm = adaptive.is_smooth, []

    def watched(squares, *given):
        calm.append(asked(squares, *given).sum())
        return np.zeros(squares.triangle.size, bool)

    monkeypatch.setattr(adaptive, "is_smooth", watched)
    by_pixels = seen(drawn, fine_panel())
    assert sum(calm) > 100 or size  # none is near a lamp with a size
    assert (by_pixels["R"] == 0).mean() > 0.1 or size
    for name in ("R", "G", "B", "diffuse.R"):
        steps = by_nodes[name].view(np.int16).astype(int) - by_pixels[name].view(np.int16)
        assert np.abs(steps).max() <= 1


def test_a_smooth_ball_does_not_shade_itself():
    """On a coarse ball the border of light is where the normals say, not along its facets."""
    ball = ball_scene(2, 0.8, sun((0.3, -0.2, -1)))
    facets = cube(30)
    found = seen(ball, facets, eye=(2.2, 1.8, 3.2))
    plain = seen(
        replace(ball, lights=tuple(replace(light, shadows=False) for light in ball.lights)),
        facets,
        eye=(2.2, 1.8, 3.2),
    )
    lit = plain["R"] > 0
    assert np.count_nonzero(lit) > 500
    assert np.count_nonzero(found["R"][lit] == 0) <= 0.002 * np.count_nonzero(lit)


# --- lamps with a size


def half_hidden(rays=16, samples=1):
    """A wall, lit from the front by a square half of which a screen hides from the middle of the wall."""
    corners = [(-4, -4, -2), (4, -4, -2), (4, 4, -2), (-4, 4, -2)]
    screen = [(0, -4, -1), (4, -4, -1), (4, 4, -1), (0, 4, -1)]
    triangles = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    light = area((0, 0, 0), (0, 0, -1), (1, 1), 0, (2, 2, 2), rays=rays)
    drawn = mesh([*corners, *screen], triangles, [0, 0, 1, 1], (light,), specular=0.0)
    return seen(drawn, two_panels(24), samples=samples)


@pytest.mark.parametrize(("rays", "samples"), [(16, 1), (16, 4), (64, 1)])
def test_half_shadow_falls_from_all_of_a_lamp_to_nothing(rays, samples):
    """A straight edge half-way hides of a square lamp a share that grows evenly from −½ m to ½ m."""
    place, red, _ = on_wall(half_hidden(rays, samples))
    open_place, whole, _ = on_wall(
        seen(
            mesh(
                [(-4, -4, -2), (4, -4, -2), (4, 4, -2), (-4, 4, -2)],
                [(0, 1, 2), (0, 2, 3)],
                [0, 0],
                (area((0, 0, 0), (0, 0, -1), (1, 1), 0, (2, 2, 2)),),
                specular=0.0,
            ),
            two_panels(24),
        )
    )
    keys = {tuple(p): value for p, value in zip(open_place.tolist(), whole, strict=True)}
    share = np.array([r / keys[tuple(p)] for p, r in zip(place.tolist(), red, strict=True)])
    x = place[:, 0]
    assert (share[x < -0.51] == 1).all() or samples > 1
    assert (share[x > 0.51] == 0).all()
    inside = np.abs(x) < 0.45
    # The part of the lamp that is seen counts by its angle: half and half in the middle, and within a
    # place's worth of the straight line elsewhere.
    errors = (share - (0.5 - x))[inside]
    assert np.abs(errors).max() < (0.09 if samples == 1 else 0.16)
    assert abs(errors.mean()) < 0.02


@pytest.mark.parametrize("count", [1, 4, 16])
def test_the_places_of_all_samples_together_are_spread_evenly(count):
    found = np.array([p for k in range(count) for p in places(64 // count, Sample(k, count))])
    assert len(np.unique(found, axis=0)) == 64
    assert np.abs(found).max() < 1
    cells = np.floor((found + 1) * 4).astype(int)
    assert len(np.unique(cells, axis=0)) == 64  # one in each of 8 × 8
    assert np.abs(found.mean(axis=0)).max() < 1e-12
    assert places(1, CENTRE) == ((0.0, 0.0),)


# --- the same bytes, whoever draws


@pytest.mark.skipif(not can_fork(), reason="processes cannot fork here")
def test_shadows_are_the_same_bytes_for_workers_and_for_a_scene_that_moves():
    lights = (*lamp((1, 3, 2)), *sun(), area((0, 3, 1), (0, -1, 0), (1, 1), 0, (5, 4, 3), rays=4))
    still = ball_scene(2, 0.9, lights)
    lifted = replace(still, vertices=still.vertices * np.array([1.0, 0.7, 1.1]))
    stage = stage_of_facets(cube(20), still, bleed=2)
    alone, together = new_buffers(stage), shared_buffers(stage)
    with Pool(stage, [together], 2) as pool:
        for now in (still, lifted, still):
            there = replace(stage, scene=now)
            draw_frame(there, viewer((2.2, 1.8, 3.2)), alone, threads=2)
            draw_frame(there, viewer((2.2, 1.8, 3.2)), together, crew=pool)
            for name in alone:
                np.testing.assert_array_equal(alone[name], together[name], err_msg=name)
