"""Microtiles shaded at nine nodes against the same shaded pixel by pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.geometry import normalized
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.shading import adaptive
from quiltcli.shading.adaptive import NodeLight, Shaded, is_smooth
from quiltcli.shading.aovs import SOURCES, half_floats
from quiltcli.shading.lights import LEAST_DISTANCE
from quiltcli.shading.nodes import Nodes
from quiltcli.shading.shade import shade
from quiltcli.visibility.resolve.reader import TileRays
from quiltcli.visibility.resolve.tiles import Tiles
from quiltcli.visibility.resolve.vectors import BlockVectors, TileVectors
from quiltcli.visibility.resolve.visibility import SQUARE
from quiltcli.visibility.resolve.whole import WholeTiles
from quiltcli.visibility.setup.grids import on_grid
from tests.benchmarks.meshes import room
from tests.benchmarks.stages import cube, stage_for, viewer_of
from tests.helpers.in_memory import CUBE, CUBE_FACES, display
from tests.helpers.wall_scene import lights, wall

COUNT = 500
EYE = np.array([0.1, -0.2, 0.3])
STEP = 2.0**-11
"""From one half float to the next, over their size, at most; at least it is half of that."""


def planes(centre, reach, rng):
    """Planes (3, 3, n) of vectors that differ by up to `reach` (n, 1) from those (n, 3) in the middle."""
    a, b = (normalized(rng.normal(size=centre.shape)) * reach / 7 for _ in range(2))
    return np.stack((a.T, b.T, (centre - 3.5 * (a + b)).T), axis=1)


def tiles(rng, lamp, *, bent, near_glint, placed=False, colored=False, side=1):
    """Squares that see anything from anywhere, some of them surfaces near the lamp's image."""
    rays = planes(normalized(rng.normal(size=(COUNT, 3))), 10 ** rng.uniform(-4, -0.5, (COUNT, 1)), rng)
    towards = -(rays[:, 2] + 3.5 * (rays[:, 0] + rays[:, 1])).T
    spread = 10 ** rng.uniform(-4, 0, (COUNT, 1))
    middle = normalized(towards + lamp) if near_glint else towards
    normal = normalized(middle + rng.normal(size=(COUNT, 3)) * spread)
    normal *= np.sign((normal * towards).sum(axis=1))[:, None]
    turn = 10 ** rng.uniform(-4, -0.5, (COUNT, 1)) * bent
    normals = planes(normal, turn, rng)
    inverse = np.stack([rng.normal(size=COUNT) * 10 ** rng.uniform(-5, -2, COUNT) for _ in range(3)])
    inverse[2] += 1
    weights = np.stack((inverse * 0.2, inverse * 0.3, inverse)) if colored else np.zeros((0, 3, COUNT))
    if colored:
        weights[:2, :2] += rng.normal(size=(2, 2, COUNT)) * 0.01
    for form in (rays, normals, inverse, weights):  # the same over a larger square
        form[..., :2, :] /= side
    square = np.arange(COUNT)
    vectors = BlockVectors(rays, square, np.zeros(COUNT), np.zeros(COUNT), side)
    none = np.zeros(COUNT, np.int64)
    return WholeTiles(
        reader=None,
        tiles=Tiles(*[none] * 9),
        pair=none,
        triangle=np.zeros(COUNT, np.int32),
        rays=TileRays(
            vectors,
            on_grid(vectors.along(np.array([0, 0, 1.0])), side),
            on_grid(vectors.planes, side) if placed else np.zeros((0, 3, COUNT)),
            placed=placed,
        ),
        inverse=on_grid(inverse, side),
        normal=TileVectors(normals, side),
        weights=on_grid(weights, side),
        side=side,
    )


def relative_errors(scene, some):
    """How far squares (n, k) shaded at nodes are from pixel by pixel, over the value, of all colours."""
    exact = shade(scene, EYE, some.read().points)
    found = NodeLight(scene, EYE, some).total.pixels()
    pairs = zip(found, exact, strict=True)
    return np.stack([np.abs(f.astype(float) - e) / np.maximum(e, 1e-4) for f, e in pairs])


def calm_ones(scene, some):
    """The calm squares, and how many these are."""
    calm = np.flatnonzero(is_smooth(some, scene, EYE))
    return some[calm], calm.size


@pytest.mark.parametrize("lamp_is", ["sun", "eye", "point"])
@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize(("metallic", "side"), [(0.0, 1), (1.0, 1), (0.5, SQUARE)])
def test_calm_squares_are_nearer_than_half_floats_tell(lamp_is, roughness, metallic, side):
    rng = np.random.default_rng(5)
    checked = 0
    for bent in (False, True):
        for near_glint in (False, True):
            lamp = normalized(rng.normal(size=3))
            lamps = {
                "sun": lights([-lamp], [[3, 2, 1]], ambient=(0.1, 0.1, 0.1)),
                "eye": lights(headlight=True),
                "point": lights(point=rng.normal(size=(2, 3)), power=[[3, 2, 1], [1, 1, 1]]),
            }
            scene = wall(lamps[lamp_is], color=(0.9, 0.5, 0.2), metallic=metallic, roughness=roughness)
            placed = lamp_is == "point"
            some = tiles(rng, lamp, bent=bent, near_glint=near_glint, placed=placed, side=side)
            calm, count = calm_ones(scene, some)
            checked += count
            assert relative_errors(scene, calm).max(initial=0) < STEP / 4
    assert checked > COUNT / 5


@pytest.mark.parametrize(
    "colors", [[[1, 0.2, 0.1], [0.1, 1, 0.4], [0.3, 0.3, 1]], [[0, 0, 0], [0.01, 1, 0], [1, 0, 0.2]]]
)
def test_vertex_colours_are_calm_too(colors):
    rng = np.random.default_rng(6)
    lamp = np.array([0.0, 0.6, 0.8])
    scene = replace(wall(lights([-lamp], [[1, 1, 1]])), colors=np.float32(colors))
    some = tiles(rng, lamp, bent=False, near_glint=False, colored=True)
    calm, count = calm_ones(scene, some)
    assert count > COUNT / 5
    assert relative_errors(scene, calm).max() < STEP / 4


def test_the_parts_of_light_are_as_near_and_colour_between_corners_is_exact():
    """Whatever the colours of the corners: they are not interpolated, light is."""
    rng = np.random.default_rng(12)
    lamp = normalized(rng.normal(size=3))
    scene = wall(lights([-lamp], [[3, 2, 1]], ambient=(0.1, 0.1, 0.1)), emission=(0, 1, 0))
    some = tiles(rng, lamp, bent=True, near_glint=True, colored=True)
    some = some[np.flatnonzero(is_smooth(some, scene, EYE))]
    assert some.triangle.size > COUNT / 20
    scene = replace(scene, colors=np.float32([[1, 0, 0.1], [0, 1, 0], [0.3, 0.3, 1]]))
    by_nodes, by_pixels = (
        Shaded(scene, EYE, some.read(), nodes) for nodes in (NodeLight(scene, EYE, some), None)
    )
    for name in ("diffuse", "specular", "emission"):
        found, exact = getattr(by_nodes.apart, name).pixels(), getattr(by_pixels.apart, name)
        for f, e in zip(found, exact, strict=True):
            assert (np.abs(f.astype(float) - e) / np.maximum(e, 1e-3)).max() < STEP / 2
    for f, e in zip(by_nodes.albedo, by_pixels.albedo, strict=True):
        np.testing.assert_array_equal(f, e)


def test_a_glint_between_the_nodes_is_not_calm():
    # Mirrors whose normals turn by 0.3 across the microtile: the lamp's image is smaller than a pixel.
    rng = np.random.default_rng(7)
    lamp = np.array([0.0, 0.0, 1.0])
    scene = wall(lights([-lamp], [[1, 1, 1]]), metallic=1.0, roughness=0.0)
    some = tiles(rng, lamp, bent=True, near_glint=True)
    wide = np.sqrt((some.normal.planes[:, :2] ** 2).sum(axis=(0, 1))) > 0.02
    assert wide.sum() > 10
    assert not is_smooth(some, scene, EYE)[wide].any()


@pytest.mark.parametrize("side", [1, 2, SQUARE])
def test_a_polynomial_of_second_degree_is_its_own(side):
    nodes = Nodes(side)
    place = np.arange(8 * side) / (8 * side)
    x, y = np.tile(place, place.size), np.repeat(place, place.size)
    rng = np.random.default_rng(8)
    c = rng.normal(size=(COUNT, 3, 3))

    def at(x, y):
        return np.einsum("gij,ip,jp->gp", c, x ** np.arange(3)[:, None], y ** np.arange(3)[:, None])

    columns, rows = (nodes.at(np.array(plane)[:, None])[:, 0] for plane in ([1.0, 0, 0], [0.0, 1, 0]))
    values = at(columns / (8 * side), rows / (8 * side)).astype(np.float32).T
    largest = np.abs(values).max(axis=0)[:, None]
    got = nodes.between(nodes.on_grids(values.astype(float)))
    assert (np.abs(got - at(x, y)) <= 8 * 2.0**-23 * largest).all()


@pytest.mark.parametrize("color", [(1e-6, 0.3, 7.0), (60000.0, 65504.0, 1e6), (1.0, 3e38, np.inf)])
def test_colours_between_nodes_are_rounded_like_others(color):
    lamp = np.array([0.0, 0.6, 0.8])
    scene = wall(lights([-lamp], [[1, 1, 1]], ambient=color), color=(1, 1, 1))
    some = tiles(np.random.default_rng(10), lamp, bent=True, near_glint=False)
    some = some[is_smooth(some, scene, EYE)]
    colors = NodeLight(scene, EYE, some).total
    seen = Shaded(scene, EYE, some.read(), NodeLight(scene, EYE, some))
    halves = SOURCES["rgba"].values(None, seen)[:3]
    exact = shade(scene, EYE, some.read().points)
    for found, values, each in zip(halves, colors.pixels(), exact, strict=True):
        np.testing.assert_array_equal(found, half_floats(values))
        steps = found.view(np.int16).astype(int) - half_floats(each).view(np.int16)
        assert np.abs(steps).max() <= 1


def test_nothing_is_calm_about_where_the_light_of_a_lamp_stops_growing():
    # The lamp is half a millimetre from the middle of each, or five; all is a millimetre from the eye.
    rng = np.random.default_rng(11)
    some = tiles(rng, np.array([0.0, 0.0, 1.0]), bent=False, near_glint=False, placed=True)
    some = replace(some, inverse=some.inverse * 1024)
    point = Nodes(1).middle(some.rays.axes) / Nodes(1).middle(some.inverse)
    normal = some.normal.planes[:, 2]
    calm = {}
    for far in (5.0, 0.5):
        calm[far] = [
            bool(is_smooth(some[k : k + 1], wall(lights(point=[place], power=[[1, 1, 1]])), EYE)[0])
            for k, place in enumerate((EYE[:, None] + point + far * LEAST_DISTANCE * normal).T[:100])
        ]
    assert sum(calm[5.0]) > 5
    assert not any(calm[0.5])


def test_no_microtile_depends_on_its_company():
    rng = np.random.default_rng(9)
    lamp = np.array([0.0, 0.6, 0.8])
    scene = wall(lights([-lamp], [[3, 2, 1]]), color=(0.9, 0.5, 0.2))
    some = tiles(rng, lamp, bent=True, near_glint=False)
    calm, colors = is_smooth(some, scene, EYE), NodeLight(scene, EYE, some).total
    pixels = colors.pixels()
    for part in (slice(3, 4), slice(17, 60), np.array([5, 400, 7])):
        np.testing.assert_array_equal(is_smooth(some[part], scene, EYE), calm[part])
        alone = NodeLight(scene, EYE, some[part]).total
        np.testing.assert_array_equal(alone.values, colors.values[:, :, part])
        for mine, all_of_them in zip(alone.pixels(), pixels, strict=True):
            np.testing.assert_array_equal(mine, all_of_them[part])


def test_a_frame_is_the_same_to_within_one_step_of_its_half_floats(monkeypatch):
    place = cube()
    stage = stage_for(replace(place, facets=display(CUBE, CUBE_FACES[:5], 300)), room(2))
    viewer = viewer_of(place)
    by_nodes, by_pixels = new_buffers(stage), new_buffers(stage)
    calm = {1: 0, SQUARE: 0}
    asked = adaptive.is_smooth

    def watched(squares, *given):
        found = asked(squares, *given)
        calm[squares.side] += np.count_nonzero(found)
        return found

    monkeypatch.setattr(adaptive, "is_smooth", watched)
    draw_frame(stage, viewer, by_nodes)
    monkeypatch.setattr(adaptive, "is_smooth", lambda some, *_: np.zeros(some.triangle.size, bool))
    draw_frame(stage, viewer, by_pixels)
    assert min(calm.values()) > 200
    for name, pixels in by_pixels.items():
        if name in "RGB":
            steps = by_nodes[name].view(np.int16).astype(int) - pixels.view(np.int16)
            assert np.abs(steps).max() <= 1
            assert np.count_nonzero(steps) < 0.01 * np.count_nonzero(pixels)
        else:
            np.testing.assert_array_equal(by_nodes[name], pixels)
