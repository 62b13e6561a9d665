from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.path.error import picture_error
from quiltcli.analysis.path.plot import draw_path
from quiltcli.analysis.path.study import study_path
from quiltcli.analysis.sweetspot.picture import svg_text
from quiltcli.cli import main
from quiltcli.viewer.viewer import Viewer
from tests.helpers.in_memory import cube, panel
from tests.helpers.tiny_job import replaced, write_tiny_job

SCENES = Path(__file__).parents[2] / "scenes"


def eye_at(*place: float) -> Viewer:
    look = -np.asarray(place) / np.linalg.norm(place)
    return Viewer(1, np.asarray(place, dtype=float), look, np.array([0.0, 1, 0]), 0.1, 10.0, "planar")


def test_far_things_move_with_the_eye_on_a_screen_faced_squarely() -> None:
    error = picture_error(panel(density=1000), [eye_at(0, 0, 2)], 0.002)
    assert error is not None
    # 2 mm each across and down, a pixel being a millimetre; what is along the line of sight moves nothing.
    assert error.pixels == pytest.approx(2 * np.sqrt(2))
    assert (error.facet, error.frame) == (1, 1)


def test_the_error_is_that_of_eyes_thrown_by_dice() -> None:
    facets, sigma = cube(density=500), 1e-5
    viewer = eye_at(3.0, 1.7, 2.2)
    error = picture_error(facets, [viewer], sigma)
    assert error is not None
    dice = np.random.default_rng(5).standard_normal((4000, 3)) * sigma
    squares = []
    for f in range(facets.count):
        corners = facets.corners[facets.corner_start[f] : facets.corner_start[f + 1]]
        normal, middle = facets.normal[f], corners.mean(axis=0)
        if normal @ (viewer.eye - middle) <= 0:
            continue
        far = viewer.eye + 1e9 * (middle - viewer.eye)
        eyes = viewer.eye + dice
        way = far - eyes
        hits = eyes + way * (((middle - eyes) @ normal) / (way @ normal))[:, None]
        squares.append(((500 * (hits - middle)) ** 2).sum(axis=1).mean())
    assert error.pixels == pytest.approx(np.sqrt(np.mean(squares)), rel=0.05)
    assert error.worst == pytest.approx(np.sqrt(np.max(squares)), rel=0.05)


def test_the_take_of_the_demonstration_is_what_it_was_made_as() -> None:
    found = study_path(SCENES / "demo_cave.yaml")
    cleaned = found.head.cleaned
    assert (cleaned.lost, len(cleaned.spikes), len(cleaned.gaps)) == (9, 1, 0)
    assert cleaned.noise == pytest.approx(0.0008, rel=0.15)
    assert np.degrees(cleaned.turn_noise or 0) == pytest.approx(0.2, rel=0.15)
    # Somebody walks around (0, 0.35) in the CAVE, 1.66 m over its floor.
    times, places = found.head.runs[0].times, found.head.runs[0].positions
    way = 2 * np.pi * times / 5
    truth = np.stack(
        (0.45 * np.sin(way), 1.66 + 0.015 * np.sin(2.2 * np.pi * times), 0.35 + 0.3 * np.cos(way))
    )
    assert np.sqrt(np.mean((places - truth.T) ** 2)) < 0.0004


def test_pictures_show_gaps_and_the_display() -> None:
    text = svg_text(draw_path(study_path(SCENES / "demo_cave.yaml")))
    assert "from above" in text
    assert text.count("#3a2a30") == 8  # two gaps in four charts
    assert "display" in text


def test_the_command_says_what_a_take_is(tmp_path: Path) -> None:
    picture = tmp_path / "p.png"
    shown = CliRunner().invoke(main, ["path", str(SCENES / "visitor.csv"), "-o", str(picture)])
    assert shown.exit_code == 0
    assert "samples    600 at 120 a second, seconds 0.000 to 4.992" in shown.output
    assert picture.stat().st_size > 10_000
    data = CliRunner().invoke(main, ["path", str(SCENES / "demo_cave.yaml"), "--json"])
    found = json.loads(data.output)
    assert found["lost"] == 9
    assert found["picture_error"]["pixels"] == pytest.approx(0.6, rel=0.1)


def test_what_a_take_does_not_say_is_said_by_settings(tmp_path: Path) -> None:
    file = tmp_path / "take.csv"
    file.write_text("time,x,y,z\n" + "".join(f"{k / 100},{k},0,1700\n" for k in range(300)))
    wrong = CliRunner().invoke(main, ["path", str(file)])
    assert wrong.exit_code == 2
    assert "units: " in wrong.output
    right = CliRunner().invoke(main, ["path", str(file), "--set", "units=mm", "--set", "up_axis=z"])
    assert right.exit_code == 0
    assert "box        [0, 1.7, 0] to [0.299, 1.7, 0] m" in right.output
    typo = CliRunner().invoke(main, ["path", str(file), "--set", "unit=mm"])
    assert (typo.exit_code, "did you mean 'units'?" in typo.output) == (2, True)


def test_long_gaps_are_listed(tmp_path: Path) -> None:
    file = tmp_path / "take.csv"
    rows = [f"{k / 100},0,0,0\n" for k in range(300) if not 100 <= k < 180]
    file.write_text("time,x,y,z\n" + "".join(rows))
    said = CliRunner().invoke(main, ["path", str(file), "--set", "units=m", "--set", "up_axis=y"])
    assert said.output.splitlines()[-1].split() == ["0.990", "1.800", "0.810", "gap"]


def test_a_path_that_nobody_recorded_is_shown_frame_by_frame(tmp_path: Path) -> None:
    said = CliRunner().invoke(main, ["path", str(write_tiny_job(tmp_path)), "-o", str(tmp_path / "p.svg")])
    assert "samples    4 at 30 a second" in said.output
    assert (tmp_path / "p.svg").is_file()


def test_a_recorded_job_checks_and_tells_the_frames_it_lacks(tmp_path: Path) -> None:
    file = write_tiny_job(tmp_path)
    (tmp_path / "t.csv").write_text(
        "time,x,y,z\n" + "".join(f"{k / 100},0,0,{2 + k / 100}\n" for k in range(9))
    )
    keys = (tmp_path / "job.yaml").read_text().partition("    keyframes:\n")[2]
    replaced(
        tmp_path, "job.yaml", "    keyframes:\n" + keys, "    recorded: {file: t.csv, units: m, up_axis: y}\n"
    )
    said = CliRunner().invoke(main, ["check", str(file)])
    assert said.exit_code == 1
    assert said.output.count("t.csv holds seconds 0.000 to 0.080, frames 1 to 3.4") == 1
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-3")
    assert CliRunner().invoke(main, ["check", str(file)]).exit_code == 0
