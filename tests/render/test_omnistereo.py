"""Panoramas with an eye for each column: distances by closed form, and what they ask of a job."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.verify import VerifyOptions, verify
from quiltcli.errors import JobError, QuiltError
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_view
from quiltcli.render.setup import set_stage
from tests.helpers.curved_jobs import boxes, curved_job, projection_of

HALF = np.array([2.0, 1.5, 3.0])
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * HALF
FACES = np.array([[1, 5, 7, 3], [0, 2, 6, 4], [4, 6, 7, 5], [0, 1, 3, 2], [2, 3, 7, 6], [0, 4, 5, 1]])
STEREO = "  stereo: {separation: 0.4}\noutput: {channels: [rgba, Z, triangle]}\n"
HEAD = np.array([0.3, 0.1, -0.2])


def room_job(folder: Path, more: str = "", at=(0.3, 0.1, -5), tail: str = STEREO):
    display = f"projection: {{kind: equirect, omnistereo: true, pixels: [96, 48]{more}}}"
    return curved_job(folder, display, (CORNERS, FACES), HEAD, at, tail)


def eyes_and_rays(merge=(60.0, 75.0), turn=0.0):
    """Offsets of the right eye over half the separation, and directions, (3, 48, 96), written down anew."""
    a = 2 * np.pi * ((np.arange(96) + 0.5) / 96 - 0.5) + np.zeros((48, 1)) + turn
    b = np.pi * (0.5 - (np.arange(48)[:, None] + 0.5) / 48) + np.zeros(96)
    share = np.clip((np.degrees(np.abs(b)) - merge[0]) / (merge[1] - merge[0]), 0, 1)
    apart = 1 - share**2 * (3 - 2 * share)
    eye = apart * np.stack((np.cos(a), 0 * a, np.sin(a)))
    return eye, np.stack((np.cos(b) * np.sin(a), np.sin(b), -np.cos(b) * np.cos(a)))


@pytest.mark.parametrize(
    ("more", "at", "turn"),
    [
        ("", (0.3, 0.1, -5), 0.0),
        (", heading_deg: 30", (0.3, 0.1, -5), -np.pi / 6),
        (", follows: view", (5.3, 0.1, -0.2), np.pi / 2),
    ],
)
def test_each_pixel_sees_the_room_from_its_own_eye(more: str, at, turn: float, tmp_path: Path) -> None:
    stage = set_stage(room_job(tmp_path, more, at))
    eye, ray = eyes_and_rays(turn=turn)
    found = []
    for view, side in zip(stage.views([1]), (-0.2, 0.2), strict=True):
        buffers = new_buffers(stage)
        draw_view(stage, view, buffers)
        place = HEAD[:, None, None] + side * eye
        walls = np.where(ray > 0, HALF[:, None, None] - place, HALF[:, None, None] + place) / np.abs(ray)
        z = buffers["Z"].reshape(48, 96)
        assert np.abs(z / walls.min(axis=0) - 1).max() < 1e-6
        found.append(z)
    # There is something between the eyes, and nothing at the poles.
    away = np.abs(found[0] - found[1])
    assert away[24].max() > 0.05
    assert away[:3].max() == 0


def test_without_a_merge_eyes_are_apart_up_to_the_poles(tmp_path: Path) -> None:
    chart = projection_of("kind: equirect, omnistereo: true, pole_merge_deg: [90, 90]", tmp_path, (96, 48))
    _, ray = eyes_and_rays()
    beside = chart.omni.beside(ray)
    assert np.abs((beside**2).sum(axis=0) - 1).max() < 1e-12
    assert np.abs((beside * ray).sum(axis=0)).max() < 1e-12  # at right angles to the ray
    assert not chart.omni.beside(np.array([[0.0], [1.0], [0.0]])).any()


def test_rays_verify_both_eyes(tmp_path: Path) -> None:
    display = "projection: {kind: equirect, omnistereo: true, pixels: [128, 64]}"
    job = curved_job(tmp_path, display, boxes(40, 0.6, 2.5), HEAD, (0.3, 0.1, -5), STEREO)
    found = list(verify(job, VerifyOptions(everything=True, redraw=True)))
    assert [one.verdict.eye for one in found] == ["left", "right"]
    for one in found:
        assert one.verdict.passed, one.verdict.faults
        assert one.verdict.inside["covered"] > 2000


def test_rays_from_elsewhere_are_found_out(tmp_path: Path) -> None:
    display = "projection: {kind: equirect, omnistereo: true, pixels: [128, 64]}"
    job = curved_job(tmp_path, display, boxes(40, 0.6, 2.5), HEAD, (0.3, 0.1, -5), STEREO)
    (left, right) = (one for one in verify(job, VerifyOptions(everything=True, redraw=True)))
    from quiltcli.analysis.verify.frame import verify_images

    viewer = left.stage.views([1])[0].viewer
    assert not verify_images(left.stage, viewer, right.images, VerifyOptions(everything=True)).passed


@pytest.mark.parametrize(
    ("tail", "words"),
    [
        ("output: {channels: [rgba]}\n", "the job has one eye (expected stereo)"),
        (STEREO + "render: {shutter: 0.5, samples: 4}\n", "shutter: expected 0 with omnistereo"),
        (STEREO + "render: {method: cubemap}\n", "method: expected homography or raycast with omnistereo"),
        (STEREO + "render: {backface_culling: true}\n", "backface_culling: expected false with omnistereo"),
    ],
)
def test_what_omnistereo_does_not_have_is_said(tail: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(JobError) as error:
        set_stage(room_job(tmp_path, tail=tail))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("pole_merge_deg: [60, 75]", "belongs to omnistereo: true"),
        ("omnistereo: true, pole_merge_deg: [80, 60]", "expected the lower latitude first"),
        ("omnistereo: true, pole_merge_deg: [80, 95]", "pole_merge_deg"),
    ],
)
def test_keys_that_make_no_sense_are_said(keys: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(QuiltError) as error:
        projection_of(f"kind: equirect, {keys}", tmp_path)
    assert words in str(error.value)


def test_samples_are_means_of_rays_from_eyes_of_their_own(tmp_path: Path) -> None:
    tail = STEREO + "render: {samples: 16}\n"
    stage = set_stage(room_job(tmp_path, tail=tail))
    buffers = new_buffers(stage)
    draw_view(stage, stage.views([1])[1], buffers)
    one = set_stage(room_job(tmp_path))
    sharp = new_buffers(one)
    draw_view(one, one.views([1])[1], sharp)
    # Depth is the centre's; light is that of one sample but at edges, and there is light everywhere.
    assert (buffers["Z"] == sharp["Z"]).all()
    assert (buffers["A"] == 1).all()
    away = np.abs(buffers["R"].astype(np.float64) - sharp["R"])
    assert np.median(away) < 1e-3
    assert away.max() > 0.01
