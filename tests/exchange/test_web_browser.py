"""The page in a real browser: from the eye it is the simulation's picture, and from aside too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.display import load_display
from quiltcli.exchange.web import ViewOptions, view
from quiltcli.images.preview import tone_map
from quiltcli.job import load_display_file, load_job
from quiltcli.projection.camera import frame_display
from quiltcli.render.sequence import render
from quiltcli.viewer.view import viewers_of
from tests.helpers.chromium import chromium, look
from tests.helpers.curved_jobs import boxes, curved_job

ROOT = Path(__file__).parents[2]
SIZE = (400, 300)
MEAN = 0.6  # of 255: edges are smoothed from four samples here and there, but not the same ones


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """The demo at a lower resolution, rendered, with its page."""
    chromium()
    folder = tmp_path_factory.mktemp("browser")
    (folder / "display.yaml").write_text(
        f"quilt_display: 1\nmesh: {ROOT / 'display_models/cube5.obj'}\n"
        "resolution: {pixels_per_metre: 1500}\n"
        "facets: {1: {name: '</script><script>document.title = \"broken\"</script>'}}\n"
    )
    (folder / "job.yaml").write_text(
        f"quilt_job: 1\ndisplay: display.yaml\nscene: {ROOT / 'scenes/teapot_and_solids.yaml'}\nframes: 1-2\n"
        "viewer: {near: 0.1, far: 10, path: {orbit: {center: [0, 0.12, 0], radius: 1.05, height: 0.5,"
        " start_deg: -50, end_deg: 28, end_frame: 2}}}\n"
    )
    loaded = load_job(folder / "job.yaml")
    render(loaded)
    view(folder / "out", options=ViewOptions(texture=8192, errors=False))
    return loaded


def simulated(job, **how):
    options = PictureOptions(size=SIZE, compare=False, **how)
    (result,) = simulate(job, [2], options)
    return tone_map(result.picture)


def differences(pixels, expected):
    away = np.abs(pixels.astype(float) - expected)
    assert pixels.shape == expected.shape
    assert expected.std() > 20  # a picture of something
    return away.mean(), np.mean(away.max(axis=-1) > 24)


def test_from_the_eye_it_is_the_picture_of_the_simulation(job, tmp_path):
    seen = look(job.output.directory / "view.html", "frame=2", *SIZE, tmp_path)
    assert seen.title == "ready 5"
    assert seen.console == []
    mean, far_off = differences(seen.pixels, simulated(job))
    assert mean < MEAN
    assert far_off < 0.01


def test_from_aside_it_is_bent_as_the_simulation_says(job, tmp_path):
    place = (-0.35, 0.55, 1.05)
    viewer = replace(viewers_of(job, [2])[0], eye=np.array(place), up=np.array([0.0, 1.0, 0.0]))
    corners = load_display(load_display_file(job.display)).corners
    camera, fov = frame_display(viewer, corners, SIZE[0] / SIZE[1], turn=True)
    numbers = ",".join(f"{value:.12g}" for value in (*camera.eye, *camera.look, *camera.up, fov))
    settings = f"frame=2&ghost=0&path=0&camera={numbers}"
    seen = look(job.output.directory / "view.html", settings, *SIZE, tmp_path)
    assert seen.title == "ready 5"
    assert seen.console == []
    mean, far_off = differences(seen.pixels, simulated(job, place=place))
    assert mean < MEAN
    assert far_off < 0.01
    # What the bound is worth: the frame for another eye, seen from here, is far beyond it.
    other = look(job.output.directory / "view.html", settings.replace("frame=2", "frame=1"), *SIZE, tmp_path)
    assert differences(other.pixels, seen.pixels)[0] > 5 * MEAN


@pytest.mark.parametrize(
    ("display", "eye", "at"),
    [
        ("surfaces:\n- {kind: sphere, radius: 1, pixels: [1024, 512]}", (0.6, 0.9, 2.6), (0, 0, 0)),
        pytest.param(
            "projection: {kind: equirect, pixels: [1024, 512], follows: view}",
            (0.3, 0.2, 0.1),
            (2, 0.5, -3),
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_curved_display_is_the_picture_of_the_simulation(display, eye, at, tmp_path):
    chromium()
    curved = curved_job(tmp_path, display, boxes(60, 1.0, 4.0), eye, at)
    render(curved)
    view(curved.output.directory, options=ViewOptions(texture=8192, errors=False))
    settings = "frame=1&ghost=0&path=0&edges=0"
    seen = look(curved.output.directory / "view.html", settings, *SIZE, tmp_path)
    assert seen.title == "ready 1"
    assert seen.console == []
    (result,) = simulate(curved, [1], PictureOptions(size=SIZE, compare=False))
    mean, far_off = differences(seen.pixels, tone_map(result.picture))
    assert mean < MEAN
    assert far_off < 0.01
