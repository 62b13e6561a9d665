"""Curved displays looked at: from the viewer's eye a sphere's image is the scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.analysis.simulate import PictureOptions, simulate
from tests.helpers.curved_jobs import bumpy_ball, curved_job

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
