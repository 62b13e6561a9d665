"""What those who play the images ask: each rule has a job that breaks it and one that does not."""

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from tests.helpers.tiny_job import replaced, write_tiny_job

ONE_FOLDER = "facet: '{eye}/{name}/{name}.{frame:04}.exr'"


def check(job, *words):
    """Code, and what is said beside what the job takes."""
    done = CliRunner().invoke(main, ["check", str(job), *words])
    lines = [line for line in done.output.splitlines(keepends=True) if ": takes about " not in line]
    return done.exit_code, "".join(lines)


@pytest.fixture
def job(tmp_path):
    path = write_tiny_job(tmp_path, "144, 72")
    path.write_text(path.read_text() + f"output:\n  names: {{{ONE_FOLDER}}}\n")
    return path


@pytest.mark.parametrize("target", ["disguise", "7thsense", "resolume", "hap"])
def test_a_job_that_pleases_everybody(job, target):
    assert check(job, "--for", target) == (0, "1 file: nothing is wrong\n")


CASES = [
    ("hap", "job.yaml", "[144, 72]", "[144, 71]", r"page 1 is 144×71 pixels, expected width and height"),
    ("resolume", "job.yaml", "[144, 72]", "[143, 72]", "page 1 is 143×72 pixels, expected width and height"),
    ("7thsense", "job.yaml", "[144, 72]", "[143, 72]", "page 1 is 143×72 pixels, expected a width"),
    ("disguise", "job.yaml", "[144, 72]", "[16400, 72]", "page 1 is 16400×72 pixels, more than 16384 a side"),
    ("disguise", "job.yaml", "{name}.{frame", "{name}_v2.{frame", "holds '_v', which disguise takes for"),
    ("disguise", "walls.obj", "g right", "g right_proxy", "the facet's name 'right_proxy' holds '_proxy'"),
    ("7thsense", "job.yaml", "{frame:04}", "{frame:03}", "frame numbers have 3 digits (expected 4 to 12"),
    ("7thsense", "job.yaml", "frames: 1-4", "frames: -2-4", "frame -2 is negative"),
    (
        "7thsense",
        "job.yaml",
        "frames: 1-4",
        "frames: 9998-10001",
        "grow from 4 to 5 digits within the sequence",
    ),
    ("7thsense", "job.yaml", "/{name}/", "/all/", "several sequences share a folder"),
    ("resolume", "job.yaml", "output:\n", "output:\n  stereo: parts\n", "both eyes are parts of one file"),
]


@pytest.mark.parametrize(("target", "file", "old", "new", "words"), CASES)
def test_what_would_not_play(job, tmp_path, target, file, old, new, words):
    if "parts" in new:
        replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    replaced(tmp_path, file, old, new)
    code, said = check(job, "--for", target)
    assert code == 1
    assert words in said
    assert check(job)[0] == 0


def test_strict_fails_on_notes(job, tmp_path):
    assert check(job, "--strict")[0] == 0
    replaced(tmp_path, "job.yaml", "[144, 72]", "[16400, 72]")
    code, said = check(job)
    assert code == 0
    assert "note: page 1 is 16400×72 pixels: many cards and players take 16384" in said
    code, said = check(job, "--strict")
    assert code == 1
    assert "1 note, which --strict does not allow" in said
    done = CliRunner().invoke(main, ["render", str(job), "--strict", "--dry-run"])
    assert done.exit_code == 2
    assert "16400×72" in done.output


def test_numbers_that_grow_are_told(job, tmp_path):
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 9999-10001")
    assert "frame numbers in names grow from 4 digits to 5" in check(job)[1]
    replaced(tmp_path, "job.yaml", "frames: 9999-10001", "frames: 10000-10001")
    assert "grow" not in check(job)[1]
