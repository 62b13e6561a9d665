"""A page to turn in the hands has perfect panels: images that make up for others are as they were meant."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.exchange.web.folder import open_folder
from quiltcli.exchange.web.frames import frame_images
from quiltcli.render.sequence import RenderOptions, render
from tests.helpers.even_light import COLOR, WALLS, even_job
from tests.helpers.projected import LEFT, RIGHT, WALL, projected_text


def light_of(shown):
    inside = shown.owners > 0
    return np.stack([shown.buffers[name][inside].astype(float) for name in "RGB"], axis=1)


def test_panels_of_a_page_are_even(tmp_path):
    text = WALLS + "corrections:\n  brightness: {exponent: 1, limit: 50}\n  level: 0.1\n"
    job = even_job(tmp_path, text)
    render(job, RenderOptions(folder=tmp_path / "out", threads=1, frames=[1]))
    folder = open_folder(tmp_path / "out")
    assert np.ptp(light_of(frame_images(folder, 1, plain=False))[:, 0]) > 0.05
    light = light_of(frame_images(folder, 1))
    assert light == pytest.approx(np.broadcast_to(0.1 * np.array(COLOR), light.shape), rel=2e-3)


def test_projectors_of_a_page_show_all_of_the_light(tmp_path):
    text = projected_text(tmp_path, WALL, LEFT + RIGHT, "blend: {black: 0.01}\n")
    job = even_job(tmp_path, text, eye=(0.1, 0.3, 3.4))
    render(job, RenderOptions(folder=tmp_path / "out", threads=1, frames=[1]))
    light = light_of(frame_images(open_folder(tmp_path / "out"), 1))
    even = np.abs(light - COLOR).max(axis=1) < 4e-3
    assert even.mean() > 0.97  # but for a pixel or two at borders
