"""Files of a 360° light field display: what they say, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest

from quiltcli.errors import JobError
from quiltcli.job import load_display_file, load_job
from quiltcli.job.check import check_file
from quiltcli.job.load import load_any_display, load_mirror_file

DISPLAY = """\
quilt_display: 1
kind: lightfield360
projector: {height: 0.6, diameter: 0.13}
mirror: {outline: {disk: 0.13}}
"""
JOB = """\
quilt_job: 1
display: turn.yaml
scene: scene.yaml
frames: 1-2
ring: {height: 0.4, distance: 1.0}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "turn.yaml").write_text(DISPLAY)
    (tmp_path / "scene.yaml").write_text("quilt_scene: 1\nobjects:\n- {mesh: one.obj}\n")
    (tmp_path / "one.obj").write_text("v 0 0 0\nv .01 0 0\nv 0 .01 0\nf 1 2 3\n")
    (tmp_path / "job.yaml").write_text(JOB)
    return tmp_path


def test_defaults_are_the_papers(folder: Path) -> None:
    display, job = load_mirror_file(folder / "turn.yaml"), load_job(folder / "job.yaml")
    assert (display.image, display.rotation.positions, display.mirror.tilt_deg) == ((768, 768), 288, 45)
    assert display.timing.rpm == 1000
    assert job.ring is not None
    assert (job.ring.near, job.ring.farthest, job.layout) == (0.01, 2.0, None)
    assert load_any_display(folder / "turn.yaml") == display
    assert check_file(folder / "job.yaml") == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kind: lightfield360", "kind: volumetric", "turn.yaml:2:7: kind: expected lightfield360, got"),
        ("{height: 0.6, diameter: 0.13}", "{height: 0.6}", "projector.diameter: missing key (what the"),
        (
            "{height: 0.6, diameter: 0.13}",
            "{}",
            "projector: expected height, matrix or calibration, got none",
        ),
        (
            "{height: 0.6, diameter: 0.13}",
            "{matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 1]]}",
            "projector.matrix: is no camera's",
        ),
        (
            "{height: 0.6, diameter: 0.13}",
            "{matrix: [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, -0.6]]}",
            "projector.matrix: puts the projector 0.6 m below the mirror's middle",
        ),
        (
            "{height: 0.6, diameter: 0.13}",
            "{matrix: [[1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, -0.6]]}",
            "projector.matrix: has the mirror behind the projector",
        ),
        ("{disk: 0.13}", "{disk: 0.13, rectangle: [1, 1]}", "mirror.outline.rectangle: cannot stand beside"),
        ("mirror:", "image: [9000, 768]\nmirror:", "image: expected at most 8192 a side, got 9000 × 768"),
        ("{disk: 0.13}", "{disk: 1.5}", "mirror.outline: reaches 0.75 m, as far as the projector is high"),
        ("outline", "tilt_deg: 80, outline", "mirror.tilt_deg: must be at most 70, got 80"),
        ("mirror:", "packing: {rpm: 900}\nmirror:", "packing.rpm: does not fit: 24 × 200 pictures a second"),
        ("mirror:", "resolution: {}\nmirror:", "resolution: unknown key (known: quilt_display, kind, image"),
        (
            "mirror:",
            "sides: [{azimuth_deg: 0}, {azimuth_deg: 90}]\nmirror:",
            "sides[1].azimuth_deg: must be 180 from the first side's, got 90",
        ),
    ],
)
def test_a_wrong_display_is_told_what_is_wrong(folder: Path, old: str, new: str, words: str) -> None:
    (folder / "turn.yaml").write_text(DISPLAY.replace(old, new))
    with pytest.raises(JobError) as error:
        load_mirror_file(folder / "turn.yaml")
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("height: 0.4", "height: -1.5", "ring.height: is below the mirror's plane at 1 m: nothing is seen"),
        ("1.0}", "1.0, near: 3}", "ring.far: must be greater than near (3), got 2"),
        (
            "1.0}",
            "1.0, users: [{azimuth_deg: 0, height: -2, distance: 1}]}",
            "ring.users[0].height: is below the mirror's plane",
        ),
        ("frames", "render: {method: offaxis}\nframes", "render.method: expected exact, raycast or vertex"),
        ("frames", "layout: {size: [99, 99]}\nframes", "layout: belongs to a display of facets"),
        ("frames", "render: {tessellate: 1}\nframes", "render.tessellate: belongs to method: vertex"),
        ("frames", "output: {packed: false}\nframes", "output: nothing to write (expected packed or tones"),
        ("frames", "output: {channels: [Z]}\nframes", "output.channels: expected rgba among them"),
        (
            "ring: {height: 0.4, distance: 1.0}",
            "viewer: {near: 1, far: 2, path: {keyframes: [{frame: 1, position: [1, 1, 1]}]}}",
            "viewer: ",
        ),
        ("frames", "viewers: {a: {}}\nframes", "viewers"),
    ],
)
def test_a_wrong_job_is_told_what_is_wrong(folder: Path, old: str, new: str, words: str) -> None:
    (folder / "job.yaml").write_text(JOB.replace(old, new))
    with pytest.raises(JobError) as error:
        load_job(folder / "job.yaml")
    assert words in str(error.value)


def test_rings_and_facets_do_not_go_together(folder: Path) -> None:
    with pytest.raises(JobError, match="kind: is lightfield360, a display without facets"):
        load_display_file(folder / "turn.yaml")
    (folder / "turn.yaml").write_text("quilt_display: 1\nmesh: one.obj\nresolution: {pixels_per_metre: 9}\n")
    with pytest.raises(JobError, match="ring: belongs to lightfield360"):
        load_job(folder / "job.yaml")
    with pytest.raises(JobError, match="is a display of facets"):
        load_mirror_file(folder / "turn.yaml")
    facets = JOB.replace("ring: {height: 0.4, distance: 1.0}", "halftone: {method: bayer}")
    (folder / "job.yaml").write_text(facets)
    with pytest.raises(JobError, match="halftone: belongs to a 360° light field display"):
        load_job(folder / "job.yaml")
