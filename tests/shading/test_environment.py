"""Light from all around: the furnace, mirrors, the sky above, and what keeps light away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.geometry import normalized
from quiltcli.scene.environment.maps import ROUGHNESS, maps_of, texel_directions
from quiltcli.scene.environment.panorama import cell_directions, cell_sizes, reduced
from quiltcli.scene.lights import Ambient, Environment
from quiltcli.shading import shade as shading
from quiltcli.shading.environment import albedo_table, looked_up
from quiltcli.visibility.rays.embree import has_embree
from tests.helpers.shadow_scene import CENTRE as DISC_CENTRE
from tests.helpers.shadow_scene import DISC, RADIUS, WALL, mesh, scene, seen, two_panels
from tests.helpers.wall_scene import hits, wall

needs_embree = pytest.mark.skipif(not has_embree(), reason="embreex is not installed")
HALF_STEP = 2.0**-11


def environment(picture, rotate_deg=0.0, **more):
    light = Environment(np.ones(3, np.float32), maps_of(np.float32(picture), rotate_deg))
    return replace(light, **more)


@pytest.fixture(scope="module")
def white():
    return environment(np.ones((32, 64, 3)))


@pytest.fixture(scope="module")
def sky():
    """Blue above, red below, and in the middle of the picture, towards −Z, something green."""
    picture = np.zeros((64, 128, 3))
    picture[:32, :, 2], picture[32:, :, 0] = 1, 1
    picture[28:36, 60:68] = (0, 20, 0)
    return environment(picture)


def shade(drawn, eye, found):
    colors = shading.shade(drawn, eye, found.points)
    return np.stack([np.broadcast_to(c, found.depth.shape).ravel() for c in colors * (3 // len(colors))])


@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.0, 0.05, 0.2, 0.33, 0.5, 0.77, 1.0])
def test_a_white_body_in_white_light_is_white(white, metallic, roughness):
    """From straight above to grazing; to within half a step of the half floats it is written as."""
    rng = np.random.default_rng(3)
    eyes = rng.normal(size=(200, 3)) * (1, 1, 0.5)
    eyes[:, 2] = np.abs(eyes[:, 2]) + 1e-3
    drawn = wall((white,), metallic=metallic, roughness=roughness)
    for eye in eyes[:60]:
        found = shade(drawn, eye, hits(-eye))
        assert np.abs(found - 1).max() < HALF_STEP / 2
    parts = shading.shade_apart(drawn, eyes[0], hits(-eyes[0]).points)
    assert (parts.diffuse[0] + parts.specular[0])[0, 0] == pytest.approx(1, abs=1e-6)


def test_a_matte_body_is_as_bright_as_its_colour(white):
    drawn = wall((white,), color=(0.5, 0.25, 0.1), specular=0.0)
    found = shade(drawn, np.array([0.0, 0, 2]), hits([[0.0], [0.0], [-2.0]]))
    assert found[:, 0] == pytest.approx([0.5, 0.25, 0.1], rel=1e-6)


def test_what_layers_reflect_is_part_of_what_arrives():
    first, second = albedo_table()
    assert (first >= 0).all()
    assert (second >= 0).all()
    assert (first + second <= 1).all()
    assert (first + second)[31] == pytest.approx(1, abs=0.02)  # a polished mirror, seen from straight above


def test_half_a_sky_has_a_closed_form(sky):
    """A surface that is turned by an angle from straight up receives of the sky (1 + cosine) / 2."""
    for cosine in (1.0, 0.5, 0.0, -0.7):
        way = np.float32([np.sqrt(1 - cosine * cosine), cosine, 0])[:, None, None]
        found = looked_up(sky.maps.diffuse, way)
        assert found[2, 0, 0] == pytest.approx((1 + cosine) / 2, abs=0.01)


def test_mirrors_show_what_is_where_they_point(sky):
    ahead, up, down, behind = (
        looked_up(sky.maps.mirrors[0], np.float32(way)[:, None, None])[:, 0, 0]
        for way in ((0, 0, -1), (0, 1, 0), (0.1, -1, 0), (0, 0.2, 1))
    )
    assert ahead == pytest.approx([0, 20, 0])
    assert up == pytest.approx([0, 0, 1])
    assert down == pytest.approx([1, 0, 0])
    assert behind == pytest.approx([0, 0, 1])


def test_a_panorama_turns_to_the_left(sky):
    turned = environment(_green(), 90.0)
    found = looked_up(turned.maps.mirrors[0], np.float32([-1, 0, 0])[:, None, None])[:, 0, 0]
    assert found == pytest.approx([0, 20, 0])


def _green():
    picture = np.zeros((64, 128, 3))
    picture[28:36, 60:68] = (0, 20, 0)
    return picture


def test_maps_have_no_seams(sky):
    """Across the folds of the square light goes on as it does elsewhere."""
    rng = np.random.default_rng(4)
    way = normalized(rng.normal(size=(4000, 3)))
    way[:2000, 0] *= 1e-3  # near the plane x = 0, and below it the edges of the square
    step = normalized(way + rng.normal(size=way.shape) * 1e-4)
    for texels in (sky.maps.diffuse, *sky.maps.mirrors[2:]):
        one, other = (looked_up(texels, np.float32(w).T[:, :, None]) for w in (way, step))
        assert np.abs(one - other).max() < 0.02 * texels.max()


def test_a_map_of_directions_is_looked_up_where_they_are():
    """A map of its own texels' directions gives any direction back."""
    texels = texel_directions(65).astype(np.float32)
    way = normalized(np.random.default_rng(5).normal(size=(500, 3)))
    found = looked_up(texels, np.float32(way).T[:, :, None])[:, :, 0].T
    assert np.linalg.norm(normalized(found.astype(float)) - way, axis=1).max() < 0.01


@pytest.mark.parametrize("roughness", [0.2, 0.6, 1.0])
def test_rough_mirrors_show_the_mean_about_their_direction(roughness):
    """Against GGX's half vectors in random places, a hundred thousand of them."""
    picture = np.zeros((64, 128, 3)) + 0.1
    picture[10:20, 50:80] = (3, 2, 1)
    light = environment(picture)
    rng = np.random.default_rng(6)
    normal = normalized(np.array([0.2, 0.8, -0.5]))
    u, turn = rng.random(100_000), rng.random(100_000) * 2 * np.pi
    cosine = np.sqrt((1 - u) / (1 + (roughness**4 - 1) * u))
    sine = np.sqrt(1 - cosine**2)
    aside = normalized(np.cross(normal, [1, 0, 0]))
    other = np.cross(normal, aside)
    half = (
        cosine[:, None] * normal
        + (sine * np.cos(turn))[:, None] * aside
        + (sine * np.sin(turn))[:, None] * other
    )
    way = 2 * cosine[:, None] * half - normal
    weight = np.maximum(way @ normal, 0)
    row = (np.arccos(np.clip(way[:, 1], -1, 1)) / np.pi * 64).astype(int).clip(0, 63)
    column = ((np.arctan2(way[:, 0], -way[:, 2]) / (2 * np.pi) + 0.5) * 128).astype(int).clip(0, 127)
    expected = (picture[row, column] * weight[:, None]).sum(axis=0) / weight.sum()
    level = ROUGHNESS.index(roughness)
    found = looked_up(light.maps.mirrors[level], np.float32(normal)[:, None, None])[:, 0, 0]
    assert found == pytest.approx(expected, rel=0.05)


def test_cells_keep_the_light_of_a_panorama():
    picture = np.random.default_rng(7).random((50, 100, 3)).astype(np.float32)
    cells = reduced(picture, 32)
    total = (cells * cell_sizes(32)[:, None, None]).sum(axis=(0, 1))
    expected = (picture * cell_sizes(100)[:, None, None]).sum(axis=(0, 1))
    np.testing.assert_allclose(total, expected, rtol=1e-9)
    assert cell_sizes(32).sum() * 32 == pytest.approx(4 * np.pi)
    assert cell_directions(32)[8, 16] == pytest.approx([0, 0, -1], abs=0.2)


# --- what keeps light away


@needs_embree
def test_a_disc_keeps_light_from_the_wall_as_its_form_factor_says():
    """Of ambient light, the share that a disc hides from a place straight behind its middle: R²/(R² + d²)."""
    around = Ambient(np.ones(3, np.float32), shadows=True, rays=4096)
    found = seen(scene((around,), specular=0.0), two_panels(24))
    some = found["object"] == 1
    place = np.stack((found["P.X"], found["P.Y"]), axis=1)[some]
    # A place (h aside) sees of the disc: ½ (1 − (h² + d² − R²) / √((h² + d² + R²)² − 4 R² h²)).
    h2, d2, r2 = ((place - DISC_CENTRE) ** 2).sum(axis=1), (DISC - WALL) ** 2, RADIUS**2
    hidden = (1 - (h2 + d2 - r2) / np.sqrt((h2 + d2 + r2) ** 2 - 4 * r2 * h2)) / 2
    assert hidden.max() > 0.07
    assert np.abs((1 - found["R"][some]) - hidden).max() < 0.01


@needs_embree
def test_only_what_is_near_counts_within_a_distance():
    gap = DISC - WALL
    for distance, dark in ((gap * 0.99, False), (gap * 2, True)):
        around = Ambient(np.ones(3, np.float32), shadows=True, rays=256, distance=distance)
        found = seen(scene((around,), specular=0.0), two_panels(24))
        assert (found["R"][found["object"] == 1] < 0.99).any() == dark


@needs_embree
def test_a_roof_hides_the_sky_and_not_the_ground(sky):
    """Below a roof as wide as the world a floor is dark, and what hangs under it sees the ground alone."""
    corners = [(-50, 0, -50), (50, 0, -50), (50, 0, 50), (-50, 0, 50)]
    roof = [(x, 1.0, z) for x, _, z in corners]
    triangles = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    drawn = mesh(corners + roof, triangles, [0, 0, 1, 1], (replace(sky, shadows=True),), specular=0.0)
    found = seen(drawn, two_panels(24), eye=np.array([0.1, 0.5, 3.0]))
    floor = (found["object"] == 1) & (np.abs(found["P.X"]) < 2) & (np.abs(found["P.Z"]) < 5)
    assert floor.sum() > 100
    assert found["B"][floor].max() < 0.1
