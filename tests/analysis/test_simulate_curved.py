"""Curved displays looked at: from the viewer's eye a sphere's image is the scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.simulate import PictureOptions, simulate
from tests.helpers.curved_jobs import boxes, bumpy_ball, curved_job

SMALL = PictureOptions(size=(120, 90), samples=2, threads=1)


def test_from_the_eye_a_sphere_shows_the_scene(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [2048, 1024]}"
    job = curved_job(tmp_path, display, bumpy_ball(6.0, 4, 0.02), (0.5, 0.4, 2.6))
    (found,) = simulate(job, [1], SMALL)
    assert found.comparison is not None
    assert found.direct is not None
    lit = np.abs(found.picture - found.direct).max(axis=2) < 0.02
    # The sphere's disc, but for its rim, is the picture that there would be without it.
    y, x = np.mgrid[:90, :120]
    radius = np.hypot(x - 59.5, y - 44.5)
    assert lit[radius < 30].mean() > 0.99


def test_a_panorama_has_no_seam(tmp_path: Path) -> None:
    display = "projection: {kind: equirect, pixels: [512, 256], heading_deg: 180}"
    job = curved_job(tmp_path, display, bumpy_ball(6.0, 4, 0.02), (0.1, 0.2, 0.3), (0.1, 0.2, -5))
    (found,) = simulate(job, [1], SMALL)
    assert found.direct is not None
    # The seam runs down the middle of what is ahead.
    away = np.abs(found.picture - found.direct).max(axis=2)
    assert away[20:70, 50:70].max() < 0.02


def glowing_ball(folder: Path, display: str, eye: tuple[float, float, float]):
    """A job in a closed ball that shines evenly to all sides."""
    job = curved_job(folder, display, bumpy_ball(6.0, 2, 0.0), eye)
    (folder / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- {mesh: scene.obj, material: {color: [0.5, 0.5, 0.5], unlit: true}}\n"
    )
    return job.model_copy(update={"scene": folder / "scene.yaml"})


@pytest.mark.parametrize("how", ["linear", "nearest"])
def test_the_rim_of_a_sphere_is_as_bright_as_its_middle(how: str, tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [96, 48]}"
    job = glowing_ball(tmp_path, display, (0.5, 0.4, 2.6))
    (found,) = simulate(job, [1], replace(SMALL, filter=how, samples=1))
    picture = found.picture[..., 0]
    # Pixels are the sphere, all of one brightness, or what is around: none is a mixture with the dark side.
    middle = picture[45, 60]
    assert 0.4 < middle <= 1
    sphere = np.hypot(*np.meshgrid(np.arange(120) - 59.5, np.arange(90) - 44.5)) < 40
    assert sphere.sum() > 4000
    assert np.abs(picture[sphere] - middle).max() < 1e-3
    assert ((np.abs(picture - middle) < 1e-3) | (picture < 0.1)).all()


@pytest.mark.parametrize(
    ("display", "eye"),
    [
        ("surfaces:\n- {kind: sphere, radius: 1, pixels: [256, 128]}", (0.5, 0.4, 2.6)),
        (
            "surfaces:\n- {kind: cylinder, radius: 2, height: 2, lit: inside, pixels: [256, 64]}",
            (0.2, 0.1, 0.3),
        ),
    ],
)
def test_a_display_errs_as_a_picture_that_is_resampled_once(display: str, eye, tmp_path: Path) -> None:
    job = curved_job(tmp_path, display, boxes(60, 1.0, 4.0), eye)
    (found,) = simulate(job, [1], replace(SMALL, resampled=True))
    assert found.comparison is not None
    assert found.comparison.mean > 0
    assert abs(found.comparison.mean / found.comparison.resampled - 1) < 0.01
