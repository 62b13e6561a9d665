"""Pages that memory cannot hold are refused before anything is drawn, by `render` and `check` alike."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import LayoutError
from quiltcli.layout import pixel_owners, read_layout
from tests.helpers.good_files import LAYOUT
from tests.helpers.tiny_job import files_in, replaced, write_tiny_job

HUGE = "layout: {method: rows, size: [1000000, 1000000]}\nframes: 1-4\n"


@pytest.mark.parametrize(
    "command", [["check", "job.yaml"], ["render", "job.yaml"], ["render", "--dry-run", "job.yaml"]]
)
def test_pages_larger_than_memory_are_refused(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_tiny_job(tmp_path)
    monkeypatch.chdir(tmp_path)
    replaced(tmp_path, "job.yaml", "frames: 1-4\n", HUGE)
    before = files_in(tmp_path)
    result = CliRunner().invoke(main, command)
    assert result.exit_code == (1 if command[0] == "check" else 2)
    # Owners of 2 bytes; two frames of R, G, B, A as half and Z as float.
    assert (
        "the quilt's page of 1,000,000,000,000 pixels in all would take 26,000 GB of memory" in result.output
    )
    assert files_in(tmp_path) == before


def test_two_frames_take_more_than_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_tiny_job(tmp_path)
    monkeypatch.chdir(tmp_path)
    replaced(
        tmp_path, "job.yaml", "frames: 1-4\n", "layout: {method: rows, size: [1000, 1000]}\nframes: 1-4\n"
    )
    monkeypatch.setattr("quiltcli.render.needs.free_memory", lambda: 14_000_000)
    assert CliRunner().invoke(main, ["check", "job.yaml"]).exit_code == 1
    replaced(tmp_path, "job.yaml", "frames: 1-4\n", "frames: 1\n")
    assert CliRunner().invoke(main, ["check", "job.yaml"]).exit_code == 0


def test_owners_of_pages_larger_than_memory_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "layout.yaml"
    path.write_text(LAYOUT.replace("[64, 64]", "[1000000, 1000000]"))
    with pytest.raises(LayoutError, match=r"1,000,000,000,000 pixels, which take 2,000 GB of memory"):
        pixel_owners(read_layout(path))
