"""Rays with several samples a pixel: the means are those of the rasterizer, and they stand in for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import TooNearError
from quiltcli.render.frame import draw_frame as rasterize_frame
from quiltcli.render.methods import draw_frame
from quiltcli.render.methods.raycast import cast_frame
from quiltcli.render.setup import set_stage
from tests.helpers.curved_jobs import boxes, bumpy_ball, curved_job

SAMPLES = "render: {samples: 9}\noutput: {channels: [rgba, Z]}\n"


@pytest.mark.parametrize(
    "display",
    [
        "surfaces:\n- {kind: sphere, radius: 1, pixels: [96, 48]}",
        "projection: {kind: fisheye, pixels: [64, 64]}",
        "mesh: flat.obj\nresolution: {pixels_per_metre: 40}",
    ],
)
def test_means_of_rays_are_those_of_the_rasterizer(display: str, tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0.3\nv -1 1 0.3\nf 1 2 3 4\n")
    job = curved_job(tmp_path, display, boxes(40, 0.5, 1.5), (0.3, 0.2, 2.5), more=SAMPLES)
    stage = set_stage(job)
    (view,) = stage.views([1])
    drawn, cast = new_buffers(stage), new_buffers(stage)
    draw_frame(stage, view.viewer, drawn)
    cast_frame(stage, view.viewer, cast)
    inside = drawn["A"] > 0
    assert (inside == (cast["A"] > 0)).all()
    assert ((drawn["A"] > 0) & (drawn["A"] < 1)).sum() > 0  # silhouettes are mixed
    for name in "RGBA":
        away = np.abs(drawn[name].astype(np.float64) - cast[name])
        assert away.max() < 2e-3, name


def test_an_eye_that_touches_a_surface_has_its_samples_cast(tmp_path: Path) -> None:
    few = SAMPLES.replace("9", "2")
    display = "surfaces:\n- {kind: cylinder, radius: 1, height: 2, lit: inside, pixels: [512, 128]}"
    job = curved_job(tmp_path, display, bumpy_ball(6.0, 3), (0.0, 0.013, 0.99), (0, 0, 4), few)
    stage = set_stage(job)
    viewer = stage.views([1])[0].viewer
    buffers = new_buffers(stage)
    with pytest.raises(TooNearError):
        rasterize_frame(stage, viewer, buffers)
    draw_frame(stage, viewer, buffers)
    # A closed ball around the display: every pixel sees it with all of its samples.
    assert (buffers["A"] == 1).all()
    assert np.isfinite(buffers["Z"]).all()
