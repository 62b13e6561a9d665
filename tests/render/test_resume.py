"""What a resumed run keeps, what it draws again, and what it clears away."""

from __future__ import annotations

import errno
import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from quiltcli.cli import main
from quiltcli.errors import CheckFailedError, OutputError
from quiltcli.formats.temporary import new_file_beside
from quiltcli.job import load_job
from quiltcli.render import report, sequence
from quiltcli.render.resume import unfinished
from quiltcli.render.sequence import Listener, RenderOptions, prepare, render
from tests.helpers.tiny_job import IMAGES, replaced, write_tiny_job

FACETS = "facets/facet_0001.0002.exr"


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A job whose four frames are rendered."""
    job = write_tiny_job(tmp_path, "144, 72")
    render(load_job(job), RenderOptions(threads=1))
    return job


def resumed(job: Path, *sets: str, **options: object) -> list[int]:
    """Resume a job; the frames that were drawn again."""
    records = render(load_job(job, sets), RenderOptions(resume=True, threads=1, **options))  # type: ignore[arg-type]
    return [record.frame for record in records]


def entries(job: Path) -> list[dict[str, object]]:
    frames = json.loads((job.parent / "out/report.json").read_text())["frames"]
    assert isinstance(frames, list)
    return frames


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in IMAGES}


# --- what is kept ---


def test_nothing_is_drawn_again_when_all_is_well(tiny: Path) -> None:
    assert resumed(tiny) == []


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:-1],
        lambda data: data + b"\0",
        lambda data: data[: len(data) // 2] + bytes(40) + data[len(data) // 2 + 40 :],
        lambda data: data[: len(data) // 2] + b"\xff" * 40 + data[len(data) // 2 + 40 :],
        lambda data: data.replace(b"planar", b"plan\xe9r"),
        lambda data: data.replace(b"quilt:digest", b"quilt:digesu"),
        lambda data: b"",
        lambda data: bytes(len(data)),
    ],
    ids=["short", "long", "zeros", "ones", "not UTF-8", "no digest", "empty", "all zeros"],
)
def test_a_damaged_image_is_drawn_again(tiny: Path, damage) -> None:  # type: ignore[no-untyped-def]
    good = bytes_of(tiny.parent / "out")
    (tiny.parent / "out" / FACETS).write_bytes(damage(good[FACETS]))
    assert resumed(tiny) == [2]
    assert bytes_of(tiny.parent / "out") == good


@pytest.mark.parametrize("compression", ["zip", "none"])
@pytest.mark.parametrize("flips", [20, pytest.param(1000, marks=pytest.mark.long)])
def test_a_wrong_byte_anywhere_is_found(tiny: Path, compression: str, flips: int) -> None:
    job = load_job(tiny, [f"output.compression={compression}"])
    options = RenderOptions(overwrite=True, threads=1)
    render(job, options)
    ready, dice = prepare(job, options), random.Random(flips)
    assert unfinished(ready.stage, ready.out, ready.views) == []
    for _ in range(flips):
        path = tiny.parent / "out" / dice.choice(IMAGES)
        good = path.read_bytes()
        place, bit = dice.randrange(len(good)), 1 << dice.randrange(8)
        path.write_bytes(good[:place] + bytes([good[place] ^ bit]) + good[place + 1 :])
        frame = int(path.name.split(".")[-2])
        found = [view.frame for view in unfinished(ready.stage, ready.out, ready.views)]
        assert found == [frame], f"{path.name}, byte {place}"
        path.write_bytes(good)


def test_facets_are_not_merged_into_a_damaged_quilt(tiny: Path) -> None:
    sets = ["output.compression=none"]
    render(load_job(tiny, sets), RenderOptions(overwrite=True, threads=1))
    page = tiny.parent / "out/quilt/page_01.0003.exr"
    data = bytearray(page.read_bytes())
    data[-100] ^= 1  # a pixel, not compressed: any value is one
    page.write_bytes(data)
    with pytest.raises(OutputError) as caught:
        render(load_job(tiny, sets), RenderOptions(facets=(1,), threads=1))
    assert str(caught.value) == (
        f"{page}: is damaged, or another program has changed it (render the whole frame again)"
    )


# --- records ---


def test_a_frame_whose_record_was_lost_has_it_again(tiny: Path) -> None:
    path = tiny.parent / "out/report.json"
    before, text = entries(tiny), json.loads(path.read_text())
    del text["frames"][2]
    path.write_text(json.dumps(text))
    assert resumed(tiny) == [3]
    times = ("seconds", "wall_seconds", "write_seconds")
    for old, new in zip(before, entries(tiny), strict=True):
        assert all(old[name] == new[name] for name in old if name not in times)


def test_a_run_killed_before_the_record_is_resumed_to_a_whole_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = write_tiny_job(tmp_path, "144, 72")

    def killed(*given: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(sequence, "write_report", killed)
        with pytest.raises(KeyboardInterrupt):
            render(load_job(job), RenderOptions(frames=[1], threads=1))
    assert (tmp_path / "out/quilt/page_01.0001.exr").exists()
    assert resumed(job) == [1, 2, 3, 4]
    assert [entry["frame"] for entry in entries(job)] == [1, 2, 3, 4]


def test_everything_is_on_the_disk_before_a_frame_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, flushed, out = write_tiny_job(tmp_path, "144, 72"), set(), tmp_path / "out"
    flush, write = os.fsync, report.write_report

    def note(handle: int) -> None:
        flush(handle)
        flushed.add(os.fstat(handle).st_ino)

    def look(*given: object) -> None:
        wanted = [out / name for name in IMAGES if ".0001." in name] + [out / "quilt", out / "facets"]
        assert {path.stat().st_ino for path in wanted} <= flushed
        flushed.clear()
        write(*given)  # type: ignore[arg-type]

    def done(record: object) -> None:
        assert {(out / "report.json").stat().st_ino, out.stat().st_ino} <= flushed

    monkeypatch.setattr(os, "fsync", note)
    monkeypatch.setattr(sequence, "write_report", look)
    render(load_job(job), RenderOptions(frames=[1], threads=1), Listener(frame_done=done))
    assert flushed


# --- leftovers ---


def left_over(path: Path) -> Path:
    """A file that a process that is no more was writing."""
    child = os.fork()
    if child == 0:
        new_file_beside(path)
        os._exit(0)
    os.waitpid(child, 0)
    [found] = path.parent.glob(f".{path.name}.*.tmp")
    return found


@pytest.mark.parametrize("options", [{"resume": True}, {"overwrite": True, "frames": [3]}])
def test_what_a_dead_run_left_is_removed_whether_or_not_there_is_something_to_draw(
    tiny: Path, options: dict[str, object]
) -> None:
    out = tiny.parent / "out"
    names = ("quilt/page_01.0007.exr", "facets/facet_0002.0009.exr", "report.json", "layout.yaml")
    left = [left_over(out / name) for name in names]
    alive, handle = new_file_beside(out / "quilt/page_01.0008.exr")
    os.close(handle)
    render(load_job(tiny), RenderOptions(dry_run=True, threads=1, **options))  # type: ignore[arg-type]
    assert all(path.exists() for path in left)
    render(load_job(tiny), RenderOptions(threads=1, **options))  # type: ignore[arg-type]
    assert list(out.rglob("*.tmp")) == [alive]


# --- disks that fill and folders that go ---


def test_a_disk_that_is_full_from_the_start_is_no_bad_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = write_tiny_job(tmp_path, "144, 72")

    def full(*given: object) -> None:
        raise OutputError("no room") from OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(sequence, "write_settings", full)
    with pytest.raises(CheckFailedError, match="no room"):
        render(load_job(job), RenderOptions(threads=1))


def test_a_folder_that_goes_is_a_failure_of_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job, out = write_tiny_job(tmp_path, "144, 72"), tmp_path / "out"
    # More frames than can be drawn or under way before it is known that the first one is done.
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-9")

    def gone(record: object) -> None:
        if not (tmp_path / "elsewhere").exists():
            (out / "quilt").rename(tmp_path / "elsewhere")

    with pytest.raises(CheckFailedError, match=r"out/quilt.*: cannot be written: No such file"):
        render(load_job(job), RenderOptions(threads=1), Listener(frame_done=gone))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main.main(["render", "job.yaml", "--resume", "-o", "out/report.json"], prog_name="quilt")
    assert ended.value.code == 2  # a file where a folder is asked for was there before the run


# --- killed runs ---


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes cannot fork here")
@pytest.mark.parametrize("kills", [4, pytest.param(100, marks=pytest.mark.long)])
def test_a_killed_run_is_resumed_to_the_same_bytes_and_a_whole_report(tmp_path: Path, kills: int) -> None:
    job = write_tiny_job(tmp_path, "144, 72")
    replaced(tmp_path, "job.yaml", "frames: 1-4", "frames: 1-40")
    replaced(tmp_path, "job.yaml", "{frame: 4,", "{frame: 40,")
    command = [sys.executable, "-m", "tests.helpers.killed_runs", str(job), str(tmp_path), str(kills), "1"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert result.returncode == 0, result.stderr
    *faults, summary = result.stdout.splitlines()
    assert faults == []
    assert summary.startswith(f"{kills} runs killed, ")


@pytest.mark.long
def test_looking_takes_less_than_a_fifth_of_drawing(tmp_path: Path) -> None:
    job = write_tiny_job(tmp_path, "3000, 1500")
    replaced(tmp_path, "display.yaml", "pixels_per_metre: 32", "pixels_per_metre: 700")
    start = time.perf_counter()
    render(load_job(job), RenderOptions(threads=1))
    drawing = time.perf_counter() - start
    start = time.perf_counter()
    assert resumed(job) == []
    assert time.perf_counter() - start < 0.2 * drawing
