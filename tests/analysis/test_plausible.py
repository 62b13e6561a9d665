"""Every note on what cannot be meant: a job that raises it, and one that is as near as may be and must not.

The table is the list of notes: `NOTES` by files, the tests below where more has to be said.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.check import check_files
from quiltcli.cli import main
from quiltcli.job import load_job
from quiltcli.render import needs
from quiltcli.render.setup import set_stage
from tests.helpers.tiny_job import replaced, write_tiny_job

_RASTER, _FIXED = "pixels_per_metre: 32", "facet_pixels: [64, 64]"
_FIRST, _LAST = "position: [0, 0, 2]", "position: [-0.5, 0.2, 3]"
NOTES = {
    # name: (file, what is there, what raises the note, what is all right, the note)
    "pitch too coarse": (
        "display.yaml", _RASTER, "pixels_per_metre: 9.9", "pixels_per_metre: 10",
        "the pixel pitch is 101 mm, outside 0.1 to 100 mm"),
    "pitch too fine": (
        "display.yaml", f"{_RASTER}}}", f"{_FIXED}}}\nunits: 0.0031", f"{_FIXED}}}\nunits: 0.0033",
        r"the pixel pitch is 0\.0969 mm"),
    "a display in another unit": (
        "display.yaml", f"{_RASTER}}}", f"{_FIXED}}}\nunits: 101", f"{_FIXED}}}\nunits: 99",
        r"the display is 202 m large: is its mesh in another unit \(units: cm\?\)"),
    "neighbours wound apart": (
        "walls.obj", "f 2 5 6 3", "f 3 6 5 2", "f 5 6 3 2", r"1 \(back\) and 2 \(right\) disagree on"),
    "a page of a side too long": (
        "job.yaml", "[144, 72]", "[144, 16385]", "[144, 16384]", "page 1 is 144×16385 pixels"),
    "numbers that grow": (
        "job.yaml", "frames: 1-4", "frames: 9998-10002", "frames: 9996-9999",
        "grow from 4 digits to 5"),
    "a bleed beyond the padding": (
        "job.yaml", "viewer:", "render: {bleed: 9}\nviewer:", "render: {bleed: 1}\nviewer:",
        "the bleed of 9 pixels is wider"),
    "an eye far away": (
        "job.yaml", _LAST, "position: [0, 0, 120]", "position: [0, 0, 30]",
        r"in frame 4 the eye is up to 118 m from the display, which is 3\.464 m large"),
    "an eye behind a wall": (
        "job.yaml", _LAST, "position: [1.01, 0, 2]", "position: [0.99, 0, 2]",
        r"in frame 4 the eye is behind facet 2 \(right\), which stays dark"),
    "an eye behind all": (
        "job.yaml", _LAST, "position: [1.01, 0, -0.01]", "position: [0.99, 0, 0.01]",
        "in frame 4 the eye is behind every facet: nothing is lit"),
    "an eye in a plane": (
        "job.yaml", _LAST, "position: [1, 0, 3]", "position: [0.999, 0, 3]",
        r"at frame 4 the eye lies in the plane of facet 2 \(right\): dark there"),
    "a scene out of range": (
        "job.yaml", "far: 50", "far: 1", "far: 4",
        r"the scene lies 2\.2 to 3\.08\d* m away .* far 1 m: nothing of it will be drawn"),
    "a scene beside the display": (
        "scene.yaml", "mesh: ball.obj", "mesh: ball.obj, transform: {translate: [0, 9, 0]}",
        "mesh: ball.obj, transform: {translate: [0, 1, 0]}",
        "no triangle of the scene shows on any lit facet"),
}  # fmt: skip

# What else is to be said of a job that is nearly as bad.
NEARLY = {
    "pitch too fine": "m from the display, which is 0.01143 m large",
    "a display in another unit": "the pixel pitch is 3.09e+03",
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


@pytest.mark.parametrize("name", NOTES)
def test_what_cannot_be_meant_is_noted(job, tmp_path, name):
    file, old, raising, _, words = NOTES[name]
    replaced(tmp_path, file, old, raising)
    assert re.search(words, notes(job))


@pytest.mark.parametrize("name", NOTES)
def test_what_is_nearly_that_is_not_noted(job, tmp_path, name):
    file, old, _, fine, _ = NOTES[name]
    replaced(tmp_path, file, old, fine)
    said = notes(job)
    assert NEARLY.get(name, "") in said
    assert said.count("\n") == 0
    assert said == "" or name in NEARLY


def test_facets_that_are_always_dark_are_named_once(job, tmp_path):
    for corner in (_FIRST, _LAST):
        replaced(tmp_path, "job.yaml", corner, "position: [2, 0, 3]")
    assert "the eye is behind facet 2 (right), which stays dark" in notes(job)
    replaced(tmp_path, "job.yaml", "{frame: 4, position: [2, 0, 3]", "{frame: 4, position: [0, 0, 3]")
    assert "faces away" not in notes(job)


def test_more_than_a_gigapixel_is_noted(job):
    stage = set_stage(load_job(job))
    large = [
        replace(stage.layout, pages=np.array([[16000, side]] * 4, dtype=np.int32)) for side in (15625, 15626)
    ]
    assert list(needs.page_warnings(large[0])) == []
    (words,) = needs.page_warnings(large[1])
    assert words.startswith("the pages hold 1,000,064,000 pixels in all, more than a gigapixel")


def test_images_beyond_the_disk_are_noted(job, monkeypatch):
    """A page and two facets, half floats of four channels and depth in floats."""
    needed = 4 * (144 * 72 + 2 * 64 * 64) * 12
    monkeypatch.setattr(needs, "free_disk", lambda path: needed)
    assert notes(job) == ""
    monkeypatch.setattr(needs, "free_disk", lambda path: needed - 1)
    assert re.search(
        r"the images of 4 views hold 0\.89\d MB before compression, and 0\.89\d MB are", notes(job)
    )


@pytest.mark.parametrize("command", ["check", "render"])
def test_strict_fails_on_a_note_and_on_nothing_else(job, tmp_path, command):
    words = [command, str(job), "--strict", *(["--dry-run"] if command == "render" else [])]
    assert CliRunner().invoke(main, words).exit_code == 0
    replaced(tmp_path, "display.yaml", _RASTER, "pixels_per_metre: 9")
    done = CliRunner().invoke(main, words)
    assert done.exit_code == (1 if command == "check" else 2)
    assert "the pixel pitch is" in done.output
    assert "--strict does not allow" in done.output
    words.remove("--strict")
    assert CliRunner().invoke(main, words).exit_code == 0


def test_a_new_job_is_looked_at(tmp_path):
    words = ["new", "wall", "--size", "3x2m", "--frames", "1-2", "-o"]
    fine = CliRunner().invoke(main, [*words, str(tmp_path / "a"), "--pitch", "10mm"])
    assert (fine.exit_code, "note:" in fine.output) == (0, False), fine.output
    odd = CliRunner().invoke(main, [*words, str(tmp_path / "b"), "--pitch", "200mm"])
    assert odd.exit_code == 0
    assert "note: the pixel pitch is 200 mm" in odd.output
