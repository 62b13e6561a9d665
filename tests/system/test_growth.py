"""What a frame costs, in things done instead of seconds: how it grows with facets, triangles and pixels."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pytest

from quiltcli.display import Facets
from quiltcli.render import batch
from quiltcli.render import buffers as blank
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import Stage
from quiltcli.scene import Scene
from quiltcli.visibility import draw as raster
from quiltcli.visibility import shares as binframe
from quiltcli.visibility.binning import pairs as binning
from quiltcli.visibility.resolve import tiles
from tests.benchmarks.watching import STAGES, counted, stage_seconds
from tests.helpers.ball_setup import ball_scene, stage_of_facets
from tests.helpers.in_memory import display, icosphere, viewer

EYE = viewer((2.2, 1.8, 3.2))
PIXELS = 400_000  # of all facets together, lit or not

PROBES = {
    (binning, "candidate_pairs"): lambda found, *_: {"proposed": found[0].size},
    (binframe, "bin_share"): lambda share, *_: {"pairs": share.pairs, "block pairs": share.keys.size},
    (raster, "draw_small"): lambda candidates, *_: {"small": candidates},
    (raster, "draw_large"): lambda evaluated, *_: {"large": evaluated},
    (blank, "block_window"): lambda pixels, buffer, *_: {"bytes": pixels.size * buffer.itemsize},
    (batch, "fill"): lambda _, buffers, channels, viewer, shaded: {
        "shaded": shaded.hits.depth.size,
        "hits": shaded.hits.pixel.size,
        "bytes": shaded.hits.pixel.size * sum(buffer.itemsize for buffer in buffers.values()),
    },
}


def done(stage: Stage) -> Counter[str]:
    """Counts of one frame into empty buffers."""
    buffers = new_buffers(stage)
    clean = np.zeros(stage.blocks.used.size, bool)
    with counted(PROBES) as counts:
        draw_frame(stage, EYE, buffers, dirty=clean)
    counts["evaluated"] = counts["small"] + counts["large"]
    return counts


def ball_display(splits: int, pixels: float = PIXELS) -> Facets:
    """An icosphere of 20·4ˢ facets that together have so many pixels."""
    vertices, triangles = icosphere(splits)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return display(vertices, triangles.tolist(), (pixels / area) ** 0.5)


@lru_cache
def by_facets() -> list[Counter[str]]:
    scene = ball_scene(4)
    return [done(stage_of_facets(ball_display(splits), scene)) for splits in range(4)]


@lru_cache
def by_triangles() -> list[Counter[str]]:
    facets = ball_display(2)
    return [done(stage_of_facets(facets, ball_scene(splits))) for splits in (3, 4, 5, 6)]


@lru_cache
def by_pixels() -> list[Counter[str]]:
    scene = ball_scene(2)
    return [done(stage_of_facets(ball_display(2, PIXELS * 4**k), scene)) for k in range(3)]


def growth(counts: list[Counter[str]], what: str) -> list[float]:
    """Each count over the one before it."""
    assert all(c[what] > 0 for c in counts), what
    return [b[what] / a[what] for a, b in pairwise(counts)]


# Facets: 20, 80, 320, 1280 that together have the same pixels; the scene has 5120 triangles.


def test_pairs_grow_with_the_edges_between_facets_not_with_facets():
    # Four times the facets have edges twice as long together, and only triangles on an edge count twice.
    for what in ("pairs", "block pairs"):
        assert max(growth(by_facets(), what)) < 2
    assert by_facets()[-1]["pairs"] < 3 * 5120


def test_the_broad_phase_proposes_what_lies_on_edges_not_triangles_times_facets():
    assert max(growth(by_facets(), "proposed")) < 2.5
    assert by_facets()[-1]["proposed"] < 0.01 * 5120 * 1280


def test_pixels_that_are_looked_at_do_not_depend_on_the_number_of_facets():
    for counts in by_facets():
        assert counts["evaluated"] < 12 * counts["hits"]
    assert max(growth(by_facets(), "evaluated")) < 1.3


# Triangles: 1280, 5120, 20480, 81920 of the same ball on 320 facets.


def test_work_is_linear_in_triangles():
    for what in ("pairs", "block pairs", "proposed"):
        assert max(growth(by_triangles(), what)) < 4.2


def test_smaller_triangles_do_not_waste_pixels():
    for counts in by_triangles():
        assert counts["evaluated"] < 15 * counts["hits"]


def test_the_picture_is_stored_once_however_many_triangles_it_has():
    for what in ("hits", "bytes"):
        assert growth(by_triangles(), what) == pytest.approx([1, 1, 1], abs=0.03)


# Pixels: four times as many, twice.


def test_pixels_and_bytes_are_linear_in_the_resolution():
    for what in ("hits", "bytes"):
        assert growth(by_pixels(), what) == pytest.approx([4, 4], rel=0.02)
    for what in ("evaluated", "shaded"):
        assert max(growth(by_pixels(), what)) < 4.2


def test_binning_does_not_depend_on_the_resolution():
    assert growth(by_pixels(), "pairs") == pytest.approx([1, 1], rel=0.05)


# What cannot be seen costs nothing.


def lit_and_dark(dark: int) -> Facets:
    """A wall towards the eye, and walls beside it that show their backs."""
    wall = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    vertices = np.concatenate([wall, *(wall + (0, 0, -0.01 * k) for k in range(1, dark + 1))])
    polygons = [[0, 1, 2, 3]] + [[4 * k + 3, 4 * k + 2, 4 * k + 1, 4 * k] for k in range(1, dark + 1)]
    return display(vertices, polygons, 100)


def test_unlit_facets_cost_nothing():
    scene = ball_scene(3)
    alone, among = (done(stage_of_facets(lit_and_dark(dark), scene)) for dark in (0, 40))
    assert alone == among


def test_only_what_was_drawn_is_cleared():
    stage = stage_of_facets(lit_and_dark(40), ball_scene(3))
    buffers = new_buffers(stage)
    tiles = np.diff(stage.blocks.tile_start)
    dark = stage.blocks.facet == 3  # behind the wall: nothing will be drawn there
    drawn_before = dark.repeat(tiles)
    with counted(PROBES) as counts:
        draw_frame(stage, EYE, buffers, dirty=(drawn := drawn_before.copy()))
    rectangle = int((stage.blocks.width * stage.blocks.height)[dark].sum())
    assert counts["bytes"] == 12 * (rectangle + counts["hits"])
    assert set(stage.blocks.facet.repeat(tiles)[drawn]) == {0}
    assert counts["hits"] / 64 <= np.count_nonzero(drawn) <= counts["hits"] / 10


def test_only_what_was_drawn_is_emptied_where_something_is_drawn_again():
    stage = stage_of_facets(lit_and_dark(0), ball_scene(3, radius=0.3))
    buffers, dirty = new_buffers(stage), np.zeros(stage.blocks.used.size, bool)
    draw_frame(stage, EYE, buffers, dirty=dirty)
    asked = []
    probe = {
        (batch, "empty_missed"): lambda _, stage, drawing, stale, first, buffers: (
            asked.append(np.flatnonzero(stale) + first) or {}
        )
    }
    with counted(probe):
        draw_frame(stage, EYE, buffers, dirty=dirty)
    np.testing.assert_array_equal(np.concatenate(asked), np.flatnonzero(dirty))
    assert dirty.sum() < 0.5 * dirty.size


def test_microtiles_all_of_whose_pixels_see_something_are_not_searched_for_bare_ones():
    stage = stage_of_facets(ball_display(1), ball_scene(5, radius=40))  # the eye is inside of it
    buffers, dirty = new_buffers(stage), np.zeros(stage.blocks.used.size, bool)
    draw_frame(stage, EYE, buffers, dirty=dirty)
    probe = {(tiles, "owned_pixels"): lambda _, blocks, some, drawn: {"searched": some.index.size}}
    with counted(probe) as counts:
        draw_frame(stage, EYE, buffers, dirty=dirty)
    assert dirty.sum() > 1000
    assert counts["searched"] <= np.count_nonzero(dirty & ~stage.blocks.interior)


def test_culled_triangles_are_neither_binned_nor_drawn():
    stage = stage_of_facets(ball_display(2), ball_scene(5))
    culling = stage.job.render.model_copy(update={"backface_culling": True})
    both, one = done(stage), done(replace(stage, job=stage.job.model_copy(update={"render": culling})))
    assert one["hits"] == both["hits"]
    assert one["pairs"] < 0.6 * both["pairs"]
    assert one["evaluated"] < both["evaluated"]


def test_triangles_behind_others_are_hardly_looked_at():
    stage = stage_of_facets(ball_display(2), ball_scene(5))
    culling = stage.job.render.model_copy(update={"backface_culling": True})
    both, one = done(stage), done(replace(stage, job=stage.job.model_copy(update={"render": culling})))
    assert both["evaluated"] - one["evaluated"] < 0.5 * one["evaluated"]


def before(scene: Scene, corners: list[tuple[float, float, float]]) -> Scene:
    """The scene with one more triangle."""
    count = len(scene.vertices)
    return replace(
        scene,
        vertices=np.concatenate((scene.vertices, corners)),
        triangles=np.concatenate((scene.triangles, np.array([[count, count + 1, count + 2]], np.int32))),
        normals=np.concatenate((scene.normals, np.tile(np.float32([0, 0, 1]), (3, 1)))),
        colors=np.ones((count + 3, 3), np.float32),
        flat=np.append(scene.flat, True),
        object=np.append(scene.object, np.int32(0)),
        material=np.append(scene.material, np.int32(0)),
    )


def test_small_triangles_behind_a_large_one_are_not_looked_at():
    ball = ball_scene(5, radius=0.3)
    stage = stage_of_facets(lit_and_dark(0), ball)
    behind = replace(stage, scene=before(ball, [(-1.5, -1, 0.5), (2.5, -1, 0.5), (0.3, 2.5, 0.5)]))
    alone, hidden = done(stage), done(behind)
    assert alone["small"] > 10_000
    assert hidden["small"] == 0
    assert hidden["hits"] > alone["hits"]


def test_the_stages_that_benchmarks_time_are_those_of_a_frame():
    stage = stage_of_facets(ball_display(0), ball_scene(3))
    buffers = new_buffers(stage)
    times = stage_seconds(lambda: draw_frame(stage, EYE, buffers))
    assert set(times) == {name for _, _, name in STAGES} | {"rest"}
    assert min(times.values()) > 0
