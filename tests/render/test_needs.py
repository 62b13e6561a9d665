"""Pages that memory cannot hold are refused before anything is drawn, by `render` and `check` alike."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.errors import LayoutError
from quiltcli.images.names import quilt_path
from quiltcli.job import load_job
from quiltcli.layout import pixel_owners, read_layout
from quiltcli.render.memory import WORKER, Share, estimate, shared_out
from quiltcli.render.sequence import Listener, RenderOptions, render
from quiltcli.render.setup import set_stage
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
    # Owners of 2 bytes; one frame of R, G, B, A as half and Z as float.
    assert (
        "the quilt's page of 1,000,000,000,000 pixels in all would take 14,000 GB of memory" in result.output
    )
    assert files_in(tmp_path) == before


SHEET, OWNERS = 12_000_000, 2_000_000  # bytes of a million pixels


def million(tmp_path: Path, frames: str = "1-4", more: str = "") -> Path:
    path = write_tiny_job(tmp_path)
    replaced(
        tmp_path,
        "job.yaml",
        "frames: 1-4\n",
        f"layout: {{method: rows, size: [1000, 1000]}}\nframes: {frames}\n{more}",
    )
    return path


def test_one_frame_at_a_time_must_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = million(tmp_path)
    for free, code in ((SHEET + OWNERS, 0), (SHEET + OWNERS - 1, 1)):
        monkeypatch.setattr("quiltcli.render.needs.free_memory", lambda free=free: free)
        assert CliRunner().invoke(main, ["check", str(job)]).exit_code == code


def test_both_eyes_of_one_file_must_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = million(tmp_path, "1", "output: {stereo: parts}\n")
    replaced(tmp_path, "job.yaml", "  near: 0.05", "  near: 0.05\n  stereo: {separation: 0.06}")
    for free, code in ((2 * SHEET + OWNERS, 0), (2 * SHEET + OWNERS - 1, 1)):
        monkeypatch.setattr("quiltcli.render.needs.free_memory", lambda free=free: free)
        assert CliRunner().invoke(main, ["check", str(job)]).exit_code == code


@pytest.mark.parametrize(
    ("frames", "free", "expected"),
    [
        ("1-4", 2 * SHEET + 4 * WORKER, Share(4, 2)),
        ("1-4", 2 * SHEET + 4 * WORKER - 1, Share(4, 1)),
        ("1-4", SHEET + 4 * WORKER - 1, Share(3, 1)),
        ("1-4", SHEET + 2 * WORKER - 1, Share(1, 1)),
        ("1-4", 0, Share(1, 1)),
        ("1-4", None, Share(4, 2)),
        ("1", SHEET + 4 * WORKER, Share(4, 1)),
    ],
)
def test_memory_is_shared_out(
    frames: str, free: int | None, expected: Share, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = set_stage(load_job(million(tmp_path, frames)))
    monkeypatch.setattr("quiltcli.render.memory.free_memory", lambda: free)
    assert shared_out(stage.job, stage.layout, stage.views(stage.job.frames), 4) == expected


def test_less_memory_makes_the_same_images_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = load_job(million(tmp_path, "1-2"))
    said: list[str] = []
    render(job, RenderOptions(folder=tmp_path / "much", threads=2), Listener(say=said.append))
    assert said == []
    monkeypatch.setattr("quiltcli.render.memory.free_memory", lambda: SHEET + WORKER)
    render(job, RenderOptions(folder=tmp_path / "less", threads=2), Listener(say=said.append))
    words = "1 worker instead of 2, and no frame is drawn while another is written"
    assert [line.split(": ", 1)[1] for line in said] == [words]
    for frame in (1, 2):
        much, less = (quilt_path(tmp_path / name, 1, frame).read_bytes() for name in ("much", "less"))
        assert much == less


def test_what_a_job_takes_is_told(tmp_path: Path) -> None:
    job = million(tmp_path)
    memory, disk = estimate(load_job(job), set_stage(load_job(job)).layout, 4, 4, 2)
    assert memory == (90 << 20) + 2 * WORKER + 4 * 300 + 2 * SHEET + OWNERS
    assert disk == 4 * (1_000_000 + 2 * 64 * 64) * 12
    for command in (["check"], ["render", "--dry-run", "-j", "2"]):
        done = CliRunner().invoke(main, [*command, str(job)])
        assert done.exit_code == 0
        assert "of memory with" in done.output
        assert "for 4 views up to 48.4 MB of disk" in done.output


def test_owners_of_pages_larger_than_memory_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "layout.yaml"
    path.write_text(LAYOUT.replace("[64, 64]", "[1000000, 1000000]"))
    with pytest.raises(LayoutError, match=r"1,000,000,000,000 pixels, which take 2,000 GB of memory"):
        pixel_owners(read_layout(path))
