"""Shading against closed forms, a slow reference and the bound that no surface returns more than it gets."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quiltcli.geometry import normalized
from quiltcli.scene import Materials
from quiltcli.scene.lights import HEADLIGHT
from quiltcli.shading import shade as shading
from quiltcli.shading.brdf import LEAST_ROUGHNESS
from quiltcli.shading.materials import albedo_at
from quiltcli.shading.surface import shading_normals as unit_normals
from tests.helpers.wall_scene import EYE, STRAIGHT, hits, lights, materials, on, wall


def shade(scene, eye, seen):
    colors = shading.shade(scene, eye, on(scene, seen).points)
    return np.stack([color.ravel() for color in colors * (3 // len(colors))])


def shading_normals(scene, seen):
    return unit_normals(on(scene, seen)).reshape(3, -1)


def reference(normal, eyeward, light, color, metallic, roughness):
    """Light returned for unit irradiance (double precision, from the formulas, with a half vector)."""
    n, v, w = (np.asarray(x, float) / np.linalg.norm(x) for x in (normal, eyeward, light))
    h = (v + w) / np.linalg.norm(v + w)
    nl, nv, nh, vh = max(n @ w, 0.0), n @ v, n @ h, v @ h
    alpha = max(roughness, LEAST_ROUGHNESS) ** 2
    d = alpha**2 / (math.pi * (nh**2 * (alpha**2 - 1) + 1) ** 2)

    def smith_lambda(cosine):
        return (-1 + math.sqrt(1 + alpha**2 * (1 / cosine**2 - 1))) / 2

    if nl == 0:
        return np.zeros(3)
    g = 1 / (1 + smith_lambda(nv) + smith_lambda(nl))
    f0 = 0.04 * (1 - metallic) + metallic * np.asarray(color, float)
    f = f0 + (1 - f0) * (1 - vh) ** 5
    through = 0.96 * (1 - (1 - nl) ** 5) * (1 - (1 - nv) ** 5)
    base = (1 - metallic) * np.asarray(color, float) / math.pi * through
    return (base + d * g * f / (4 * nl * nv)) * nl


def test_straight_light_has_a_closed_form():
    scene = wall(lights([[0, 0, -1]], [[2, 2, 2]]), color=(0.5, 0.25, 1), roughness=1.0)
    base = 0.96 * np.array([0.5, 0.25, 1]) / math.pi
    layer = 0.04 / (4 * math.pi)
    assert shade(scene, EYE, STRAIGHT)[:, 0] == pytest.approx(2 * (base + layer), rel=1e-6)


def test_rough_base_follows_lamberts_cosine():
    # No layer at all: what is left at 60° is the cosine times the Fresnel share let in.
    tilted = normalized(np.array([0, -math.sqrt(3), -1.0]))
    scene = wall(lights([tilted], [[1, 1, 1]]), color=(1, 1, 1), roughness=1.0)
    through = 0.96 * (1 - 0.5**5)
    layer = reference([0, 0, 1], [0, 0, 1], -tilted, (0, 0, 0), 0, 1.0)
    expected = 0.5 * through / math.pi + layer
    assert shade(scene, EYE, STRAIGHT)[:, 0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("metallic", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
def test_matches_the_slow_reference(metallic, roughness):
    rng = np.random.default_rng(7)
    color = (0.9, 0.4, 0.1)
    for _ in range(40):
        sun = rng.normal(size=3)
        place = np.array([*rng.uniform(-3, 3, 2), -rng.uniform(0.2, 3)])
        scene = wall(
            lights([normalized(sun)], [[3, 2, 1]]), color=color, metallic=metallic, roughness=roughness
        )
        expected = reference([0, 0, 1], -place, -sun, color, metallic, roughness) * [3, 2, 1]
        assert shade(scene, EYE, hits(place))[:, 0] == pytest.approx(expected, rel=6e-3, abs=1e-5)


def test_point_light_falls_with_the_square_of_the_distance():
    near = wall(lights(point=[[0, 0, 1]], power=[[4, 4, 4]]), roughness=1.0)
    far = wall(lights(point=[[0, 0, 2]], power=[[4, 4, 4]]), roughness=1.0)
    sun = wall(lights([[0, 0, -1]], [[4, 4, 4]]), roughness=1.0)
    expected = shade(sun, EYE, STRAIGHT)
    np.testing.assert_allclose(shade(near, EYE, STRAIGHT), expected, rtol=1e-6)
    np.testing.assert_allclose(shade(far, EYE, STRAIGHT) * 4, expected, rtol=1e-6)


def test_headlight_is_a_sun_from_the_eye():
    from_eye = normalized(np.array([0.3, 0.2, -1.0]))
    sun = wall(lights([from_eye], [[HEADLIGHT] * 3], ambient=(0.1, 0.1, 0.1)))
    own = wall(lights(ambient=(0.1, 0.1, 0.1), headlight=True))
    seen = hits(from_eye * 2)
    np.testing.assert_allclose(shade(own, EYE, seen), shade(sun, EYE, seen), rtol=1e-5)


def test_ambient_and_emission_need_no_lamp():
    scene = wall(lights(ambient=(0.1, 0.2, 0.3)), color=(0.5, 0.5, 0.5), emission=(1, 0, 2))
    assert shade(scene, EYE, STRAIGHT)[:, 0] == pytest.approx([1.05, 0.1, 2.15])


def test_unlit_is_exactly_its_color():
    color = np.float32([0.1, 0.7, 3.3])
    scene = wall(
        lights([[0, 0, -1]], [[9, 9, 9]], ambient=(1, 1, 1), headlight=True),
        color=color, unlit=True, emission=(5, 5, 5),
    )  # fmt: skip
    np.testing.assert_array_equal(shade(scene, EYE, STRAIGHT)[:, 0], color)


def test_matte_surfaces_follow_lambert_alone():
    """No layer: colour over π times the cosine, whatever the roughness and from wherever one looks."""
    sun = normalized(np.array([0.3, -0.5, -1.0]))
    places = np.random.default_rng(4).normal(size=(3, 50))
    places[2] = -np.abs(places[2]) - 0.1
    for roughness in (0.1, 1.0):
        scene = wall(lights([sun], [[3, 2, 1]]), color=(0.5, 0.25, 1), roughness=roughness, specular=0.0)
        expected = np.array([1.5, 0.5, 1]) / math.pi * -sun[2]
        got = shade(scene, EYE, hits(places))
        np.testing.assert_allclose(got, np.repeat(expected[:, None], got.shape[1], axis=1), rtol=1e-6)
    lamp = wall(lights(point=[[0, 1, 1]], power=[[4, 4, 4]]), color=(1, 1, 1), specular=0.0)
    expected = 4 / 2 * math.sqrt(0.5) / math.pi
    assert shade(lamp, EYE, STRAIGHT)[:, 0] == pytest.approx([expected] * 3, rel=1e-6)


def test_metal_reflects_though_it_is_called_matte():
    sun = lights([[0.2, 0, -1]], [[3, 3, 3]])
    glossy, matte = (shade(wall(sun, metallic=1.0, specular=s), EYE, STRAIGHT) for s in (1.0, 0.0))
    np.testing.assert_array_equal(glossy, matte)


def tables_of(some, others):
    """Materials of two tables."""
    pairs = zip(vars(some).values(), vars(others).values(), strict=True)
    return Materials(*(None if a is None else np.concatenate((a, b)) for a, b in pairs))


def test_matte_and_glossy_points_do_not_change_each_other():
    scene = wall(lights([[0.1, -0.4, -1]], [[3, 3, 3]]))
    two = tables_of(materials(specular=0.0), materials())
    scene = replace(
        scene, triangles=np.repeat(scene.triangles, 2, 0), flat=np.zeros(2, bool),
        material=np.array([0, 1], np.int32), materials=two,
    )  # fmt: skip
    position = np.tile([[0.1], [0.2], [-2]], 2)
    both = shade(scene, EYE, hits(position, triangle=[0, 1], scene=scene))
    for k in (0, 1):
        alone = shade(scene, EYE, hits(position[:, k : k + 1], triangle=[k], scene=scene))
        np.testing.assert_array_equal(np.broadcast_to(alone, (3, 1))[:, 0], both[:, k])


def test_vertex_colors_multiply_the_base():
    scene = wall(lights(ambient=(1, 1, 1)), color=(0.5, 0.5, 0.5))
    tinted = replace(scene, colors=np.float32([[1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    assert shade(tinted, EYE, STRAIGHT)[:, 0] == pytest.approx([0.125, 0.125, 0.25])


def test_both_sides_are_lit_alike():
    front = wall(lights([[0.3, 0, -1]], [[1, 1, 1]]))
    back = replace(front, triangles=np.array([[0, 2, 1]], np.int32), normals=-front.normals)
    np.testing.assert_array_equal(shade(front, EYE, STRAIGHT), shade(back, EYE, STRAIGHT))
    np.testing.assert_array_equal([[0], [0], [1]], shading_normals(back, STRAIGHT))


def test_light_from_behind_adds_nothing():
    scene = wall(lights([[0, 0, 1]], [[5, 5, 5]], ambient=(0.25, 0.25, 0.25)))
    np.testing.assert_array_equal(np.full((3, 1), 0.25, np.float32), shade(scene, EYE, STRAIGHT))


def test_normals_are_interpolated_unless_flat():
    scene = wall(lights())
    bent = replace(scene, normals=np.float32([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    assert shading_normals(bent, STRAIGHT)[:, 0] == pytest.approx(np.array([1, 2, 1]) / math.sqrt(6))
    flat = replace(bent, flat=np.ones(1, bool))
    np.testing.assert_array_equal([[0], [0], [1]], shading_normals(flat, STRAIGHT))


def hemisphere(count=20_000):
    """Directions spread evenly over the half sphere about +z (a spiral)."""
    k = np.arange(count) + 0.5
    z, turn = 1 - k / count, math.pi * (1 + math.sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.stack((r * np.cos(turn), r * np.sin(turn), z), axis=1)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("slope", [0.0, 1.0, 4.0, 20.0])
def test_white_furnace_returns_no_more_than_it_gets(metallic, roughness, slope):
    """Seen in turn from every direction under one lamp: by reciprocity the share one direction returns."""
    lamp = normalized(np.array([slope, 0, 1.0]))
    scene = wall(lights([-lamp], [[1, 1, 1]]), metallic=metallic, roughness=roughness)
    eyes = hemisphere()
    got = shade(scene, EYE, hits(-eyes.T))[0].astype(np.float64) / lamp[2]
    share = float((got * eyes[:, 2]).mean() * 2 * math.pi)
    assert 0.25 < share < 1.005


def test_bytes_do_not_depend_on_what_is_shaded_together():
    rng = np.random.default_rng(3)
    scene = wall(lights([[0.1, -1, -0.3]], [[3, 3, 3]], [[1, 1, 1]], [[2, 2, 2]], headlight=True))
    two = tables_of(scene.materials, materials(color=(1, 0, 0), metallic=1.0))
    scene = replace(
        scene, triangles=np.repeat(scene.triangles, 2, 0), flat=np.zeros(2, bool),
        material=np.array([0, 1], np.int32), materials=two,
    )  # fmt: skip
    position, weights = rng.normal(size=(3, 500)), rng.random((2, 500)) / 2
    triangle = np.arange(500) > 250
    whole = shade(scene, EYE, hits(position, *weights, triangle, scene))
    for at in range(0, 500, 7):
        part = slice(at, at + 7)
        seen = hits(position[:, part], *weights[:, part], triangle[part], scene)
        np.testing.assert_array_equal(shade(scene, EYE, seen), whole[:, part])


def test_no_hits_is_no_light():
    assert shade(wall(lights()), EYE, hits(np.zeros((3, 0)))).shape == (3, 0)


def test_light_from_behind_does_not_glint_where_a_normal_bends_past_the_silhouette():
    behind = normalized(np.array([-0.05, 0, 1]))
    scene = wall(lights(sun=[behind], color=[(3, 3, 3)]), color=(1, 0.8, 0.4), metallic=1.0, roughness=0.3)
    bent = normalized(np.array([0.3, 0.95, -0.05]))  # the triangle faces the eye, its normal just does not
    scene = replace(scene, normals=np.tile(np.float32(bent), (3, 1)))
    assert shade(scene, EYE, hits([[0.0], [0], [-2]])).max() < 0.5


LAMPS = lights(
    [[0.1, -1, -0.3]], [[3, 2, 1]], [[1, 1, 1]], [[2, 2, 5]], ambient=(0.1, 0.2, 0.3), headlight=True
)


def parts(scene, seen):
    """Diffuse and specular light and emission (3, P), and the base colour."""
    points = on(scene, seen).points
    light = shading.shade_apart(scene, EYE, points)
    whole = (light.diffuse, light.specular, light.emission, albedo_at(scene, points))
    return [
        np.stack([np.broadcast_to(c, points.triangle.shape).ravel() for c in colors * (3 // len(colors))])
        for colors in whole
    ]


@pytest.mark.parametrize("material", [{}, {"metallic": 0.7}, {"specular": 0.0}, {"unlit": True}])
@pytest.mark.parametrize("tinted", [False, True])
def test_the_parts_of_light_make_up_the_whole(material, tinted):
    scene = wall(LAMPS, color=(0.9, 0.4, 0.1), emission=(0.1, 0, 0.2), roughness=0.4, **material)
    if tinted:
        scene = replace(scene, colors=np.float32([[1, 0, 0], [0, 1, 0], [0.2, 0.3, 1]]))
    rng = np.random.default_rng(1)
    seen = hits(rng.normal(size=(3, 200)), *(rng.random((2, 200)) / 2), scene=scene)
    diffuse, specular, emission, albedo = parts(scene, seen)
    np.testing.assert_allclose(albedo * diffuse + specular + emission, shade(scene, EYE, seen), rtol=1e-6)


def test_diffuse_light_knows_nothing_of_a_matte_surfaces_colour():
    seen = hits(np.random.default_rng(2).normal(size=(3, 50)))
    one, other = (wall(LAMPS, color=color, specular=0.0) for color in ((1, 1, 1), (0.1, 0.5, 0.2)))
    (white, *_), (green, _, _, albedo) = parts(one, seen), parts(other, seen)
    np.testing.assert_array_equal(green, white)
    np.testing.assert_array_equal(albedo, np.float32([[0.1], [0.5], [0.2]]) * np.ones((3, 50), np.float32))


def test_each_lamp_adds_to_the_part_it_belongs_to():
    """Ambient light is diffuse, what glows is emission, and only a layer glints."""
    around = wall(lights(ambient=(0.1, 0.2, 0.3)), color=(0.5, 0.5, 0.5), emission=(1, 0, 2))
    diffuse, specular, emission, _ = parts(around, STRAIGHT)
    np.testing.assert_array_equal(diffuse[:, 0], np.float32([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(emission[:, 0], [1, 0, 2])
    assert not specular.any()
    sun = lights([[0, 0, -1]], [[2, 2, 2]])
    diffuse, specular, emission, _ = parts(wall(sun, color=(0.5, 0.25, 1), roughness=1.0), STRAIGHT)
    assert diffuse[:, 0] == pytest.approx([2 * 0.96 / math.pi] * 3, rel=1e-6)
    assert specular[:, 0] == pytest.approx([2 * 0.04 / (4 * math.pi)] * 3, rel=1e-6)
    assert not emission.any()
