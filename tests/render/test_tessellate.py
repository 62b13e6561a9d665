"""Tessellation: wrong pixels fall with the threshold, and the exact picture is what they fall to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_frame
from tests.helpers.curved_jobs import boxes, curved_job
from tests.render.test_curved import drawn, page, staged


def test_wrong_pixels_fall_with_the_threshold(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [512, 256]}"
    scene = boxes(60, 0.35, 0.45)
    eye, more = (1.2, 0.9, 2.7), "output: {channels: [triangle, Z, rgba]}\n"
    stage, viewer = staged(curved_job(tmp_path, display, scene, eye, more=more))
    truth = drawn(stage, viewer)
    exact = page(stage, truth["triangle"])
    wrong, pieces = [], []
    for threshold in (0.2, 0.05, 0.012):
        how = f"render: {{method: tessellate, threshold: {threshold}}}\n"
        stage, viewer = staged(curved_job(tmp_path, display, scene, eye, more=how + more))
        buffers = new_buffers(stage)
        record = draw_frame(stage, viewer, buffers)
        found = page(stage, buffers["triangle"])
        wrong.append(float((found != exact)[exact > 0].mean()))
        pieces.append(record.pairs)
    assert wrong[0] > wrong[1] > wrong[2]
    assert wrong[2] < 3e-3
    assert pieces[0] < pieces[1] < pieces[2]
    same = (found == exact) & (exact > 0)
    z, exact_z = page(stage, buffers["Z"]), page(stage, truth["Z"])
    assert np.abs(z[same] / exact_z[same] - 1).max() < 2e-3
    red, exact_red = (page(stage, part["R"]).astype(np.float32) for part in (buffers, truth))
    assert np.abs(red - exact_red)[same].max() < 0.02


@pytest.mark.long
def test_at_the_papers_threshold_one_pixel_in_a_thousand_is_wrong(tmp_path: Path) -> None:
    display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [1024, 512]}"
    scene, eye, more = boxes(150, 0.3, 0.45), (1.2, 0.9, 2.7), "output: {channels: [triangle]}\n"
    pictures = []
    for how in ("", "render: {method: tessellate, threshold: 0.012}\n"):
        stage, viewer = staged(curved_job(tmp_path, display, scene, eye, more=how + more))
        pictures.append(page(stage, drawn(stage, viewer)["triangle"]).copy())
    exact, found = pictures
    assert (found != exact)[exact > 0].mean() < 1e-3


def test_it_is_for_curved_surfaces(tmp_path: Path) -> None:
    from quiltcli.errors import JobError

    display = "projection: {kind: equirect, pixels: [64, 32]}"
    job = curved_job(tmp_path, display, boxes(2, 0.3, 0.5), more="render: {method: tessellate}\n")
    with pytest.raises(JobError, match="tessellate is for displays of curved surfaces and nothing else"):
        staged(job)
