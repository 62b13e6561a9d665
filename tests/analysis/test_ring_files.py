"""What check, info and contact say of displays with a spinning mirror, their jobs and outputs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from quiltcli.cli.group import main
from tests.helpers.ring_job import ring_job


def quilt(*words: object) -> Result:
    return CliRunner().invoke(main, list(map(str, words)))


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A job that was rendered in part."""
    path = ring_job(tmp_path_factory.mktemp("ring"), positions=48, lobe=7.5, frames="3-4", tones=True)
    assert quilt("render", path, "-f", "3", "--positions", "1-48x12").exit_code == 0
    return path


def test_info_of_the_papers_display_says_the_papers_figures(tmp_path: Path) -> None:
    display = ring_job(tmp_path, size=768, positions=288).with_name("turn.yaml")
    data = json.loads(quilt("info", display, "--json").output)
    assert data["slices"]["0.56"] == pytest.approx(20.6, abs=0.05)
    assert data["slices"]["3"] == pytest.approx(11.9, abs=0.05)
    assert data["slices"]["far"] == pytest.approx(10.0, abs=0.05)
    assert data["mirror_image"] == pytest.approx([-0.6, 0, 0])
    assert data["pixels_per_mm"] == pytest.approx(5.9, abs=0.01)
    assert data["timing"] == {
        "refresh": 200,
        "images_per_second": 4800,
        "turns_per_second": 50 / 3,
        "rpm": 1000,
    }
    text = quilt("info", display).output
    assert "20.6 pictures at 0.56 m" in text
    assert "1000 rpm" in text


def test_info_of_a_job_and_of_its_output(job: Path) -> None:
    data = json.loads(quilt("info", job, "--json").output)
    assert (data["positions"], data["packed"]) == (96, 4)
    data = json.loads(quilt("info", job.with_name("out"), "--json").output)
    assert (data["kind"], data["frames"], data["packed"], data["tones"]) == ("lightfield360", [3], 2, 4)
    assert "turns     3 (1)" in quilt("info", job.with_name("out")).output


def test_check_finds_nothing_wrong_and_says_what_is_worth_a_word(job: Path, tmp_path: Path) -> None:
    run = quilt("check", job)
    assert run.exit_code == 0, run.output
    gaps = ring_job(tmp_path, positions=30)
    run = quilt("check", gaps, gaps.with_name("turn.yaml"))
    assert run.exit_code == 0
    assert "cover 37.5° of 360°" in run.output
    assert "a turn begins within a picture" in run.output
    assert "pixels off" not in run.output
    for how, told in (("plane", True), ("cone", False)):
        ring_job(tmp_path, size=768, positions=288, more="", lobe=f"1.25, reflection: {how}")
        assert ("drawn 0.55 pixels off" in quilt("check", tmp_path / "job.yaml").output) == told
    data = json.loads(quilt("info", job, "--json").output)
    assert data["plane_error"] == pytest.approx(0.55 * 48 / 768, rel=0.05)
    (entry,) = json.loads((job.with_name("out") / "report.json").read_text())["frames"]
    assert entry["plane_error"][0]["pixels"] == data["plane_error"]


@pytest.mark.parametrize(
    ("file", "old", "new", "expected"),
    [
        ("job.yaml", "distance: 1.0", "distance: 0.02", "viewers stand at 0.02 m"),
        ("job.yaml", "height: 0.4", "height: -1.5", "ring.height: is below the mirror's plane"),
        ("turn.yaml", "# lobe", "packing: {rpm: 900}", "does not fit"),
        (
            "turn.yaml",
            "{height: 0.6, diameter: 0.13}",
            "{calibration: clicks.yaml}",
            "at least 6 points, got 1",
        ),
    ],
)
def test_check_says_what_cannot_be(tmp_path: Path, file: str, old: str, new: str, expected: str) -> None:
    job = ring_job(tmp_path, positions=288, more="# lobe")
    points = "[{world: [0, 0, 0], pixel: [1, 1]}]"
    (tmp_path / "clicks.yaml").write_text(f"quilt_calibration: 1\nimage: [48, 48]\npoints: {points}\n")
    path = tmp_path / file
    path.write_text(path.read_text().replace(old, new))
    run = quilt("check", job)
    assert run.exit_code == 1
    assert expected in run.output


def test_a_contact_sheet_shows_the_positions_that_were_drawn(job: Path, tmp_path: Path) -> None:
    run = quilt("contact", job.with_name("out"), "-o", tmp_path / "sheet.png")
    assert run.exit_code == 0, run.output
    assert "4 images" in run.output
    run = quilt("contact", job.with_name("out"), "-o", tmp_path / "sheet.png", "-f", "4")
    assert run.exit_code == 2
    assert "has no turn of frame 4" in run.output


@pytest.mark.parametrize("words", [["compare"], ["path"]])
def test_commands_for_facets_say_that_there_are_none(job: Path, words: list[str]) -> None:
    run = quilt(*words, job)
    assert run.exit_code == 2
    assert "ring: is for a 360° light field display" in run.output
