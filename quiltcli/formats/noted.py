"""What was in the files that were read, for a hash of what has been used and not of what lies there later.

Files may change while a job is loaded. So whoever reads an input notes its bytes, and the job's hash is
made of the notes; a file that is read twice, and is not the same both times, is an error.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import count
from pathlib import Path

from quiltcli.errors import JobError, Problem

_numbers = count(1)


class _Notes(dict[str, str]):
    """SHA-256, hexadecimal, by absolute path."""

    def __init__(self) -> None:
        super().__init__()
        self.number = next(_numbers)


_notes: ContextVar[_Notes | None] = ContextVar("notes", default=None)


@contextmanager
def noting_inputs() -> Iterator[Mapping[str, str]]:
    """Note all inputs that are read in the block: their SHA-256, hexadecimal, by absolute path."""
    before = _notes.set(_Notes())
    try:
        notes = _notes.get()
        assert notes is not None
        yield notes
    finally:
        _notes.reset(before)


def note_input(path: Path | str, data: bytes) -> None:
    """Note the bytes of a file that has been read; does nothing where nobody wants to know.

    Raises:
        JobError: the file was read before, and was another.
    """
    if _notes.get() is not None:
        note_digest(path, hashlib.sha256(data).hexdigest())


def note_digest(path: Path | str, digest: str) -> None:
    """As `note_input`, for whoever knows the SHA-256 of the bytes already."""
    notes = _notes.get()
    if notes is not None and notes.setdefault(str(Path(path).absolute()), digest) != digest:
        raise JobError(Problem("has changed while it was being read (run again)", str(path)))


def noted_digest(path: Path | str) -> str | None:
    """The SHA-256 of a file as it was read, None if it was not."""
    notes = _notes.get()
    return None if notes is None else notes.get(str(Path(path).absolute()))


def round_of_notes() -> int:
    """A number that is another in every block of `noting_inputs`, for who reads a file once; 0 outside."""
    notes = _notes.get()
    return 0 if notes is None else notes.number
