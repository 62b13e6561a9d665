"""Tables of numbers in text: lines to columns, with every bad cell named by line and column.

A blank cell is a lost value, never a zero. Files are read once, in time and space that grow with
their length.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.errors import Problem, ViewerError, raise_all
from quiltcli.formats.yaml.syntax import read_text
from quiltcli.geometry import FloatArray, IntArray

MOST_PROBLEMS = 20
MOST_BYTES = 2**30
_LOST = ("", "nan", "-nan", "nan(ind)", "-nan(ind)", "null", "none")


@dataclass(frozen=True)
class Rows:
    """Numbers of a table.

    Attributes:
        values: (K, C) in the order of the columns that were asked for, not numbers where a cell is blank.
        lines: (K,) 1-based lines they stand in.
    """

    values: FloatArray
    lines: IntArray


@dataclass(frozen=True)
class Dialect:
    """How cells are told apart: by `separator`, or by blanks where it is empty; and what a comma means."""

    separator: str
    decimal_comma: bool = False

    def cells(self, line: str) -> list[str]:
        """Cells of a line, without quotes and the blanks around them."""
        if not self.separator:
            return line.split()
        return [cell.strip().strip('"').strip() for cell in line.split(self.separator)]

    def place(self, line: str, index: int) -> int:
        """1-based column at which a cell begins; one behind the line's end where it has not as many."""
        if index >= len(line.split(self.separator or None)):
            return len(line.rstrip()) + 1
        if self.separator:
            start = sum(len(cell) + 1 for cell in line.split(self.separator)[:index])
            cell = line.split(self.separator)[index]
            return start + min(len(cell) - len(cell.lstrip()), len(cell.rstrip())) + 1
        start = 0
        for word in line.split()[:index]:
            start = line.index(word, start) + len(word)
        return start + len(line[start:]) - len(line[start:].lstrip()) + 1


def take_lines(path: Path) -> list[str]:
    """Lines of a take's file.

    Raises:
        JobError: it cannot be read or is not UTF-8.
        ViewerError: it is larger than a gibibyte.
    """
    check_size(path)
    return read_text(path).splitlines()


def check_size(path: Path) -> None:
    """Whether a file may be read whole (ViewerError)."""
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise ViewerError(Problem("is larger than 1 GiB (expected a take cut to what is shown)", str(path)))


def dialect_of(lines: Sequence[str]) -> Dialect:
    """How the cells of a table are told apart, from some of its lines.

    Semicolons or tabs beside commas between digits are the export of a system with decimal commas.
    """
    some = [line for line in lines[:50] if line.strip() and not line.lstrip().startswith("#")]
    text = "\n".join(some)
    if ";" in text:
        return Dialect(";", decimal_comma="," in text)
    tabs = {line.count("\t") for line in some}
    if "," in text and tabs and min(tabs) >= _LEAST - 1 and len(tabs) == 1:
        return Dialect("\t", decimal_comma=True)
    if "," in text:
        return Dialect(",")
    return Dialect("\t" if "\t" in text else "")


_LEAST = 4  # columns of a path: when, and x, y, z
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", ":": "colons", " ": "blanks"}


def separator_problem(path: Path, lines: Sequence[str], dialect: Dialect) -> Problem | None:
    """What is wrong with how a table separates its columns, by its first two lines; None if nothing is."""
    good = (k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#"))
    first, second = next(good, None), next(good, None)
    if first is None or second is None:
        return None
    names, row = (len(dialect.cells(lines[k])) for k in (first, second))
    by, also = (_separator_of(lines[k]) for k in (first, second))
    if 1 in (names, row) and by and also:
        if by == also:
            words = f"the columns are separated by {_SEPARATORS[by]} (expected commas, semicolons or tabs)"
            return Problem(words, str(path), first + 1, 1)
        words = f"columns separated by {_SEPARATORS[also]} under names separated by {_SEPARATORS[by]}"
        return Problem(f"{words} (expected one and the same)", str(path), second + 1, 1)
    if dialect.separator == "," and _LEAST <= names < row <= 2 * names and lines[first].strip()[:1].isalpha():
        words = f"{row} cells under {names} names: are commas decimal points here?"
        return Problem(f"{words} (separate the columns by semicolons)", str(path), second + 1, 1)
    return None


def _separator_of(line: str) -> str:
    """What seems to separate the columns of a line, empty where nothing makes enough of it."""
    for mark in (";", "\t", "|", ":"):
        if len(line.strip().split(mark)) >= _LEAST:
            return mark
    if len(line.split()) >= _LEAST and ", " not in line:
        return " "
    return "," if len(line.split(",")) >= _LEAST else ""


def read_rows(
    path: Path,
    lines: Sequence[str],
    columns: Sequence[tuple[int, str]],
    dialect: Dialect,
    first: int = 1,
    width: int | None = None,
    needed: int = 0,
) -> Rows:
    """Some columns of a table as numbers.

    Blank lines and lines that start with `#` are skipped.

    Args:
        path: for messages.
        lines: the table's lines.
        columns: index and name of every column that is wanted.
        dialect: how cells are told apart.
        first: 1-based line of the first.
        width: number of cells each line must have; None where short lines have lost cells.
        needed: so many of the columns, counted from the first, must not be blank.

    Raises:
        ViewerError: with the first twenty bad cells.
    """
    values, at = array("d"), array("q")
    problems: list[Problem] = []
    wanted = [index for index, _ in columns]
    reach = max(wanted, default=-1) + 1
    for number, line in enumerate(lines, first):
        if not line or line.isspace() or line.lstrip().startswith("#"):
            continue
        if len(problems) >= MOST_PROBLEMS:
            break
        # A comma that is a decimal point is put right for the whole line: cell by cell takes its time.
        found = dialect.cells(line.replace(",", ".") if dialect.decimal_comma else line)
        if width is not None and len(found) != width:
            problems.append(_row_width(path, number, width, len(found), dialect))
            continue
        found += [""] * (reach - len(found))
        at.append(number)
        try:
            row = [float(found[index]) for index in wanted]
            if not all(map(math.isfinite, row)) or "_" in line:
                raise ValueError  # noqa: TRY301 - the careful way finds out
        except ValueError:
            row = _careful(path, line, number, found, columns, dialect, needed, problems)
        values.extend(row)
    raise_all(ViewerError, problems[:MOST_PROBLEMS])
    return Rows(
        np.frombuffer(values, dtype=np.float64).reshape(-1, len(wanted)).copy(),
        np.frombuffer(at, dtype=np.int64).copy(),
    )


def _row_width(path: Path, number: int, width: int, got: int, dialect: Dialect) -> Problem:
    hint = " (separate the columns by commas)" if got == 1 and not dialect.separator else ""
    return Problem(f"expected {width} columns, got {got}{hint}", str(path), number, 1)


def _careful(
    path: Path,
    line: str,
    number: int,
    cells: Sequence[str],
    columns: Sequence[tuple[int, str]],
    dialect: Dialect,
    needed: int,
    problems: list[Problem],
) -> list[float]:
    """Numbers of a line in which something is blank, not finite or no number."""
    row = []
    for rank, (index, name) in enumerate(columns):
        text = cells[index]
        value = number_of(text)
        words = ""
        if value is None:
            words = f"{name}: expected a number, got {text!r}"
        elif math.isinf(value):
            words = f"{name}: expected a finite number, got {text}"
        elif math.isnan(value) and rank < needed:
            words = f"{name} is blank" if not text else f"{name}: expected a finite number, got {text}"
        if words:
            column = dialect.place(line, index) if text or dialect.separator else 1
            problems.append(Problem(words, str(path), number, column))
        row.append(math.nan if value is None else value)
    return row


def number_of(text: str) -> float | None:
    """The number of a cell, not a number where it is blank, None where it is something else."""
    if text.lower() in _LOST:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        return None
    return None if "_" in text else value
