"""What the fuzzer has found once must not come back: every line of `cases.txt` through the command line."""

from __future__ import annotations

import os
import resource
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.fuzz.running import run
from tests.fuzz.seeds import KINDS, prepare, write_seeds


@dataclass(frozen=True)
class Case:
    """A good input with one text in it replaced, and the commands of its kind."""

    kind: str
    old: str
    new: str


def _cases() -> Iterator[Case]:
    for line in (Path(__file__).parent / "cases.txt").read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            kind, old, new = (
                part.strip().encode("latin-1").decode("unicode_escape") for part in line.split(" | ")
            )
            yield Case(kind, old, new)


@pytest.fixture(scope="session")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("seeds")
    write_seeds(folder)
    return folder


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_good_inputs_are_no_findings(kind, seeds: Path, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    prepare(seeds, tmp_path / "work", kind)
    for command in kind.commands:
        outcome = run(shlex.split(command), tmp_path / "work", _memory())
        assert not outcome.fault, outcome
        assert outcome.code in (0, 2 if command.startswith("diff") else 0), outcome


@pytest.mark.parametrize("case", list(_cases()), ids=str)
def test_what_was_found_once(case: Case, seeds: Path, tmp_path: Path) -> None:
    kind = next(kind for kind in KINDS if kind.name == case.kind)
    prepare(seeds, tmp_path / "work", kind)
    path = tmp_path / "work" / kind.file
    os.mkfifo(tmp_path / "work" / "pipe")
    data = path.read_bytes()
    assert case.old.encode() in data
    path.write_bytes(data.replace(case.old.encode(), case.new.encode(), 1))
    for command in kind.commands:
        outcome = run(shlex.split(command), tmp_path / "work", _memory())
        assert not outcome.fault, outcome


def _memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
