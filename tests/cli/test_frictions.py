"""What stood in the way of new users: hints that help, and the same words from all commands."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from quiltcli.cli import main
from quiltcli.errors import MissingExtraError, missing_extra
from quiltcli.formats import video
from quiltcli.formats.exr.image import write_exr
from tests.helpers.tiny_job import replaced, write_tiny_job


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = write_tiny_job(tmp_path)
    replaced(tmp_path, "job.yaml", "frames: 1-4\n", "layout: {method: rows, padding: 1}\nframes: 1-4\n")
    return path


def quilt(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


def picture(path: Path) -> None:
    write_exr(path, {name: np.zeros((2, 3), np.float16) for name in "RGB"}, {})


def test_the_hint_for_a_package_that_is_missing_can_be_followed() -> None:
    found = str(missing_extra("a film", "PyAV", "video"))
    assert found == (
        "a film needs PyAV, which is not installed (in the folder of quilt's sources: pip install -e '.[video]')"
    )


def test_films_give_that_hint(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(MissingExtraError, match=r"pip install -e '\.\[video\]'"):
        video.load_av()


def test_check_and_simulate_say_what_render_says(job: Path, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(
        "quilt_scene: 1\nobjects:\n- {mesh: ball.obj, material: {color: [180, 80, 25]}}\n"
    )
    said = [
        "objects[0].material.color [180, 80, 25] reflects more light than falls on it"
        " (divide 8-bit values by 255 and make them linear)",
        "the scene has no lights: a headlight at the viewer and a dim ambient light are used",
        "the bleed of 2 pixels is wider than the layout's padding of 1: neighbours share what lies between them (set layout.padding to 2, or set render.bleed to 1)",
    ]
    for command in (
        ("check", "job.yaml"),
        ("render", "job.yaml", "--dry-run"),
        ("simulate", "job.yaml", "-o", "p.png", "--size", "32x24"),
    ):
        result = quilt(*command)
        assert result.exit_code == 0, result.output
        assert all(sentence in result.stderr for sentence in said), (command, result.stderr)


def test_frames_that_the_job_does_not_have_are_told(job: Path) -> None:
    result = quilt("render", "job.yaml", "-f", "60", "--dry-run")
    assert result.exit_code == 0
    assert "frame 60 is not among the job's frames 1-4" in result.stderr
    assert "not among" not in quilt("render", "job.yaml", "-f", "2", "--dry-run").stderr


@pytest.mark.parametrize("name", ["-f", "--frame", "--frames"])
def test_frames_are_asked_for_alike(job: Path, name: str) -> None:
    assert quilt("render", "job.yaml", name, "1", "-j", "1").exit_code == 0
    assert quilt("verify", "job.yaml", name, "1", "--pixels", "50", "-j", "1").exit_code == 0
    assert quilt("contact", "out", name, "1", "-o", "sheet.png").exit_code == 0


def test_a_preview_never_makes_a_folder_of_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    picture(tmp_path / "page_01.0001.exr")
    result = quilt("preview", "page_01.0001.exr", "-o", "a.jpg")
    assert (result.exit_code, result.stderr) == (
        2,
        "error: a.jpg: has the suffix '.jpg', expected .png, .tif, .tiff or a folder\n",
    )
    assert not Path("a.jpg").exists()


def test_previews_of_a_sequence_are_named_by_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for frame in (1, 12):
        picture(tmp_path / f"page_01.{frame:04d}.exr")
    assert quilt("preview", "page_01.####.exr", "-o", "p.####.png").exit_code == 0
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["p.0001.png", "p.0012.png"]


def test_info_tells_of_an_output_folder(job: Path) -> None:
    quilt("render", "job.yaml", "-f", "2-3", "-j", "1")
    result = quilt("info", "out")
    assert result.exit_code == 0, result.output
    assert "frames    2-3 (2)" in result.stdout
    assert "images    2 pages, 4 facet images" in result.stdout
    empty = quilt("info", ".")
    assert empty.stderr.endswith(
        "is a directory without a render in it (expected a file, or one with job.yaml and report.json)\n"
    )


def test_files_of_other_programs_say_what_to_do(job: Path, tmp_path: Path) -> None:
    (tmp_path / "car.fbx").write_bytes(b"Kaydara FBX Binary\xe8")
    for command in ("info", "check"):
        result = quilt(command, "car.fbx")
        assert "car.fbx: is a .fbx file, which is not read (export as GLB)" in result.output


@pytest.mark.parametrize("name", ["pipe.yaml", "pipe.obj", "pipe.exr", "pipe.csv"])
def test_a_pipe_is_no_file(job: Path, name: str) -> None:
    import os

    os.mkfifo(name)
    command = ("import", name, "-o", "l.yaml") if name.endswith("csv") else ("info", name)
    result = quilt(*command)
    assert result.exit_code == 2
    assert "is a pipe" in result.stderr


def test_what_is_imported_fits_the_display_it_names(job: Path, tmp_path: Path) -> None:
    quilt("pack", "display.yaml", "--method", "rows", "-o", "layout.yaml")
    quilt("export", "layout.yaml", "-o", "map.json")
    text = Path("map.json").read_text()
    assert quilt("import", "map.json", "-o", "l.yaml").exit_code == 0
    assert quilt("check", "l.yaml").exit_code == 0
    Path("map.json").write_text(text.replace('"origin": [-1', '"origin": [-3'))
    assert text != Path("map.json").read_text()
    assert "from where display.yaml has it" in quilt("import", "map.json", "-o", "l2.yaml").stderr
    assert not Path("l2.yaml").exists()
    Path("map.json").write_text(text.replace("display.yaml", "gone.yaml"))
    result = quilt("import", "map.json", "-o", "l3.yaml")
    assert "the display gone.yaml that the map names is not there" in result.stderr
    assert quilt("check", "l3.yaml").exit_code == 0
