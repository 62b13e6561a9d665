"""Turns that show a light field: what is captured of a scene is what a turn of the scene shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.ring.simulate import EyeOptions, look_at_display
from quiltcli.cli.group import main
from quiltcli.errors import JobError
from quiltcli.formats.bitplanes import read_packed, unpack
from quiltcli.halftone.light import luminance
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.ring.walk import RingOptions, render_turns
from quiltcli.ring.picture import draw_picture
from tests.helpers.ring_job import ring_job


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A job of a scene, and one of a light field that was captured of it."""
    job = ring_job(tmp_path_factory.mktemp("ring"), lobe=15)
    words = ["--views", "96", "--heights", "0.3:0.5:0.1", "--size", "96x96", "--format", "exr"]
    run = CliRunner().invoke(main, ["capture", str(job), "-o", str(job.parent / "field"), *words])
    assert run.exit_code == 0, run.output
    shown = job.with_name("shown.yaml")
    shown.write_text(job.read_text().replace("scene: scene.yaml", "lightfield: field/lightfield.yaml"))
    return job, shown


def test_what_is_captured_is_rebinned_to_what_the_scene_shows(jobs: tuple[Path, Path]) -> None:
    scene, field = (set_ring_stage(load_job(path)) for path in jobs)
    for position in (0, 7, 17):
        angle = scene.rig.angle(position)
        exact, found = (draw_picture(stage.show(1), angle) for stage in (scene, field))
        np.testing.assert_array_equal(exact.lit, found.lit)
        off = (exact.rgb().astype(float) - found.rgb())[exact.lit]
        assert -10 * np.log10(np.mean(off**2)) >= 24
        other = draw_picture(field.show(1), angle + 0.5)
        worse = (exact.rgb().astype(float) - other.rgb())[exact.lit]
        assert np.mean(worse**2) > 4 * np.mean(off**2)


def test_a_turn_of_a_light_field_is_written_with_the_same_bytes_by_any_workers(
    jobs: tuple[Path, Path], tmp_path: Path
) -> None:
    job = load_job(jobs[1])
    for workers in (1, 2):
        render_turns(job, RingOptions(folder=tmp_path / str(workers), workers=workers))
    one, two = ((tmp_path / str(n) / "packed" / "dvi.00000001.png").read_bytes() for n in (1, 2))
    assert one == two
    assert load_job(tmp_path / "1" / "job.yaml").lightfield == job.lightfield


def test_missing_views_stop_a_turn_before_it_begins(jobs: tuple[Path, Path], tmp_path: Path) -> None:
    gone = jobs[1].parent / "field" / "h02" / "v0005.exr"
    kept = gone.read_bytes()
    gone.unlink()
    try:
        with pytest.raises(JobError, match=r"v0005.exr: no such picture"):
            render_turns(load_job(jobs[1]), RingOptions(folder=tmp_path / "out", workers=1))
    finally:
        gone.write_bytes(kept)
    assert not (tmp_path / "out" / "packed").exists()


def test_several_samples_are_not_for_photographs(jobs: tuple[Path, Path]) -> None:
    with pytest.raises(JobError, match=r"render\.samples: expected 1 beside lightfield"):
        load_job(jobs[1], ["render.samples=4"])


def test_an_eye_sees_the_photographs_and_they_are_what_it_is_held_against(jobs: tuple[Path, Path]) -> None:
    options = EyeOptions(eye=(40.0, 0.4, 1.0), size=(96, 72), tones=True)
    found, scene = (look_at_display(load_job(path), 1, options) for path in jobs[::-1])
    assert found.direct.max() > 0.1
    assert -10 * np.log10(np.mean((found.direct - scene.direct) ** 2)) > 24
    assert found.comparison is not None
    assert found.comparison.psnr > 24


def test_photographs_may_be_bits_before_they_are_rearranged(jobs: tuple[Path, Path], tmp_path: Path) -> None:
    job = load_job(jobs[1], ["halftone={before: true}", f"output.directory={tmp_path}"])
    stage, late = set_ring_stage(job), set_ring_stage(load_job(jobs[1]))
    angle = stage.rig.angle(5)
    copied, blended = (draw_picture(one.show(1), angle) for one in (stage, late))
    assert set(np.unique(copied.rgb()).tolist()) == {0.0, 1.0}
    mean = luminance(blended.rgb())[blended.lit].mean()
    assert copied.rgb()[copied.lit][:, 0].mean() == pytest.approx(float(mean), abs=0.02)
    render_turns(job, RingOptions(workers=1))
    bits = unpack(read_packed(tmp_path / "packed" / "dvi.00000001.png")[None])[5]
    assert np.array_equal(bits, (copied.rgb()[..., 0] > 0.5) & copied.lit)


def test_only_photographs_are_bits_before(jobs: tuple[Path, Path]) -> None:
    with pytest.raises(JobError, match=r"halftone\.before: is for photographs"):
        load_job(jobs[0], ["halftone={before: true}"])
