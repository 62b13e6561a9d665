"""What is said of frames that would show nothing, by every command that could have warned."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import main

DISPLAY = """\
quilt_display: 1
panels:
- {name: front, pixels: [30, 30], size: [3 m, 3 m], at: [0, 1.5, -1.5]}
- {name: left, pixels: [30, 30], size: [3 m, 3 m], at: [-1.5, 1.5, 0], yaw_deg: 90}
- {name: right, pixels: [30, 30], size: [3 m, 3 m], at: [1.5, 1.5, 0], yaw_deg: -90}
"""
JOB = """\
quilt_job: 1
display: display.yaml
scene: ball.obj
frames: 1-4
viewer: {near: 0.05, far: FAR, path: {keyframes: [{frame: 1, position: EYE, look_at: [0, 1.6, -9]}]}}
render: {bleed: 0}
"""
BALL = "v 0 1 -2\nv 1 1 -2\nv 0 2 -2\nv 0 1 -3\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"
LIGHTS = "the scene has no lights: a headlight at the viewer and a dim ambient light are used"


def job(folder: Path, eye: str = "[0, 1.6, 0]", far: float = 30, ball: str = BALL) -> Path:
    (folder / "display.yaml").write_text(DISPLAY)
    (folder / "ball.obj").write_text(ball)
    (folder / "job.yaml").write_text(JOB.replace("EYE", eye).replace("FAR", str(far)))
    return folder / "job.yaml"


def said(folder: Path, *words: str) -> list[str]:
    """The notes of a command, without what every one of these jobs gives rise to."""
    result = CliRunner().invoke(main, [*words])
    assert result.exit_code == 0, result.output
    lines = [line.removeprefix("note: ") for line in result.stderr.splitlines()]
    others = (LIGHTS, "nothing is wrong", ": takes about ")
    return [line for line in lines if not any(words in line for words in others)]


FAULTS = {
    "in millimetres": (
        {"eye": "[0, 1600, 0]"},
        "in frames 1-4 the eye is up to 1597 m from the display, which is 5.196 m large:"
        " are the positions of the path metres (units: mm reads a file of millimetres)?",
    ),
    "behind the wall": (
        {"eye": "[0, 1.6, -2]"},
        "in frames 1-4 the eye is behind facet 1 (front), which stays dark: is the viewer in the right place?",
    ),
    "out of range": (
        {"far": 0.5},
        "in frame 1 the scene lies 2.04 to 3.059 m away from the eye, but near is 0.05 m and far 0.5 m:"
        " nothing of it will be drawn",
    ),
    "beside the display": (
        {"ball": BALL.replace("-2", "8").replace("-3", "9")},
        "in frame 1 no triangle of the scene shows on any lit facet: seen from the eye, it lies beside them all"
        " (the scene is from [0, 1, 8] to [1, 2, 9] m, the display from [-1.5, 0, -1.5] to [1.5, 3, 1.5] m,"
        " the eye at [0, 1.6, 0] m)",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_check_says_why_nothing_will_be_seen(fault: str, tmp_path: Path) -> None:
    changes, expected = FAULTS[fault]
    assert said(tmp_path, "check", str(job(tmp_path, **changes))) == [expected]


def test_a_display_with_its_back_to_the_eye(tmp_path: Path) -> None:
    path = job(tmp_path, eye="[0, 1.6, -2]")
    (tmp_path / "display.yaml").write_text("\n".join(DISPLAY.splitlines()[:3]) + "\n")
    assert said(tmp_path, "check", str(path)) == [
        "in frames 1-4 the eye is behind every facet: nothing is lit, nothing will be drawn (viewing_side of the"
        " display says which side that is, the path where the eye is)"
    ]


def test_a_good_job_gives_no_such_note(tmp_path: Path) -> None:
    assert said(tmp_path, "check", str(job(tmp_path))) == []


def test_the_other_commands_say_it_too(tmp_path: Path) -> None:
    changes, expected = FAULTS["out of range"]
    path = str(job(tmp_path, **changes))
    assert expected in said(tmp_path, "render", path, "--dry-run")
    picture = str(tmp_path / "eye.png")
    assert expected in said(tmp_path, "simulate", path, "-f", "1", "-o", picture, "--size", "40x30")
    result = CliRunner().invoke(main, ["verify", path, "-f", "1"])
    assert result.stdout.rstrip().endswith("within tolerance, but no pixel shows the scene")


def test_figures_of_nothing_are_no_figures(tmp_path: Path) -> None:
    path = job(tmp_path, eye="[0, 1.6, -2]")
    (tmp_path / "display.yaml").write_text("\n".join(DISPLAY.splitlines()[:3]) + "\n")
    words = ["simulate", str(path), "-f", "1", "-o", str(tmp_path / "eye.png"), "--size", "40x30"]
    result = CliRunner().invoke(main, words)
    assert "view on lit facets      none: there is nothing to compare" in result.stdout
    assert "PSNR" not in result.stdout
