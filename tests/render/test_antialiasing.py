"""Samples: where they lie, how they are summed, and that a facet's image does not depend on its place."""

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.images.facets import facet_image
from quiltcli.render.antialiasing import best_step, sample_places
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from tests.helpers.ball_setup import ball_scene, stage_of_facets, stage_of_layout
from tests.helpers.flat_displays import placed
from tests.helpers.in_memory import cube, panel, viewer
from tests.helpers.turned_layout import SIZE, TURNS, turned_display
from tests.helpers.wall_scene import lights

CELLS = {2: (2, 1), 4: (2, 2), 8: (4, 2), 9: (3, 3), 16: (4, 4), 32: (8, 4), 64: (8, 8), 256: (16, 16)}


def with_samples(stage, samples, channels=("rgba", "Z", "albedo")):
    job = stage.job
    render = job.render.model_copy(update={"samples": samples})
    output = job.output.model_copy(update={"channels": channels})
    return replace(stage, job=job.model_copy(update={"render": render, "output": output}))


@pytest.mark.parametrize("samples", CELLS)
def test_good_numbers_have_a_sample_in_every_cell(samples):
    across, down = CELLS[samples]
    places = np.array(sample_places(samples)) + 0.5
    columns, rows = np.floor(places * [across, down]).astype(int).T
    other = np.floor(places * [down, across]).astype(int).T
    assert (
        len(set(zip(columns, rows, strict=True))) == samples or len(set(zip(*other, strict=True))) == samples
    )


@pytest.mark.parametrize("samples", [1, 3, 6, 7, 48, 97])
def test_samples_lie_about_the_centre_of_the_pixel(samples):
    places = np.array(sample_places(samples))
    assert np.abs(places).max() < 0.5
    assert np.abs(places.mean(axis=0)).max() < 1e-12
    assert len({round(x, 9) for x in places[:, 0]}) == samples == len({round(y, 9) for y in places[:, 1]})


def test_a_step_is_found_for_any_number():
    assert np.gcd(best_step(97), 97) == 1
    assert best_step(5) in (2, 3)


def coverage_error(samples, edges):
    """Rms error of the share of a pixel that lies on one side of straight edges."""
    fine = (np.indices((200, 200)).reshape(2, -1).T + 0.5) / 200 - 0.5
    places = np.array(sample_places(samples))
    truth = np.array([(fine @ n > d).mean() for n, d in edges])
    found = np.array([(places @ n > d).mean() for n, d in edges])
    return float(np.sqrt(np.mean((truth - found) ** 2)))


def test_the_error_at_edges_falls_as_the_number_to_the_minus_three_quarters():
    dice = np.random.default_rng(3)
    angles, distances = dice.uniform(0, 2 * np.pi, 300), dice.uniform(-0.5, 0.5, 300)
    edges = [((np.cos(a), np.sin(a)), d) for a, d in zip(angles, distances, strict=True)]
    numbers = np.array([4, 16, 64, 256])
    errors = [coverage_error(int(n), edges) for n in numbers]
    slope = np.polyfit(np.log(numbers), np.log(errors), 1)[0]
    assert slope < -0.72


def test_a_covered_pixel_is_the_mean_of_its_samples_to_the_last_bit():
    """One colour everywhere: any number of samples gives it exactly."""
    stage = with_samples(stage_of_facets(panel(), ball_scene(0, 5.0, lights(ambient=(1, 1, 1)))), 7)
    one = with_samples(stage, 1)
    buffers, single = new_buffers(stage), new_buffers(one)
    draw_frame(stage, viewer((0, 0, 2.9)), buffers)
    draw_frame(one, viewer((0, 0, 2.9)), single)
    assert (single["A"] == 1).all()
    for name in ("R", "G", "B", "A", "Z", "albedo.R"):
        np.testing.assert_allclose(buffers[name], single[name], rtol=2**-10, err_msg=name)


def test_edges_get_shares_of_the_light_and_the_ball_stays_where_it_is():
    lamps = lights(ambient=(1, 1, 1))
    stage = stage_of_facets(cube(), ball_scene(3, 0.6, lamps))
    many, one = with_samples(stage, 16), with_samples(stage, 1)
    buffers, single = new_buffers(many), new_buffers(one)
    draw_frame(many, viewer((2.2, 1.8, 3.2)), buffers)
    draw_frame(one, viewer((2.2, 1.8, 3.2)), single)
    shares = np.unique(buffers["A"].astype(float) * 16)
    assert set(shares) <= set(range(17))
    assert len(shares) > 10
    assert buffers["A"].astype(float).sum() == pytest.approx(single["A"].astype(float).sum(), rel=0.01)
    np.testing.assert_array_equal(buffers["Z"], single["Z"])
    np.testing.assert_allclose(buffers["R"], buffers["albedo.R"], atol=2e-3)


def image_of(turn, corner, samples, bleed):
    """The image of one facet that stands turned on a page, its corner at a place of it."""
    facets = turned_display([0])
    low = np.minimum(TURNS[turn] * SIZE, 0).sum(axis=1)
    layout = placed(facets, [np.column_stack((TURNS[turn], np.array(corner) - low)) + 0.0])
    layout = replace(layout, pages=np.array([[24, 24]], dtype=np.int32), padding=4)
    facets = replace(facets, normal=np.array([[0.0, 0, 1]]))
    points = facets.corners
    lamps = lights(sun=[(-1, -1, -1)], color=[(2, 2, 2)], ambient=(0.1, 0.1, 0.1))
    ball = ball_scene(4, 0.45 * np.ptp(points[:, 0]), lamps)
    ball = replace(ball, vertices=ball.vertices * [1, 1, 0.01] + points.mean(axis=0) - [0, 0, 0.01])
    stage = with_samples(stage_of_layout(facets, layout, ball, bleed), samples, ("rgba", "Z"))
    buffers = new_buffers(stage)
    draw_frame(stage, viewer(tuple(points.mean(axis=0) + [0.003, 0.001, 0.5]), near=0.001), buffers)
    return facet_image(buffers, stage.layout, 0, stage.owners)


@pytest.mark.parametrize("samples", [1, 4, 5])
@pytest.mark.parametrize("bleed", [0, 2])
@pytest.mark.parametrize("side", [None, 8])
def test_a_facets_image_does_not_depend_on_its_place(samples, bleed, side, monkeypatch):
    """One facet turned and mirrored every way, inside a page and at its borders, in small blocks too."""
    if side:
        monkeypatch.setattr("quiltcli.visibility.setup.blocks.SIDE", side)
        monkeypatch.setattr("quiltcli.visibility.setup.prewarp.SIDE", side)
    expected = image_of(0, (5, 6), samples, bleed)
    assert np.isfinite(expected["Z"]).sum() > 40
    for turn in range(8):
        for corner in ((0, 0), (5, 6)):
            found = image_of(turn, corner, samples, bleed)
            for name, pixels in expected.items():
                # Light between nine points of a tile may round the other way where tiles begin elsewhere.
                np.testing.assert_allclose(found[name], pixels, rtol=2**-9, err_msg=f"{name} {turn} {corner}")
