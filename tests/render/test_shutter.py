"""Motion blur: what an open shutter sees of scene and viewer, held against pictures of single moments."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.errors import JobError
from quiltcli.formats.exr.image import read_exr
from quiltcli.job import load_job
from quiltcli.render.antialiasing import sample_places, sample_times
from quiltcli.render.buffers import new_buffers
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.sequence import RenderOptions, render
from quiltcli.render.setup import set_stage
from tests.helpers.tiny_job import replaced, write_tiny_job

PLATE = "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nf 1 2 3 4\n"
EYE = "    - {frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}"
TINY = f"{EYE}\n    - {{frame: 4, position: [-0.5, 0.2, 3], look_at: [0, 0, 0]}}"
SLIDE = "transform: {keyframes: [{frame: 1}, {frame: 2, translate: [0.25, 0, 0]}]}, material: {unlit: true}"


def plate_job(tmp_path, how, scene=SLIDE, path=EYE, channels="rgba, Z"):
    """A plate in the plane of facet 1, 32 pixels wide, that slides 8 pixels a frame."""
    job = write_tiny_job(tmp_path, "160, 80")
    (tmp_path / "ball.obj").write_text(PLATE)
    replaced(
        tmp_path, "scene.yaml", "mesh: ball.obj", f"mesh: ball.obj, {scene}" if scene else "mesh: ball.obj"
    )
    replaced(tmp_path, "scene.yaml", ", material: {color: [0.8, 0.2, 0.1]}", "")
    text = f"frames: 1-4\nrender: {{{how}}}\noutput: {{channels: [{channels}]}}"
    replaced(tmp_path, "job.yaml", "frames: 1-4", text)
    replaced(tmp_path, "job.yaml", TINY, path)
    return job


def drawn(stage, frame=1):
    buffers = new_buffers(stage)
    draw_moment(moment(stage, stage.views([frame])[0]), buffers)
    return buffers


@pytest.mark.parametrize(("samples", "most"), [(1, 16), (4, 16), (16, 16), (64, 16), (12, 5), (7, 3)])
def test_samples_look_at_times_all_over_the_exposure(samples, most):
    times = sample_times(samples, most)
    assert len(times) == min(samples, most)
    np.testing.assert_allclose([time for time, _ in times], (np.arange(len(times)) + 0.5) / len(times))
    places = [place for _, group in times for place in group]
    assert sorted(places) == sorted(sample_places(samples))
    counts = [len(group) for _, group in times]
    assert max(counts) - min(counts) <= 1


@pytest.mark.parametrize("shutter", [1.0, 0.5])
def test_a_sliding_plate_leaves_a_ramp(tmp_path, shutter):
    stage = set_stage(load_job(plate_job(tmp_path, f"samples: 64, shutter: {shutter}, motion_samples: 64")))
    buffers = drawn(stage)
    width = stage.layout.pages[0][0]
    low = stage.layout.quilt_from_facet[0, :, 2].astype(int)
    # Facet 1 is 64 pixels wide from x = -1; its row in the middle, from left to right.
    row = buffers["A"].reshape(-1, width)[low[1] + 32, low[0] : low[0] + 64].astype(float)
    x = np.arange(64) + 0.5
    way = 8 * shutter

    def covered(at):
        """Share of the exposure, over a pixel, in which an edge that begins at 0 has not yet come by."""
        fine = (np.arange(32) + 0.5) / 32 - 0.5
        return np.clip((at[:, None] + fine) / way, 0, 1).mean(axis=1)

    # The plate's left edge leaves, its right edge comes.
    expected = np.clip(1 - covered(x - 48), 0, 1) - np.clip(1 - covered(x - 16), 0, 1)
    np.testing.assert_allclose(row, expected, atol=0.03)


def test_data_is_that_of_the_moment_at_which_the_shutter_opens(tmp_path):
    blurred = drawn(set_stage(load_job(plate_job(tmp_path, "samples: 4, shutter: 1"))))
    (tmp_path / "still").mkdir()
    still = drawn(set_stage(load_job(plate_job(tmp_path / "still", "samples: 1"))))
    np.testing.assert_array_equal(blurred["Z"], still["Z"])
    assert (blurred["A"] != still["A"]).any()


def test_a_viewer_who_moves_blurs_what_rests(tmp_path):
    path = f"{EYE}\n    - {{frame: 2, position: [1.6, 0, 2], look_at: [1.6, 0, 0]}}"
    scene = "transform: {translate: [0, 0, -1]}, material: {unlit: true}"
    buffers = drawn(set_stage(load_job(plate_job(tmp_path, "samples: 16, shutter: 1", scene, path))))
    edges = np.count_nonzero((buffers["A"] > 0.1) & (buffers["A"] < 0.9))
    (tmp_path / "still").mkdir()
    other = drawn(set_stage(load_job(plate_job(tmp_path / "still", "samples: 16", scene, path))))
    assert edges > 4 * np.count_nonzero((other["A"] > 0.1) & (other["A"] < 0.9)) > 0


def test_what_rests_is_as_sharp_as_without_a_shutter(tmp_path):
    how = "material: {unlit: true}"
    open_ = drawn(set_stage(load_job(plate_job(tmp_path, "samples: 8, shutter: 1", how))))
    (tmp_path / "still").mkdir()
    shut = drawn(set_stage(load_job(plate_job(tmp_path / "still", "samples: 8", how))))
    for name in open_:
        np.testing.assert_allclose(open_[name], shut[name], rtol=2**-10, atol=2**-12, err_msg=name)


def test_frames_one_after_another_leave_nothing_behind_whoever_draws_them(tmp_path):
    """Runs of one and of two processes, and each frame alone: the same bytes; a background under all."""
    job = plate_job(tmp_path, "samples: 6, shutter: 0.7", channels="rgba, Z, cryptoobject")
    (tmp_path / "scene.yaml").write_text(
        (tmp_path / "scene.yaml").read_text() + "background: [0.1, 0.2, 0.3]\n"
    )
    found = []
    for threads, frames in ((1, [1, 2, 3]), (2, [1, 2, 3]), (1, [2])):
        out = tmp_path / f"out{len(found)}"
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("quiltcli.render.sequence.worth_forking", lambda _: True)
            render(load_job(job), RenderOptions(frames=frames, folder=out, threads=threads))
        found.append({f: (out / f"quilt/page_01.000{f}.exr").read_bytes() for f in frames})
    assert found[0] == found[1]
    assert found[0][2] == found[2][2]
    image = read_exr(tmp_path / "out0/quilt/page_01.0001.exr").channels
    total = sum(image[f"CryptoObject0{k}.{c}"].astype(float) for k in range(3) for c in "GA")
    np.testing.assert_allclose(total, image["A"], atol=2**-11)


@pytest.mark.parametrize("method", ["raycast", "twopass"])
def test_methods_of_one_moment_have_no_shutter(tmp_path, method):
    with pytest.raises(JobError, match=f"render.shutter: expected 0 beside method: {method}, got 0.5"):
        load_job(plate_job(tmp_path, f"method: {method}, shutter: 0.5"))
