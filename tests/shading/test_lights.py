"""Lamps against closed forms: cones, ranges and rectangles."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quiltcli.geometry import normalized
from quiltcli.scene.lights import area, point, spot
from quiltcli.shading import shade as shading
from quiltcli.shading.rectangle import received_from
from quiltcli.shading.surface import Surface
from tests.helpers.shadow_scene import fine_panel, seen
from tests.helpers.shadow_scene import scene as disc_scene
from tests.helpers.wall_scene import EYE, STRAIGHT, hits, wall


def shade(scene, eye, seen):
    return np.stack([np.broadcast_to(c, (seen.depth.size, 1)).ravel() for c in _three(scene, eye, seen)])


def _three(scene, eye, seen):
    colors = shading.shade(scene, eye, seen.points)
    return colors * (3 // len(colors))


def matte(*lamps):
    return wall(lamps, color=(1, 1, 1), specular=0.0)


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.35, 0.45, 0.6, 2.0])
def test_a_spot_fades_as_its_formula_says(angle):
    """clamp(cosθ·scale + offset)² between the inner and the outer cone (KHR_lights_punctual)."""
    way = (math.sin(angle), 0, -math.cos(angle))
    light = spot((0, 0, 1), way, (4, 4, 4), (0.3, 0.5))
    share = (math.cos(angle) - math.cos(0.5)) / (math.cos(0.3) - math.cos(0.5))
    expected = 4 / math.pi * min(max(share, 0), 1) ** 2
    assert shade(matte(light), EYE, STRAIGHT)[0, 0] == pytest.approx(expected, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize(("reach", "share"), [(10, 1 - 1e-4), (2, 1 - 1 / 16), (1, 0), (0.5, 0), (None, 1)])
def test_a_lamp_fades_to_nothing_at_its_range(reach, share):
    light = point((0, 0, 1), (4, 4, 4), reach)
    assert shade(matte(light), EYE, STRAIGHT)[0, 0] == pytest.approx(4 / math.pi * share, rel=1e-6)


def irradiance(light, place=(0, 0, 0)):
    """Of a surface that faces +z at a place, from a rectangle."""
    place = np.array(place, float)
    found = hits(place - EYE)
    return received_from(light, Surface(found.points, EYE)).received[0, 0]


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (0.2, 3, 0.5), (0.01, 0.02, 4), (20, 20, 0.01)])
def test_a_rectangle_over_a_corner_has_a_closed_form(a, b, c):
    """The form factor of a rectangle that is parallel to a surface, over one of its corners.

    Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3.
    """
    x, y = a / c, b / c
    first = x / math.sqrt(1 + x * x) * math.atan(y / math.sqrt(1 + x * x))
    second = y / math.sqrt(1 + y * y) * math.atan(x / math.sqrt(1 + y * y))
    light = area((a / 2, b / 2, c), (0, 0, -1), (a, b), 0, (1, 1, 1))
    assert irradiance(light) == pytest.approx((first + second) / 2, rel=2e-7)


def test_a_rectangle_that_stands_on_a_surface_has_a_closed_form():
    """The form factor of a rectangle at right angles to a surface, half below its horizon (Howell, B-4)."""
    a, b, c = 1.0, 0.7, 0.4  # width, height above the surface, distance
    x, y = a / c, b / c
    expected = math.atan(x) - 1 / math.sqrt(1 + y * y) * math.atan(x / math.sqrt(1 + y * y))
    light = area((a / 2, c, 0), (0, -1, 0), (a, 2 * b), 0, (1, 1, 1))
    assert irradiance(light) == pytest.approx(expected / 2, rel=2e-7)


@pytest.mark.parametrize("seed", range(8))
def test_any_rectangle_is_the_sum_of_its_places(seed):
    rng = np.random.default_rng(seed)
    way = normalized(rng.normal(size=3))
    way[2] = -abs(way[2]) * (seed % 2)  # some stand upright, partly below the horizon
    middle = rng.normal(size=3) * (1, 1, 0.3) + (0, 0, 0.3)
    light = area(middle, way, (1.2, 0.7), 0.3, (1, 1, 1))
    along = (np.arange(1500) + 0.5) / 750 - 1
    s, t = np.meshgrid(along, along)
    place = middle + s[..., None] * light.across + t[..., None] * light.along
    shines = np.cross(light.across, light.along)
    size = 4 * np.linalg.norm(shines)
    shines /= np.linalg.norm(shines)
    length = np.linalg.norm(place, axis=2)
    cosine = np.maximum(place[..., 2], 0) / length * np.maximum(-(place @ shines), 0) / length
    expected = (cosine / length**2).mean() * size
    assert irradiance(light) == pytest.approx(expected, rel=2e-3, abs=1e-6)


def test_a_rectangle_shines_to_one_side_and_is_level():
    front, back = (area((0, 0, 1), (0, 0, way), (2, 1), 0, (1, 1, 1)) for way in (-1, 1))
    assert irradiance(front) > 0.5
    assert irradiance(back) == 0
    np.testing.assert_allclose(front.across, (1, 0, 0))
    turned = area((0, 0, 1), (0, 0, -1), (2, 1), math.pi / 2, (1, 1, 1))
    np.testing.assert_allclose(turned.across, (0, -1, 0), atol=1e-15)
    down = area((0, 3, 0), (0, -1, 0), (2, 1), 0, (1, 1, 1))
    np.testing.assert_allclose((down.across[0], down.along[1]), (1, 0))


def test_a_small_rectangle_is_a_point():
    """Of a size that is nothing to the distance; its glint to two per cent."""
    size, color = 0.001, 3000.0
    power = size * size * color
    for eye in (EYE, np.array([1.0, 0.3, 1.5])):
        found = hits(-eye)
        for roughness in (0.3, 0.6, 1.0):
            lamps = (
                area((-1, 0, 1), (1, 0, -1), (size, size), 0, [color] * 3),
                point((-1, 0, 1), [power] * 3),
            )
            one, other = (shade(wall((lamp,), roughness=roughness), eye, found) for lamp in lamps)
            np.testing.assert_allclose(one, other, rtol=0.02)
            one, other = (shade(wall((lamp,), specular=0.0), eye, found) for lamp in lamps)
            np.testing.assert_allclose(one, other, rtol=1e-5)


def test_a_mirror_shows_a_rectangle_no_brighter_than_it_is():
    """In polished metal it has its own radiance, but for what the layer's least roughness spreads."""
    light = area((0, 0, 2), (0, 0, -1), (1, 1), 0, (5, 5, 5))
    polished = wall((light,), metallic=1.0, roughness=0.0)
    middle = shade(polished, EYE, hits([[0.0], [0.0], [-2.0]]))[0, 0]
    beside = shade(polished, EYE, hits([[0.4], [0.0], [-2.0]]))[0, 0]  # its image reaches to 0.25
    assert middle == pytest.approx(5, rel=0.1)
    assert beside < 0.05


@pytest.mark.parametrize("roughness", [0.3, 0.5])
def test_metal_reflects_of_a_rectangle_what_its_places_send(roughness):
    """The mean over a wall of what 900 points on the rectangle give, to within a few per cent."""
    light = area((-0.4, 0.2, 1.2), (0.3, -0.2, -1), (0.8, 0.5), 0, (5, 5, 5))
    along = (np.arange(30) + 0.5) / 15 - 1
    shines = np.cross(light.across, light.along)
    size, shines = 4 * np.linalg.norm(shines), shines / np.linalg.norm(shines)
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9)))
    place = np.stack((x, y, np.zeros_like(x)))
    seen_points = hits(place - EYE[:, None])
    metal = {"metallic": 1.0, "roughness": roughness}
    found = shade(wall((light,), **metal), EYE, seen_points)[0].astype(float)
    expected = np.zeros(x.size)
    for s in along:
        for t in along:
            at = light.position + s * light.across + t * light.along
            way = at[:, None] - place
            cosine = np.maximum(-(shines @ way), 0) / np.linalg.norm(way, axis=0)
            sent = shade(wall((point(at, (1, 1, 1)),), **metal), EYE, seen_points)[0]
            expected += sent * cosine * 5 * size / 900
    assert found.mean() == pytest.approx(expected.mean(), rel=0.05)
    assert np.abs(found - expected).max() < 0.15 * expected.max()


@pytest.mark.parametrize("kind", ["spot", "range"])
def test_the_edges_of_cones_and_ranges_are_not_lost_between_nodes(kind, monkeypatch):
    """Light at nodes is that at pixels to within a step of half floats, over edges too."""
    from quiltcli.shading import adaptive

    cone = (0.3, 0.32) if kind == "spot" else (0.3, 1.5)
    place = (0.3, 0.2, 0)
    light = spot(place, (0, 0, -1), (9, 9, 9), cone, None if kind == "spot" else 2.6)
    drawn = disc_scene((light,), roughness=0.7)
    by_nodes = seen(drawn, fine_panel(1000))
    asked, calm = adaptive.is_smooth, []

    def watched(squares, *given):
        calm.append(asked(squares, *given).mean())
        return np.zeros(squares.triangle.size, bool)

    monkeypatch.setattr(adaptive, "is_smooth", watched)
    by_pixels = seen(drawn, fine_panel(1000))
    assert max(calm) > 0.02
    steps = by_nodes["R"].view(np.int16).astype(int) - by_pixels["R"].view(np.int16)
    bright = by_pixels["R"] > 1e-3
    assert np.abs(steps[bright]).max() <= 1
    assert np.abs(by_nodes["R"][~bright].astype(float) - by_pixels["R"][~bright]).max(initial=0) < 2e-6


def test_lamps_say_that_they_differ_from_place_to_place():
    cone = spot((0, 0, 1), (0, 0, -1), (1, 1, 1), (0, 1))
    square = area((0, 0, 1), (0, 0, -1), (1, 1), 0, (1, 1, 1))
    for light in (cone, square):
        assert shading.asks_for_places(replace(matte(), lights=(light,)))
