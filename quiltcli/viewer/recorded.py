"""Recorded viewer paths: CSV files with one row a frame.

Columns are `frame, x, y, z`, then if the file has them where the viewer looks and which way is up:
`look_at_x, look_at_y, look_at_z` (a point; short `lx, ly, lz`) or `look_x, look_y, look_z` (a
direction), and `up_x, up_y, up_z` (short `ux, uy, uz`). With a header line the columns may stand in
any order; without one they are frame, eye, point looked at, up. Blank lines and lines that start
with `#` are skipped. Cells are separated by commas, semicolons or tabs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from quiltcli.errors import Problem, ViewerError, raise_all
from quiltcli.formats.yaml.source import shorten
from quiltcli.formats.yaml.syntax import read_text
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.job.model import FARTHEST, suggest

_EYE = ("x", "y", "z")
_LOOK_AT = ("look_at_x", "look_at_y", "look_at_z")
_LOOK = ("look_x", "look_y", "look_z")
_UP = ("up_x", "up_y", "up_z")
_SHORT = dict(zip(("lx", "ly", "lz", "ux", "uy", "uz"), _LOOK_AT + _UP, strict=True))
_NAMES = ("frame", *_EYE, *_LOOK_AT, *_LOOK, *_UP)
_MOST_PROBLEMS = 20
_MOST_LINES = 1_000_001


@dataclass(frozen=True)
class Track:
    """A recorded path of K rows.

    Attributes:
        frames: (K,) frame numbers, ascending.
        values: (K, 3, 6 or 9) eye, then what is looked at, then up, in the units of the file.
        lines: (K,) 1-based lines of the rows.
        aim: `look_at`, `look`, or empty when the file holds no aim.
        has_up: whether the last three columns are up.
        path: the file as given.
    """

    frames: IntArray
    values: FloatArray
    lines: IntArray
    aim: str
    has_up: bool
    path: Path

    def problem(self, row: int, message: str) -> Problem:
        """A problem at the start of a row."""
        return Problem(message, str(self.path), int(self.lines[row]), 1)


@dataclass(frozen=True)
class _Cell:
    """Text of a cell, and where it stands."""

    text: str
    line: int
    column: int


def read_track(path: Path) -> Track:
    """Read a recorded path; a file that has not changed is read once.

    Raises:
        ViewerError: with every bad row of the file.
    """
    stat = path.stat() if path.is_file() else None
    return _read(path, stat.st_mtime_ns if stat else 0, stat.st_size if stat else 0)


@lru_cache(maxsize=8)
def _read(path: Path, changed: int, size: int) -> Track:
    lines = read_text(path).splitlines()
    if len(lines) > _MOST_LINES:
        raise ViewerError(Problem(f"has more than {_MOST_LINES:,} lines, expected a line a frame", str(path)))
    separator = _separator(lines)
    rows = [_cells(line, number, separator) for number, line in enumerate(lines, 1)]
    rows = [row for row in rows if any(cell.text for cell in row) and not row[0].text.startswith("#")]
    names = _header(rows[0], path) if rows else ()
    body = rows[1:] if names else rows
    if not body:
        raise ViewerError(Problem("holds no rows (expected frame,x,y,z)", str(path)))
    names = names or _positional(body[0], path)
    raise_all(ViewerError, itertools.islice(_row_problems(body, names, path), _MOST_PROBLEMS))
    return _track(body, names, path)


def _separator(lines: list[str]) -> str:
    """What separates the cells: spreadsheets of half of Europe write semicolons, others tabs."""
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    if first.count(";") > first.count(","):
        return ";"
    return "\t" if "\t" in first and "," not in first else ","


def _cells(line: str, number: int, separator: str) -> list[_Cell]:
    """Cells of a line with the 1-based column of each."""
    cells, start = [], 0
    for text in line.split(separator):
        blank = len(text) - len(text.lstrip())
        cells.append(_Cell(text.strip().strip('"'), number, start + min(blank, len(text.rstrip())) + 1))
        start += len(text) + 1
    return cells


def _header(row: list[_Cell], path: Path) -> tuple[str, ...]:
    """Column names, or none when the first row does not start with a word."""
    if not row[0].text[:1].isalpha():
        return ()
    names = [_SHORT.get(cell.text.lower(), cell.text.lower()) for cell in row]
    problems = []
    for i, (name, cell) in enumerate(zip(names, row, strict=True)):
        if name not in _NAMES:
            near = suggest(name, _NAMES)
            hint = f"did you mean {near!r}?" if near else f"known: {', '.join(_NAMES)}"
            problems.append(_at(cell, path, f"unknown column {cell.text!r} ({hint})"))
        elif name in names[:i]:
            problems.append(_at(cell, path, f"column {name!r} stands twice"))
    for group in (("frame",), _EYE, _LOOK_AT, _LOOK, _UP):
        missing = [name for name in group if name not in names]
        if missing and (group in (("frame",), _EYE) or len(missing) < len(group)):
            problems.append(_at(row[0], path, f"there is no column {missing[0]!r}"))
    if _LOOK_AT[0] in names and _LOOK[0] in names:
        problems.append(_at(row[0], path, "holds both look_at and look columns (expected one kind)"))
    raise_all(ViewerError, problems)
    return tuple(names)


def _positional(row: list[_Cell], path: Path) -> tuple[str, ...]:
    """Column names of a file without a header, by their number."""
    if len(row) not in (4, 7, 10):
        hint = " (separate the columns by commas)" if len(row) == 1 else ""
        raise ViewerError(_at(row[0], path, f"expected 4, 7 or 10 columns, got {len(row)}{hint}"))
    return ("frame", *_EYE, *_LOOK_AT, *_UP)[: len(row)]


def _row_problems(body: list[list[_Cell]], names: tuple[str, ...], path: Path) -> Iterator[Problem]:
    """Everything that is wrong with the rows."""
    first: dict[int, int] = {}
    for row in body:
        if len(row) != len(names):
            yield _at(row[0], path, f"expected {len(names)} columns, got {len(row)}")
            continue
        for name, cell in zip(names, row, strict=True):
            words = _cell_words(name, cell.text)
            if words:
                yield _at(cell, path, words)
        cell = row[names.index("frame")]
        if _cell_words("frame", cell.text):
            continue
        frame = int(cell.text)
        if frame in first:
            yield _at(cell, path, f"frame {frame} is already given in line {first[frame]}")
        first.setdefault(frame, cell.line)


def _cell_words(name: str, text: str) -> str:
    """What is wrong with one cell; empty when nothing is."""
    if not text:
        return f"{name} is blank"
    if name == "frame":
        whole = text.lstrip("+-").isdecimal() and text.isascii() and len(text) < 12
        return "" if whole else f"frame: expected a whole number, got {shorten(text)!r}"
    if not _is_number(text):
        return f"{name}: expected a number, got {shorten(text)!r}"
    if not math.isfinite(float(text)):
        return f"{name}: expected a finite number, got {text}"
    far = f"{name}: expected a number from -{FARTHEST:.0f} to {FARTHEST:.0f}, got {shorten(text)}"
    return "" if abs(float(text)) <= FARTHEST else far


def _track(body: list[list[_Cell]], names: tuple[str, ...], path: Path) -> Track:
    """Rows in the order of their frames, columns in the order eye, aim, up."""
    aim = "look_at" if _LOOK_AT[0] in names else "look" if _LOOK[0] in names else ""
    has_up = _UP[0] in names
    wanted = (*_EYE, *{"look_at": _LOOK_AT, "look": _LOOK, "": ()}[aim], *(_UP if has_up else ()))
    frames = np.array([int(row[names.index("frame")].text) for row in body], dtype=np.int64)
    values = np.array([[float(row[names.index(name)].text) for name in wanted] for row in body])
    lines = np.array([row[0].line for row in body], dtype=np.int64)
    order = np.argsort(frames, kind="stable")
    return Track(frames[order], values[order], lines[order], aim, has_up, path)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _at(cell: _Cell, path: Path, words: str) -> Problem:
    return Problem(words, str(path), cell.line, cell.column)
