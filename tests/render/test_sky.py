"""Environments that are seen: each pixel shows what lies in its direction, where nothing else does."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import JobError, SceneError
from quiltcli.formats.exr.image import write_exr
from quiltcli.geometry import rotation_deg
from quiltcli.job import load_job
from quiltcli.projection.planar import viewer_rays
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.setup import set_stage
from quiltcli.render.workers import Pool, can_fork, shared_buffers
from quiltcli.scene.environment.panorama import cell_directions
from quiltcli.shading.sky import angle
from quiltcli.visibility.rays.pixels import places
from tests.helpers.tiny_job import replaced, write_tiny_job

DISPLAYS = {
    "panels": None,
    "panorama": "quilt_display: 1\nprojection: {kind: equirect, pixels: [128, 64]}\n",
    "sphere": "quilt_display: 1\nsurfaces:\n- {kind: sphere, radius: 0.9, pixels: [128, 64]}\n",
}


def write_panorama(path, width=512, radiance=lambda d: (d + 1) / 2):
    """A panorama of radiance that is known in every direction."""
    picture = radiance(cell_directions(width)).astype(np.float32)
    write_exr(path, {name: picture[..., k] for k, name in enumerate("RGB")}, {})


def staged(folder, display=None, how="", light="", channels="rgba, Z"):
    write_panorama(folder / "sky.exr")
    write_tiny_job(folder, "" if display else "160, 80")
    if display:
        (folder / "display.yaml").write_text(display)
    replaced(
        folder,
        "scene.yaml",
        "lights:\n",
        f"lights:\n- {{type: environment, file: sky.exr, visible: true, shadows: false{light}}}\n",
    )
    replaced(
        folder,
        "job.yaml",
        "frames: 1-4",
        f"frames: 1-4\noutput: {{channels: [{channels}]}}\nrender: {{{how}}}",
    )
    return set_stage(load_job(folder / "job.yaml"))


def drawn(stage, frame=1):
    now = moment(stage, stage.views([frame])[0])
    buffers = new_buffers(stage)
    draw_moment(now, buffers)
    return now.view.viewer, buffers


def directions(stage, viewer, address):
    rays = viewer_rays(stage.layout, stage.facets, np.ones(stage.facets.count, bool), viewer)
    return places(address, stage.layout, stage.owners, rays).directions()


@pytest.mark.parametrize("name", DISPLAYS)
@pytest.mark.parametrize("how", ["", "samples: 3", "method: raycast", "samples: 4, shutter: 0.5"])
def test_a_pixel_shows_what_lies_in_its_direction(tmp_path, name, how):
    stage = staged(tmp_path, DISPLAYS[name], how, ", rotate_deg: 30, intensity: 2")
    viewer, buffers = drawn(stage)
    empty = np.flatnonzero((buffers["A"] == 0) & (stage.owners > 0) & (buffers["R"] > 0))
    assert empty.size > 1000
    assert (np.isfinite(buffers["Z"])[empty]).mean() < 0.01
    way = directions(stage, viewer, empty) @ rotation_deg((0.0, 30, 0.0))
    found = np.stack([buffers[name][empty] for name in "RGB"], axis=1).astype(float)
    # A panorama's pixel is looked up over all that a display's sees; at poles that is a wide circle.
    off = np.abs(found - (way + 1))
    assert np.quantile(off, 0.99) < 0.01
    assert off.max() < 0.06


def test_what_is_not_lit_shows_no_sky(tmp_path):
    stage = staged(tmp_path, DISPLAYS["sphere"])
    _, buffers = drawn(stage)
    assert 0.1 < (buffers["R"][stage.owners > 0] > 0).mean() < 0.6


def test_samples_that_miss_see_the_sky(tmp_path):
    """Over an outline pixels are the share A of the body and the rest of the sky."""
    stage = staged(tmp_path, how="samples: 16")
    replaced(tmp_path, "scene.yaml", "{color: [0.8, 0.2, 0.1]}", "{color: [9, 9, 9], unlit: true}")
    viewer, buffers = drawn(set_stage(load_job(tmp_path / "job.yaml")))
    share = buffers["A"].astype(float)
    some = np.flatnonzero((share > 0) & (share < 1) & (stage.owners > 0))
    assert some.size > 50
    sky = (directions(stage, viewer, some) + 1) / 2
    found = np.stack([buffers[name][some] for name in "RGB"], axis=1).astype(float)
    np.testing.assert_allclose(found, 9 * share[some, None] + (1 - share[some, None]) * sky, atol=0.02)


def test_panes_let_the_sky_through(tmp_path):
    stage = staged(tmp_path)
    replaced(
        tmp_path, "scene.yaml", "{color: [0.8, 0.2, 0.1]}", "{color: [0, 0, 0], unlit: true, opacity: 0.5}"
    )
    viewer, buffers = drawn(set_stage(load_job(tmp_path / "job.yaml")))
    share = buffers["A"].astype(float)
    some = np.flatnonzero((share > 0) & (stage.owners > 0))
    sky = (directions(stage, viewer, some) + 1) / 2
    found = np.stack([buffers[name][some] for name in "RGB"], axis=1).astype(float)
    np.testing.assert_allclose(found, (1 - share[some, None]) * sky, atol=0.01)


@pytest.mark.skipif(not can_fork(), reason="no fork here")
def test_workers_draw_the_same_sky(tmp_path):
    stage = staged(tmp_path, how="samples: 4")
    _, alone = drawn(stage, 2)
    buffers = shared_buffers(stage)
    with Pool(stage, [buffers], 2) as pool:
        for frame in (1, 2):
            draw_moment(moment(stage, stage.views([frame])[0]), buffers, crew=pool)
        for name in alone:
            np.testing.assert_array_equal(buffers[name], alone[name])


def test_a_sky_without_visible_stays_dark(tmp_path):
    stage = staged(tmp_path)
    replaced(tmp_path, "scene.yaml", ", visible: true", "")
    stage = set_stage(load_job(tmp_path / "job.yaml"))
    _, buffers = drawn(stage)
    assert stage.scene.sky is None
    assert (buffers["R"][buffers["A"] == 0] == 0).all()


def test_one_sky_is_seen_and_no_colour_beside_it(tmp_path):
    staged(tmp_path)
    text = (tmp_path / "scene.yaml").read_text()
    line = next(line for line in text.splitlines() if "sky.exr" in line)
    (tmp_path / "scene.yaml").write_text(text + line + "\nbackground: [0, 0, 1]\n")
    with pytest.raises((JobError, SceneError)) as error:
        set_stage(load_job(tmp_path / "job.yaml"))
    words = str(error.value)
    assert "one sky at most" in words
    assert "background" in words


def test_angles_are_those_of_arctangents():
    dice = np.random.default_rng(1)
    x, y = dice.normal(size=(2, 10_000))
    x[:4], y[:4] = (0, 1, 0, -1), (1, 0, -1, 0)
    np.testing.assert_allclose(angle(y, x), np.arctan2(y, x), atol=2e-11)
    assert angle(np.zeros(1), np.zeros(1)) == 0
