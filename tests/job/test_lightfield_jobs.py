"""Jobs that show a light field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import JobError
from quiltcli.formats.png import save_png
from quiltcli.job import dump_job, job_sha256, load_job
from quiltcli.job.schema import schema_of
from tests.helpers.ring_photos import field_text

DISPLAY = """\
quilt_display: 1
kind: lightfield360
image: [16, 16]
projector: {height: 0.6, diameter: 0.13}
mirror: {outline: {disk: 0.13}}
rotation: {positions: 24}
diffuser: {horizontal_deg: 15}
"""
ORBIT = "{center: [0, 0, 0], radius: 1, height: 1, end_deg: 9, end_frame: 2}"
JOB = """\
quilt_job: 1
display: display.yaml
lightfield: field.yaml
frames: 1
ring: {height: 0.2, distance: 1.0}
"""


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "display.yaml").write_text(DISPLAY)
    (tmp_path / "field.yaml").write_text(field_text(3, [0.2], size=8))
    (tmp_path / "h01").mkdir()
    for view in (1, 2, 3):
        save_png(tmp_path / f"h01/v{view:04}.png", np.full((8, 8, 3), 40 * view, np.uint8))
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


def test_a_light_field_stands_in_the_place_of_a_scene(job: Path) -> None:
    loaded = load_job(job)
    assert loaded.lightfield == loaded.scene == job.parent / "field.yaml"
    assert "lightfield: field.yaml" in dump_job(loaded, job.parent)
    job.write_text(JOB.replace("frames", "scene: field.yaml\nframes"))  # as it is written out
    assert load_job(job) == loaded


def test_every_picture_counts(job: Path) -> None:
    before = job_sha256(load_job(job))
    assert job_sha256(load_job(job)) == before
    save_png(job.parent / "h01/v0002.png", np.zeros((8, 8, 3), np.uint8))
    assert job_sha256(load_job(job)) != before


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("lightfield: field.yaml", "lightfield: no.yaml", "no such file"),
        ("lightfield: field.yaml\n", "", "scene: missing key"),
        ("frames", "scene: other.yaml\nframes", "lightfield: cannot stand beside scene"),
        (
            "ring: {height: 0.2, distance: 1.0}",
            f"viewer: {{near: 1, far: 2, path: {{orbit: {ORBIT}}}}}",
            "lightfield: belongs to a 360° light field display",
        ),
    ],
)
def test_what_does_not_go_together_is_told(job: Path, old: str, new: str, expected: str) -> None:
    (job.parent / "other.yaml").write_text("quilt_scene: 1\nobjects: []\n")
    job.write_text(JOB.replace(old, new))
    with pytest.raises(JobError) as caught:
        load_job(job)
    assert expected in str(caught.value)


@pytest.mark.parametrize("name", ["no.yaml", "[1]", "field.png", "3"])
def test_a_light_field_that_is_none_is_told_once(job: Path, name: str) -> None:
    job.write_text(JOB.replace("lightfield: field.yaml", f"lightfield: {name}"))
    with pytest.raises(JobError) as caught:
        load_job(job)
    (problem,) = caught.value.problems
    assert (problem.key, problem.line > 1) == ("lightfield", True)


def test_mistakes_of_the_light_field_are_those_of_the_job(job: Path) -> None:
    path = job.parent / "field.yaml"
    path.write_text(path.read_text().replace("views: 3", "views: 0"))
    with pytest.raises(JobError, match=r"field.yaml:\d+:\d+: views: must be at least 1"):
        load_job(job)


def test_editors_take_either() -> None:
    schema = schema_of("quilt_job")
    assert "scene" not in schema["required"]
    assert {"required": ["lightfield"]} in schema["anyOf"]
