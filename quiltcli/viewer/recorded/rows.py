"""Paths of kind `csv`: one row a frame, in the world, to be shown as it is.

Columns are `frame, x, y, z`, then if the file has them where the viewer looks and which way is up:
`look_at_x, look_at_y, look_at_z` (a point; short `lx, ly, lz`) or `look_x, look_y, look_z` (a
direction), and `up_x, up_y, up_z` (short `ux, uy, uz`); or how the head is turned: `qx, qy, qz, qw`, or
`yaw_deg, pitch_deg, roll_deg`. With a header line the columns may stand in any order; without one they
are frame, eye, point looked at, up. Blank lines and lines that start with `#` are skipped.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from quiltcli.errors import Problem, ViewerError, raise_all
from quiltcli.formats.noted import round_of_notes
from quiltcli.geometry import FloatArray, IntArray, quaternions
from quiltcli.job.model import FARTHEST, suggest
from quiltcli.viewer.recorded.columns import (
    EYE,
    HEADING,
    LOOK,
    LOOK_AT,
    QUATERNION,
    UP,
    full_name,
    missing_names,
    rotations_of,
    turn_groups,
)
from quiltcli.viewer.recorded.tables import (
    MOST_PROBLEMS,
    Dialect,
    Rows,
    dialect_of,
    read_rows,
    separator_problem,
    take_lines,
)
from quiltcli.viewer.recorded.take import Y_UP, wrong

_NAMES = ("frame", *EYE, *LOOK_AT, *LOOK, *UP, *QUATERNION, *HEADING)


@dataclass(frozen=True)
class Track:
    """A recorded path of K rows.

    Attributes:
        frames: (K,) frame numbers, ascending.
        values: (K, 3, 6 or 9) eye, then what is looked at, then up, in the units of the file.
        rotations: (K, 4) of the head, where the file gives them.
        lines: (K,) 1-based lines of the rows.
        aim: `look_at`, `look`, or empty when the file holds no aim.
        has_up: whether the last three columns are up.
        path: the file as given.
    """

    frames: IntArray
    values: FloatArray
    rotations: FloatArray | None
    lines: IntArray
    aim: str
    has_up: bool
    path: Path

    def problem(self, row: int, message: str) -> Problem:
        """A problem at the start of a row."""
        return Problem(message, str(self.path), int(self.lines[row]), 1)


def read_track(path: Path) -> Track:
    """Read a recorded path; a file that has not changed is read once.

    Raises:
        ViewerError: with every bad row of the file.
    """
    stat = path.stat() if path.is_file() else None
    return _read(path, stat.st_mtime_ns if stat else 0, stat.st_size if stat else 0, round_of_notes())


@lru_cache(maxsize=8)
def _read(path: Path, changed: int, size: int, notes: int) -> Track:
    lines = take_lines(path)
    dialect = dialect_of(lines)
    if problem := separator_problem(path, lines, dialect):
        raise ViewerError(problem)
    good = (k for k, line in enumerate(lines) if _is_row(line, dialect))
    at = next(good, None)
    names = _header(lines[at], at + 1, dialect, path) if at is not None else ()
    body = next(good, None) if names else at
    if at is None or body is None:
        raise wrong(path, "holds no rows (expected frame,x,y,z)")
    names = names or _positional(dialect.cells(lines[body]), body + 1, path)
    columns = [(names.index(name), name) for name in _NAMES if name in names]
    rest = [line if _is_row(line, dialect) else "" for line in lines[body:]]
    rows = read_rows(path, rest, columns, dialect, body + 1, len(names), len(columns))
    wanted = [name for _, name in columns]
    raise_all(ViewerError, list(_frame_problems(rows, rest, body + 1, columns[0][0], dialect, path)))
    raise_all(ViewerError, _far_problems(rows, columns, path))
    return _track(rows, wanted, path)


def _is_row(line: str, dialect: Dialect) -> bool:
    return bool(line.strip(f' \t"{dialect.separator}')) and not line.lstrip().startswith("#")


def _header(line: str, number: int, dialect: Dialect, path: Path) -> tuple[str, ...]:
    """Column names, or none when the first row does not start with a word."""
    cells = dialect.cells(line)
    if not cells[0][:1].isalpha():
        return ()
    names = [full_name(cell) for cell in cells]
    problems = []

    def problem(words: str, index: int = 0) -> None:
        problems.append(Problem(words, str(path), number, dialect.place(line, index)))

    for i, (name, cell) in enumerate(zip(names, cells, strict=True)):
        if name == "time":
            problem(f"unknown column {cell!r} (a take that has times is a path of kind recorded)", i)
        elif name not in _NAMES:
            near = suggest(name, _NAMES)
            problem(
                f"unknown column {cell!r} "
                + (f"(did you mean {near!r}?)" if near else f"(known: {', '.join(_NAMES)})"),
                i,
            )
        elif name in names[:i]:
            problem(f"column {name!r} stands twice", i)
    for name in (["frame"] if "frame" not in names else []) + missing_names(names):
        problem(f"there is no column {name!r}")
    turns = turn_groups(names)
    if turns[:2] == [LOOK_AT, LOOK]:
        problem("holds both look_at and look columns (expected one kind)")
    elif len(turns) > 1:
        problem(f"both {turns[0][0]} and {turns[1][0]} say how the head is turned")
    raise_all(ViewerError, problems)
    return tuple(names)


def _positional(cells: list[str], number: int, path: Path) -> tuple[str, ...]:
    """Column names of a file without a header, by their number."""
    if len(cells) not in (4, 7, 10):
        hint = " (separate the columns by commas)" if len(cells) == 1 else ""
        raise wrong(path, f"expected 4, 7 or 10 columns, got {len(cells)}{hint}", number, 1)
    return ("frame", *EYE, *LOOK_AT, *UP)[: len(cells)]


def _frame_problems(
    rows: Rows, lines: list[str], first: int, index: int, dialect: Dialect, path: Path
) -> Iterator[Problem]:
    """Frames that are no whole numbers, or stand twice."""
    frames = rows.values[:, 0]
    whole = (frames == np.floor(frames)) & (np.abs(frames) < 1e11)
    order = np.argsort(frames, kind="stable")
    twice = np.zeros(len(frames), dtype=np.bool_)
    twice[order[1:]] = np.diff(frames[order]) == 0
    for row in np.flatnonzero(~whole | twice)[:MOST_PROBLEMS].tolist():
        line = int(rows.lines[row])
        text = lines[line - first]
        if whole[row]:
            before = int(rows.lines[np.flatnonzero(frames == frames[row])[0]])
            words = f"frame {int(frames[row])} is already given in line {before}"
        else:
            words = f"frame: expected a whole number, got {dialect.cells(text)[index]!r}"
        yield Problem(words, str(path), line, dialect.place(text, index))


def _far_problems(rows: Rows, columns: list[tuple[int, str]], path: Path) -> Iterator[Problem]:
    """Places and directions beyond what the renderer's single precision can square."""
    found = zip(*np.nonzero(np.abs(rows.values) > FARTHEST), strict=True)
    for row, column in itertools.islice(found, MOST_PROBLEMS):
        name, value = columns[column][1], rows.values[row, column]
        words = f"{name}: expected a number from -{FARTHEST:.0f} to {FARTHEST:.0f}, got {value:g}"
        yield Problem(words, str(path), int(rows.lines[row]), 1)


def _track(rows: Rows, names: list[str], path: Path) -> Track:
    """Rows in the order of their frames, columns in the order eye, aim, up."""
    aim = "look_at" if LOOK_AT[0] in names else "look" if LOOK[0] in names else ""
    has_up = UP[0] in names
    wanted = (*EYE, *{"look_at": LOOK_AT, "look": LOOK, "": ()}[aim], *(UP if has_up else ()))
    order = np.argsort(rows.values[:, 0], kind="stable")
    values = rows.values[order]
    rotations = None
    if not aim:
        turns, _ = rotations_of(names, values, None, Y_UP)
        rotations = None if turns is None else quaternions.unit(turns)
    if rotations is not None and not np.isfinite(rotations).all():
        line = int(rows.lines[order][np.argmin(np.isfinite(rotations).all(axis=1))])
        raise wrong(path, "qx, qy, qz, qw are all 0, which is no rotation", line, 1)
    return Track(
        frames=values[:, 0].astype(np.int64),
        values=values[:, [names.index(name) for name in wanted]],
        rotations=rotations,
        lines=rows.lines[order],
        aim=aim,
        has_up=has_up,
        path=path,
    )
