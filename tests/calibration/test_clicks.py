"""`quilt calibrate`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from quiltcli.cli.group import main
from quiltcli.job import check_file, dump_yaml
from quiltcli.job.calibration import CalibrationFile
from quiltcli.job.reference import EXAMPLES
from tests.display.test_clicks import clicks, projector


def written(path: Path, file: CalibrationFile, **changes: object) -> Path:
    points = [
        {"mirror_deg": click.mirror_deg, "at": list(click.at or ()), "pixel": list(click.pixel)}
        for click in file.points
    ]
    data = {"quilt_calibration": 1, "image": [768, 768], "points": points, **changes}
    path.write_text(dump_yaml(data))
    return path


def quilt(*words: object) -> Result:
    return CliRunner().invoke(main, ["calibrate", *map(str, words)])


def test_the_projector_stands_in_a_display_file(tmp_path: Path) -> None:
    path, display = written(tmp_path / "clicks.yaml", clicks(projector())), tmp_path / "display.yaml"
    run = quilt(path, "-o", display)
    assert run.exit_code == 0, run.output
    assert "3545.00 px" in run.output
    data = yaml.safe_load(display.read_text())
    assert (data["kind"], data["image"]) == ("lightfield360", [768, 768])
    assert check_file(display) == []
    np.testing.assert_allclose(data["projector"]["matrix"], projector().matrix, atol=1e-8)


def test_a_display_that_exists_keeps_what_else_it_says(tmp_path: Path) -> None:
    path, display = written(tmp_path / "clicks.yaml", clicks(projector())), tmp_path / "display.yaml"
    display.write_text(
        "quilt_display: 1\nkind: lightfield360\nrotation: {positions: 96}\nprojector: {height: 1}\n"
    )
    run = quilt(path, "-o", display)
    assert run.exit_code == 2
    assert "exists already" in run.output
    assert quilt(path, "-o", display, "--overwrite").exit_code == 0
    data = yaml.safe_load(display.read_text())
    assert data["rotation"] == {"positions": 96}
    assert list(data["projector"]) == ["matrix"]
    display.write_text("quilt_display: 1\nmesh: box.obj\n")
    run = quilt(path, "-o", display, "--overwrite")
    assert run.exit_code == 2
    assert "is no display of the kind lightfield360" in run.output


def test_a_point_that_was_clicked_wrong_is_named_and_no_display_is_written(tmp_path: Path) -> None:
    path = written(tmp_path / "clicks.yaml", clicks(projector(), 0.2))
    data = yaml.safe_load(path.read_text())
    data["points"][4]["pixel"][0] += 40
    path.write_text(dump_yaml(data))
    run = quilt(path, "-o", tmp_path / "display.yaml")
    assert run.exit_code == 1
    assert "worst: point 5" in run.output
    assert run.output.split("off by px\n")[1].lstrip().startswith("5")
    assert not (tmp_path / "display.yaml").exists()
    assert quilt(path, "-o", tmp_path / "display.yaml", "--tolerance", 30).exit_code == 0


def test_everything_is_there_for_programs(tmp_path: Path) -> None:
    run = quilt(written(tmp_path / "clicks.yaml", clicks(projector(), 0.5)), "--json")
    data = json.loads(run.output)
    assert data["position_deviation"][1] > 1e-3
    assert len(data["errors"]) == 8
    np.testing.assert_allclose(data["position"], projector().position, atol=0.02)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, []),
        ({"points": 5}, ["points: expected at least 6 points, got 5"]),
        ({"free": ["f", "rotation"]}, ["free: position is always found"]),
        ({"free": ["rotation", "position"]}, ["f: missing key (a focal length that is not free"]),
        ({"f": 3000.0}, ["f: is given, but free to change"]),
        ({"free": ["focus"]}, ["free[0]: expected f, centre, rotation or position"]),
        ({"image": [400, 768]}, ["pixel: lies outside the image of 400 × 768 pixels"]),
        ({"tilt_deg": 90}, ["tilt_deg: must be less than 90, got 90"]),
    ],
)
def test_every_mistake_is_told_with_its_key(
    tmp_path: Path, changes: dict[str, object], expected: list[str]
) -> None:
    file = clicks(projector())
    if "points" in changes:
        file = file.model_copy(update={"points": file.points[:5]})
        changes = {}
    path = written(tmp_path / "clicks.yaml", file, **changes)
    text = "\n".join(map(str, check_file(path)))
    assert all(words in text for words in expected), text
    assert bool(text) == bool(expected)


def test_a_point_has_one_place(tmp_path: Path) -> None:
    path = tmp_path / "clicks.yaml"
    lines = ["- {world: [0, 0, 0], at: [0, 0], pixel: [1, 1]}", "- {at: [0, 0], pixel: [1, 1]}"]
    path.write_text("quilt_calibration: 1\nimage: [9, 9]\npoints:\n" + "\n".join(lines) + "\n")
    text = "\n".join(map(str, check_file(path)))
    assert "points[0].at: cannot stand beside world" in text
    assert "points[1].mirror_deg: missing key" in text


def test_the_example_of_the_reference_is_a_good_calibration(tmp_path: Path) -> None:
    (tmp_path / "clicks.yaml").write_text(EXAMPLES["calibration"])
    run = quilt(tmp_path / "clicks.yaml", "--json")
    assert run.exit_code == 0, run.output
    data = json.loads(run.output)
    assert not data["mirrored"]
    np.testing.assert_allclose(data["position"], [0, 0.6, 0], atol=0.02)
