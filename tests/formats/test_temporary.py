"""Names of unfinished files, and who may remove them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from quiltcli.errors import OutputError
from quiltcli.formats import temporary, whole
from quiltcli.formats.temporary import new_file_beside, path_beside, remove_leftovers
from quiltcli.formats.whole import link_whole, whole_file, write_text

WRITER = """
import sys, time
from pathlib import Path
from quiltcli.formats.whole import whole_file
with whole_file(Path(sys.argv[1])):
    print("writing", flush=True)
    time.sleep(60)
"""


def left_by(folder: Path, **changes: object) -> Path:
    """A file left in a folder by a writer that differs from this process in what is given."""
    path, handle = new_file_beside(folder / "page_01.0001.exr")
    os.close(handle)
    fields = path.name.split(".")[-2].split("-")
    names = ("machine", "boot", "pid", "start", "random")
    token = "-".join(str(changes.get(name, field)) for name, field in zip(names, fields, strict=True))
    return path.rename(path.with_name(f".page_01.0001.exr.{token}.tmp"))


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def aged(path: Path, hours: float) -> Path:
    then = time.time() - 3600 * hours
    os.utime(path, (then, then))
    return path


def no_process() -> int:
    """The number of a process that is no more."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    return ended.pid


# --- names ---


def test_no_two_names_are_alike(tmp_path: Path) -> None:
    names = {path_beside(tmp_path / "a.exr") for _ in range(100)}
    assert len(names) == 100
    assert all(name.name.startswith(".a.exr.") and name.suffix == ".tmp" for name in names)


@pytest.mark.parametrize("name", ["a" * 255, "é" * 127, os.fsdecode(b"\xff" * 255)])
def test_the_longest_names_there_are_can_be_written(tmp_path: Path, name: str) -> None:
    write_text(tmp_path / name, "text")
    assert names_in(tmp_path) == [name]


def test_a_link_planted_where_a_file_will_be_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    monkeypatch.setattr(temporary, "path_beside", lambda path: tmp_path / "planted")
    (tmp_path / "planted").symlink_to(victim)
    with pytest.raises(OutputError, match="File exists"):
        write_text(tmp_path / "a.txt", "theirs")
    assert victim.read_text() == "mine"
    assert (tmp_path / "planted").is_symlink()


def test_a_file_is_as_private_as_the_system_makes_files(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "a", "text")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


# --- whole on the disk ---


def test_bytes_are_flushed_before_a_file_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[tuple[int, bool]] = []

    def note(handle: int) -> None:
        flushed.append((os.fstat(handle).st_size, (tmp_path / "a").exists()))

    monkeypatch.setattr(os, "fsync", note)
    write_text(tmp_path / "a", "text")
    assert flushed == [(4, False)]


def test_a_disk_that_loses_what_it_is_given_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(handle: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", broken)
    with pytest.raises(OutputError, match="a: cannot be written: Input/output error"):
        write_text(tmp_path / "a", "text")
    assert names_in(tmp_path) == []


def test_a_file_system_that_cannot_flush_is_borne(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unable(handle: int) -> None:
        raise OSError(22, "Invalid argument")

    monkeypatch.setattr(os, "fsync", unable)
    write_text(tmp_path / "a", "text")
    whole.sync_folder(tmp_path)
    assert (tmp_path / "a").read_text() == "text"


def test_linking_a_file_to_itself_leaves_nothing(tmp_path: Path) -> None:
    write_text(tmp_path / "a", "text")
    os.link(tmp_path / "a", tmp_path / "b")
    link_whole(tmp_path / "a", tmp_path / "b")
    assert names_in(tmp_path) == ["a", "b"]


# --- leftovers ---


def test_what_a_killed_writer_leaves_is_removed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", WRITER, str(tmp_path / "a.exr")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "writing\n"
        assert remove_leftovers([tmp_path]) == 0  # it lives
        assert len(names_in(tmp_path)) == 1
        writer.send_signal(signal.SIGKILL)
        os.waitid(os.P_PID, writer.pid, os.WEXITED | os.WNOWAIT)  # dead, and a zombie still
        assert remove_leftovers([tmp_path]) == 1
    assert names_in(tmp_path) == []


def test_what_this_process_is_writing_stays(tmp_path: Path) -> None:
    with whole_file(tmp_path / "a.exr") as path:
        aged(path, hours=100)
        assert remove_leftovers([tmp_path]) == 0
        assert path.exists()


def test_what_a_fork_of_this_process_is_writing_is_its_own(tmp_path: Path) -> None:
    assert new_file_beside(tmp_path / "a")[0].exists()
    child = os.fork()
    if child == 0:
        new_file_beside(tmp_path / "b")
        os._exit(0)
    os.waitpid(child, 0)
    assert remove_leftovers([tmp_path]) == 1
    assert [name[:3] for name in names_in(tmp_path)] == [".a."]


def test_another_process_with_a_dead_one_s_number_does_not_count(tmp_path: Path) -> None:
    left_by(tmp_path, start=7)
    left_by(tmp_path, pid=no_process())
    left_by(tmp_path, pid=10**30)
    stays = left_by(tmp_path)
    assert remove_leftovers([tmp_path]) == 3
    assert stays.exists()


def test_what_was_written_before_the_machine_was_started_anew_is_removed(tmp_path: Path) -> None:
    if temporary._process(os.getpid()).machine == temporary._UNKNOWN:
        pytest.skip("nothing tells this machine from others")
    left_by(tmp_path, boot="12345678")
    assert remove_leftovers([tmp_path]) == 1


@pytest.mark.parametrize("machine", ["12345678", "00000000"])
def test_another_machine_has_an_hour(tmp_path: Path, machine: str) -> None:
    young = aged(left_by(tmp_path, machine=machine, boot="12345678", pid=1), hours=0.9)
    aged(left_by(tmp_path, machine=machine, boot="12345678", pid=1), hours=1.1)
    assert remove_leftovers([tmp_path]) == 1
    assert young.exists()


def test_names_of_the_first_version_go_by_their_age(tmp_path: Path) -> None:
    old, young = tmp_path / ".page_01.0001.exr.123.tmp", tmp_path / ".page_01.0002.exr.123.tmp"
    old.touch()
    young.touch()
    aged(old, hours=2)
    assert remove_leftovers([tmp_path]) == 1
    assert young.exists()


def test_other_files_are_left_alone(tmp_path: Path) -> None:
    name = left_by(tmp_path, pid=no_process()).name
    (tmp_path / name).unlink()
    (tmp_path / name).mkdir()
    (tmp_path / f"{name}.bak").touch()
    (tmp_path / name[1:]).touch()
    (tmp_path / f".x{name}").symlink_to("a")
    for other in (".hidden", "a.tmp", ".a.tmp", "page_01.0001.exr"):
        aged_file = tmp_path / other
        aged_file.touch()
        aged(aged_file, hours=100)
    before = names_in(tmp_path)
    assert remove_leftovers([tmp_path, tmp_path / "none"]) == 0
    assert names_in(tmp_path) == before
