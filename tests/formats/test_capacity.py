from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from quiltcli.formats import capacity


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with 8 GiB available and neither groups nor limits."""
    (tmp_path / "proc" / "self").mkdir(parents=True)
    (tmp_path / "group").mkdir()
    (tmp_path / "proc" / "meminfo").write_text("MemTotal: 9 kB\nMemAvailable:    8388608 kB\n")
    monkeypatch.setattr(capacity, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(capacity, "_GROUP", tmp_path / "group")
    monkeypatch.setattr(capacity, "_address_space", lambda: None)
    return tmp_path


def test_memory_is_what_the_system_has_available(machine: Path) -> None:
    assert capacity.free_memory() == (8 << 30) - (256 << 20)


def test_a_container_may_leave_less(machine: Path) -> None:
    (machine / "group" / "memory.max").write_text(f"{4 << 30}\n")
    (machine / "group" / "memory.current").write_text(f"{1 << 30}\n")
    assert capacity.free_memory() == (3 << 30) - (256 << 20)


def test_a_container_without_a_limit_leaves_all(machine: Path) -> None:
    (machine / "group" / "memory.max").write_text("max\n")
    (machine / "group" / "memory.current").write_text(f"{1 << 30}\n")
    assert capacity.free_memory() == (8 << 30) - (256 << 20)


def test_never_less_than_nothing(machine: Path) -> None:
    (machine / "proc" / "meminfo").write_text("MemAvailable: 1 kB\n")
    assert capacity.free_memory() == 0


def test_the_disk_of_a_folder_that_is_yet_to_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real, asked = shutil.disk_usage, []

    def disk_usage(path: Path) -> object:
        asked.append(path)
        return real(path)._replace(free=len(asked))  # others write to the disk meanwhile

    monkeypatch.setattr(shutil, "disk_usage", disk_usage)
    assert capacity.free_disk(tmp_path / "a" / "b" / "c") == 4
    assert asked[-1] == tmp_path


def test_bytes_are_told_in_units_of_disks() -> None:
    assert [capacity.bytes_text(n) for n in (12_345_000_000, 3_400_000, 10)] == [
        "12.3 GB",
        "3.4 MB",
        "0.1 MB",
    ]


def test_what_is_allowed_is_meant_as_said(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No reserve is taken from it, but what the process has taken already."""
    (machine / "proc" / "self" / "status").write_text("VmRSS:   100000 kB\n")
    monkeypatch.setattr(capacity, "_limit", 300 << 20)
    assert capacity.free_memory() == (300 << 20) - 100_000 * 1024
    monkeypatch.setattr(capacity, "_limit", 9 << 30)
    assert capacity.free_memory() == (8 << 30) - (256 << 20)
    monkeypatch.setattr(capacity, "_limit", 1 << 20)
    assert capacity.free_memory() == 0
