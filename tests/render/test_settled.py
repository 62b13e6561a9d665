"""Settled microtiles: what is looked at once is what all samples would have seen."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from quiltcli.render import antialiasing
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.visibility import draw as drawing
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import cube, panel, viewer
from tests.helpers.wall_scene import lights
from tests.render.test_transparency import scene_of, soup

LAMPS = lights(
    sun=[(-0.5, -1, -0.6)], color=[(3, 2, 1)], point=[(0.5, 1, 1)], power=[(2, 2, 3)], ambient=(0.1, 0.1, 0.2)
)


def tiled_floor(count=6):
    """A floor of large tiles, each two triangles, that reaches beyond the display."""
    edge = np.linspace(-2.5, 2.5, count + 1)
    x, z = np.meshgrid(edge, edge)
    vertices = np.stack((x, np.full_like(x, -0.4), z), axis=-1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    halves = [(0, count + 1, 1), (1, count + 1, count + 2)]
    triangles = np.concatenate([first[:, None] + half for half in halves])
    rows = [((0.8, 0.5, 0.3), "opaque", 1.0)]
    scene = scene_of(vertices, triangles, rows, np.zeros(len(triangles)))
    normals = np.tile(np.float32([0, 1, 0]), (len(vertices), 1))
    lit = replace(scene.materials, unlit=np.zeros(1, bool))
    return replace(scene, materials=lit, lights=LAMPS, normals=normals)


def shiny_ball():
    scene = ball_scene(1, 0.8, LAMPS)
    count = len(scene.triangles)
    return replace(
        scene, object=np.arange(count, dtype=np.int32), objects=tuple(f"t{k}" for k in range(count))
    )


SCENES = {
    "plates": lambda: soup(1, 30, opaque=1.1),
    "plates and panes": lambda: soup(2, 30, opaque=0.6),
    "floor": tiled_floor,
    "ball": shiny_ball,
}


def drawn(scene, samples, facets, eye, channels=("rgba", "cryptoobject", "diffuse", "specular"), **how):
    stage = stage_of_facets(facets, scene)
    update = {
        "render": stage.job.render.model_copy(update={"samples": samples, **how}),
        "output": stage.job.output.model_copy(update={"channels": channels}),
    }
    stage = replace(stage, job=stage.job.model_copy(update=update))
    buffers = new_buffers(stage)
    draw_frame(stage, eye, buffers)
    return buffers


@pytest.fixture
def settled(monkeypatch):
    """How many microtiles were settled."""
    found = []
    real = drawing.settled_tiles

    def counted(*given):
        tiles = real(*given)
        found.append(np.count_nonzero(tiles))
        return tiles

    monkeypatch.setattr(drawing, "settled_tiles", counted)
    return found


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("samples", [5, 16])
def test_the_same_triangles_are_seen_as_without_it(name, samples, settled, monkeypatch):
    """Every triangle is an object: mattes tell which of them each sample saw, to the last bit."""
    scene = SCENES[name]()
    for facets, eye in (
        (panel(density=120), viewer((0.21, 0.13, 2.9))),
        (cube(density=60), viewer((1.9, 1.4, 2.6), near=2.2, far=4.4)),
    ):
        once = drawn(scene, samples, facets, eye)
        assert sum(settled) > 10, "nothing is settled"
        with monkeypatch.context() as patch:
            patch.setattr(antialiasing, "_WORTH_SETTLING", 10**9)
            each = drawn(scene, samples, facets, eye)
        np.testing.assert_array_equal(once["A"], each["A"])
        for k in range(3):
            for channel in "RGBA":
                layer = f"CryptoObject0{k}.{channel}"
                np.testing.assert_array_equal(
                    once[layer].view(np.uint32), each[layer].view(np.uint32), err_msg=layer
                )
        for layer in ("R", "G", "B", "diffuse.R", "specular.G"):
            np.testing.assert_allclose(once[layer], each[layer], rtol=0.01, atol=2**-10, err_msg=layer)


def test_two_samples_are_looked_at_one_by_one(settled):
    drawn(tiled_floor(), 2, panel(), viewer((0, 0, 2.9)))
    assert not settled


def test_small_blocks_settle_the_same(monkeypatch):
    scene, eye = tiled_floor(), viewer((0.2, 0.4, 2.9))
    whole = drawn(scene, 8, panel(density=70), eye)
    monkeypatch.setattr("quiltcli.visibility.setup.blocks.SIDE", 64)
    monkeypatch.setattr("quiltcli.visibility.setup.prewarp.SIDE", 64)
    cut = drawn(scene, 8, panel(density=70), eye)
    for name, pixels in whole.items():
        np.testing.assert_allclose(cut[name], pixels, rtol=2**-9, atol=2**-11, err_msg=name)


def test_many_samples_take_no_more_memory_than_few():
    peaks = {}
    for samples in (4, 64):
        tracemalloc.start()
        drawn(shiny_ball(), samples, panel(density=60), viewer((0.21, 0.13, 2.9)))
        peaks[samples] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peaks[64] < 1.2 * peaks[4]


def test_most_of_a_plain_floor_is_looked_at_once(settled):
    """What is left for the other samples is the rims of tiles."""
    scene, eye = tiled_floor(2), viewer((0, 1.5, 2.5))
    drawn(scene, 4, panel(density=200), eye)
    shown = np.count_nonzero(np.isfinite(drawn(scene, 1, panel(density=200), eye, ("Z",))["Z"])) / 64
    assert sum(settled) > 0.8 * shown


def glinting_floor(roughness=0.3):
    """A floor that mirrors a lamp as a small glint."""
    scene = tiled_floor(1)
    material = replace(scene.materials, roughness=np.full(1, roughness, np.float32))
    return replace(scene, materials=material, lights=lights(point=[(0.1, 0.9, -2.9)], power=[(20, 20, 20)]))


def test_every_sample_is_shaded_where_a_job_asks_for_that(settled):
    """Where light is smooth nothing changes; what light's edges lose by one look a pixel is won back."""
    eye, facets = viewer((0, 1.2, 2.5)), panel(density=120)
    smooth = tiled_floor(2)
    smooth = replace(smooth, lights=lights(ambient=(0.3, 0.2, 0.1)))
    once = drawn(smooth, 16, facets, eye)
    assert sum(settled) > 10
    settled.clear()
    each = drawn(smooth, 16, facets, eye, sample_shading=True)
    assert not settled, "nothing may be looked at once"
    for layer in ("R", "G", "B", "A"):
        np.testing.assert_array_equal(once[layer], each[layer], err_msg=layer)
    # A glint: most of it changes within pixels.
    scene = glinting_floor()
    truth = drawn(scene, 144, facets, eye, sample_shading=True)["specular.G"].astype(float)
    once, each = (
        drawn(scene, 16, facets, eye, sample_shading=asked)["specular.G"].astype(float)
        for asked in (False, True)
    )
    assert truth.max() > 4
    other = once != each
    assert other.sum() > 100
    errors = [np.sqrt(np.mean((found - truth)[other] ** 2)) for found in (once, each)]
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("samples", [5, 16])
def test_what_is_written_at_once_is_the_mean_of_its_sum_to_the_last_bit(name, samples, monkeypatch):
    scene, facets, eye = SCENES[name](), cube(density=50), viewer((1.9, 1.4, 2.6))
    at_once = drawn(scene, samples, facets, eye)
    real = antialiasing.add_samples
    monkeypatch.setattr(antialiasing, "add_samples", lambda *given: real(*given[:5]))
    summed = drawn(scene, samples, facets, eye)
    for layer, values in summed.items():
        kind = np.uint16 if values.itemsize == 2 else np.uint32
        np.testing.assert_array_equal(at_once[layer].view(kind), values.view(kind), err_msg=layer)
