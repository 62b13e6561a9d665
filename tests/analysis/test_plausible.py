"""Every note on what cannot be meant: a job that raises it, and one that must not."""

import re

import pytest

from quiltcli.analysis.check import check_files
from tests.helpers.tiny_job import replaced, write_tiny_job

CASES = {
    "pitch": ("display.yaml", "pixels_per_metre: 32", "pixels_per_metre: 4", "the pixel pitch is 250"),
    "units": ("display.yaml", "mesh: walls.obj", "mesh: walls.obj\nunits: 1000", "display is 2000 m large"),
    "winding": ("walls.obj", "f 2 5 6 3", "f 3 6 5 2", "1 .* and 2 .* disagree on"),
    "large page": ("job.yaml", "[144, 72]", "[144, 16400]", r"page 1 is 144×16400 pixels"),
    "numbers": ("job.yaml", "frames: 1-4", "frames: 9998-10002", "grow from 4 digits to 5"),
    "bleed": ("job.yaml", "viewer:", "render: {bleed: 9}\nviewer:", r"the bleed of 9 pixels is wider"),
}


def notes(job):
    said = []
    assert check_files([job], said.append) == []
    return "\n".join(said)


@pytest.fixture
def job(tmp_path):
    return write_tiny_job(tmp_path, "144, 72")


def test_a_good_job_has_no_notes(job):
    assert notes(job) == ""


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_meant_is_noted(job, tmp_path, case):
    file, old, new, words = CASES[case]
    replaced(tmp_path, file, old, new)
    if case == "units":  # a larger world is not seen from there, which is said as well
        replaced(tmp_path, "display.yaml", "pixels_per_metre: 32", "facet_pixels: [64, 64]")
    assert re.search(words, notes(job))


def test_facets_that_are_always_dark_are_named_once(job, tmp_path):
    for corner in ("position: [0, 0, 2]", "position: [-0.5, 0.2, 3]"):
        replaced(tmp_path, "job.yaml", corner, "position: [2, 0, 3]")
    assert "the eye is behind facet 2 (right), which stays dark" in notes(job)
    replaced(tmp_path, "job.yaml", "{frame: 4, position: [2, 0, 3]", "{frame: 4, position: [0, 0, 3]")
    assert "faces away" not in notes(job)
