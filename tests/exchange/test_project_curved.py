"""Pictures put on curved facets: a function of direction comes back at each pixel's own ray."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.exchange.elsewhere import MadeOptions
from quiltcli.exchange.project.lenses import Equirect, axes_of
from quiltcli.exchange.project.master import Master
from quiltcli.exchange.project.project import project
from quiltcli.formats.exr.image import read_exr
from quiltcli.images.names import facet_path
from quiltcli.render.setup import set_stage
from tests.exchange.test_project import pictures_of, put, smooth
from tests.helpers.curved_jobs import boxes, curved_job

EYE = (0.2, 0.3, 0.1)


@pytest.mark.parametrize(
    ("display", "least"),
    [
        (
            "surfaces:\n- {kind: sphere, radius: 2, zenith_deg: [0, 90], lit: inside, pixels: [200, 60]}",
            0.999,
        ),
        ("projection: {kind: dome_master, pixels: [96, 96]}", 0.75),
        ("projection: {kind: cubemap, pixels: [128, 96], follows: view}", 0.49),
    ],
)
def test_a_smooth_function_of_direction_comes_back(display: str, least: float, tmp_path: Path) -> None:
    job = curved_job(tmp_path, display, boxes(2, 0.5, 1.5), EYE, (0.2, 0.1, -4))
    put(tmp_path / "m.exr", pictures_of(Equirect(axes_of(0, 0), (800, 400)), smooth)[0])
    project(job, Master(tmp_path / "m.exr", "equirect"), MadeOptions(tmp_path / "out", [1]))
    stage = set_stage(job)
    chart, viewer = stage.facets.charts[0], stage.views([1])[0].viewer
    width, height = chart.size
    points = chart.points(np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5)
    if chart.stands:
        directions = points - viewer.eye[:, None, None]
    elif chart.follows == "view":
        directions = np.einsum("ij,jhw->ihw", viewer.camera_from_world.T, points)
    else:
        directions = points
    image = read_exr(facet_path(tmp_path / "out", 1, 1)).channels
    seen = image["A"] > 0.999
    got = np.stack([image[c] for c in "RGBA"], axis=-1).astype(np.float64)
    assert np.abs(got - smooth(directions))[seen].max() < 1e-3
    assert seen.mean() >= least
    # Pixels without a direction show nothing.
    assert not seen[~np.isfinite(directions.sum(axis=0))].any()


def test_of_a_sphere_from_outside_the_lit_pixels_show_the_picture(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [128, 64]}"
    job = curved_job(tmp_path, display, boxes(2, 0.5, 1.5), (0, 0, 3.0))
    put(tmp_path / "m.exr", np.full((20, 40, 4), 0.5, np.float32))
    project(job, Master(tmp_path / "m.exr", "equirect"), MadeOptions(tmp_path / "out", [1]))
    chart = set_stage(job).facets.charts[0]
    x, y = np.arange(128) + 0.5, np.arange(64)[:, None] + 0.5
    lit = chart.lit(x, y, chart.points(x, y), np.array([0, 0, 3.0]))
    assert ((read_exr(facet_path(tmp_path / "out", 1, 1)).channels["R"] > 0) == lit).all()
