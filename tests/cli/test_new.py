"""`quilt new` on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import new as command
from quiltcli.cli.group import main


def test_the_kinds_are_listed() -> None:
    result = CliRunner().invoke(main, ["new", "--list"])
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.output.splitlines()][:3] == ["corner", "wall", "curve"]


def test_missing_figures_are_listed_where_nobody_can_be_asked(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["new", "corner", "-o", str(tmp_path / "c")])
    assert result.exit_code == 2
    assert "corner needs to be told more:\n  --left: left wall" in result.output
    assert "--pitch: pitch such as 6mm" in result.output


def test_missing_figures_are_asked_for_on_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "_somebody_to_ask", lambda: True)
    answers = "2x1m\n8\n3m\n250x250mm/8x8px\n"
    result = CliRunner().invoke(main, ["new", "curve", "-o", str(tmp_path / "c")], input=answers)
    assert result.exit_code == 0, result.output
    assert "columns: how many flat columns" in result.output
    assert (tmp_path / "c" / "job.yaml").is_file()


def test_a_kind_and_a_folder_are_needed() -> None:
    assert "expected a KIND (quilt new --list" in CliRunner().invoke(main, ["new"]).output
    assert "expected -o FOLDER" in CliRunner().invoke(main, ["new", "wall"]).output


def test_a_mistyped_kind_is_said_before_anything_is_asked() -> None:
    result = CliRunner().invoke(main, ["new", "wal", "-o", "x"])
    assert result.exit_code == 2
    assert "expected one of corner, wall" in result.output


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["cave", "--size", "3x3x3m", "--radius", "5m", "--no-treads"],
         "--radius, --no-treads: means nothing to a cave (which takes --size, --base, --ceiling)"),
        (["wall", "--size", "3x2m", "--ceiling"],
         "--ceiling: means nothing to a wall (which takes --size, --base)"),
        (["wall", "--size", "3x2m", "--padding", "2"],
         "--padding is between panels on a canvas (expected --canvas 2112x1024, too)"),
    ],
)  # fmt: skip
def test_what_means_nothing_to_a_kind_is_told(words: list[str], expected: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["new", *words, "--pitch", "10mm", "-o", str(tmp_path / "n")])
    assert result.exit_code == 2
    assert expected in result.output
    assert not (tmp_path / "n").exists()
