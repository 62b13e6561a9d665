"""The log of a study: a CSV table of who did which task on which display, and how."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from quiltcli.errors import JobError, Problem, first_of, raise_all
from quiltcli.formats.inputs import read_input
from quiltcli.job.model import either, suggest

NAMES = ("person", "task", "display")
NUMBERS = ("optimal_length", "path_length", "undos", "motions", "seconds")
RATINGS = ("visibility", "interactivity", "overall")
"""Columns that a log may have beside the others: a person's own rating of a display."""

_MOST = 20
_LARGEST = 1e9


@dataclass(frozen=True)
class Trial:
    """One task, done by one person on one display.

    Attributes:
        person: who.
        task: what.
        display: on what.
        optimal_length: steps of the shortest way.
        path_length: steps of the way that was chosen.
        undos: steps that were taken back.
        motions: changes of the viewpoint.
        seconds: time taken.
        ratings: by name, those that were given.
        line: of the file, from 1.
    """

    person: str
    task: str
    display: str
    optimal_length: float
    path_length: float
    undos: float
    motions: float
    seconds: float
    ratings: dict[str, float]
    line: int


@dataclass(frozen=True)
class StudyLog:
    """A log.

    Attributes:
        file: its name.
        trials: in the order of the file.
        ignored: columns that mean nothing here.
    """

    file: str
    trials: tuple[Trial, ...]
    ignored: tuple[str, ...] = ()


def read_log(path: Path, skip: Sequence[str] = ()) -> StudyLog:
    """Read a log.

    The first row names the columns, in any order: `person`, `task`, `display`, `optimal_length`,
    `path_length`, `undos`, `motions`, `seconds`, and, if wanted, `visibility`, `interactivity` and `overall`.
    Lines that begin with # are skipped.

    Args:
        path: the file; commas or semicolons between cells, with semicolons also decimal commas.
        skip: tasks to leave out, such as one for practice.

    Raises:
        JobError: every line at fault, or nothing left to study.
    """
    text = read_input(path, JobError, "a CSV").decode("utf-8-sig", "replace")
    head = next((line for line in text.splitlines() if line.strip() and line[0] != "#"), "")
    delimiter = ";" if ";" in head else ","
    rows = csv.reader(io.StringIO(text), delimiter=delimiter)
    try:
        numbered = [(rows.line_num, [cell.strip() for cell in row]) for row in rows]
    except csv.Error as error:
        raise JobError(Problem(f"is not CSV: {error}", file=str(path), line=rows.line_num)) from None
    numbered = [(line, row) for line, row in numbered if any(row) and not row[0].startswith("#")]
    if not numbered:
        raise JobError(Problem(f"is empty (expected a first row {', '.join((*NAMES, *NUMBERS))})", str(path)))
    columns = _columns(path, *numbered[0])
    problems: list[Problem] = []
    trials: list[Trial] = []
    for line, row in numbered[1:]:
        try:
            trials.append(_trial(row, columns, line))
        except ValueError as error:
            problems += [Problem(words, file=str(path), line=line) for words in error.args]
    problems += _contradictions(path, trials)
    problems.sort(key=lambda problem: problem.line)
    raise_all(JobError, first_of(problems, _MOST, str(path)))
    tasks = list(dict.fromkeys(trial.task for trial in trials))
    for task in skip:
        if task not in tasks:
            raise JobError(Problem(f"has no task {task!r} to skip (expected {either(tasks)})", str(path)))
    kept = tuple(trial for trial in trials if trial.task not in skip)
    if not kept:
        raise JobError(
            Problem("has no trial to study (expected a row for each task that was done)", str(path))
        )
    known = (*NAMES, *NUMBERS, *RATINGS)
    return StudyLog(path.name, kept, tuple(name for name in columns if name not in known))


def _columns(path: Path, line: int, row: list[str]) -> list[str]:
    """The names of the columns, in small letters."""
    found = [name.lower() for name in row]
    problems = []
    for name in (*NAMES, *NUMBERS):
        if found.count(name) == 1:
            continue
        if name in found:
            words = f"column {name} is there {found.count(name)} times"
        else:
            near = suggest(name, [other for other in found if other not in (*NAMES, *NUMBERS)])
            words = f"there is no column {name}" + (f" (is {near!r} meant?)" if near else "")
        problems.append(Problem(words, file=str(path), line=line))
    problems += [
        Problem(f"column {name} is there {found.count(name)} times", file=str(path), line=line)
        for name in RATINGS
        if found.count(name) > 1
    ]
    if len(problems) == len(NAMES) + len(NUMBERS):
        words = f"expected a first row {', '.join((*NAMES, *NUMBERS))}, got {', '.join(row)[:60]}"
        problems = [Problem(words, file=str(path), line=line)]
    raise_all(JobError, problems)
    return found


def _trial(row: list[str], columns: list[str], line: int) -> Trial:
    """A row as a trial; ValueError has a sentence for everything that is wrong."""
    if len(row) != len(columns):
        raise ValueError(f"expected {len(columns)} cells, got {len(row)}")
    cells = dict(zip(columns, row, strict=True))
    faults = [f"{name} is empty" for name in NAMES if not cells[name]]
    numbers: dict[str, float] = {}
    for name in (*NUMBERS, *RATINGS):
        if name in RATINGS and not cells.get(name):
            continue
        low = {"undos": "0 or more", "motions": "0 or more"}.get(name, "more than 0")
        value = _number(cells[name])
        good = 0 < value < _LARGEST or (value == 0 and low.startswith("0"))
        if name in RATINGS:
            low, good = "a rating", abs(value) < _LARGEST
        if not good:
            faults.append(f"{name}: expected {_wanted(low)}, got {cells[name]!r}")
        numbers[name] = value
    if not faults and numbers["path_length"] < numbers["optimal_length"]:
        faults.append(
            f"path_length {numbers['path_length']:g} is shorter than the shortest way,"
            f" {numbers['optimal_length']:g} (optimal_length)"
        )
    if faults:
        raise ValueError(*faults)
    person, task, display = (cells[name] for name in NAMES)
    optimal, path, undos, motions, seconds = (numbers[name] for name in NUMBERS)
    ratings = {name: numbers[name] for name in RATINGS if name in numbers}
    return Trial(person, task, display, optimal, path, undos, motions, seconds, ratings, line)


def _wanted(low: str) -> str:
    return "a number" if low == "a rating" else f"a number, {low}"


def _number(text: str) -> float:
    """A number, not a number for anything else."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan


def _contradictions(path: Path, trials: Sequence[Trial]) -> Iterator[Problem]:
    """Trials that are there twice, and tasks of which the shortest way changes."""
    seen: dict[tuple[str, str, str], int] = {}
    lengths: dict[str, Trial] = {}
    for trial in trials:
        key = (trial.person, trial.task, trial.display)
        if key in seen:
            words = (
                f"{trial.person} has done task {trial.task} on {trial.display} already, on line {seen[key]}"
            )
            yield Problem(words, file=str(path), line=trial.line)
        seen.setdefault(key, trial.line)
        first = lengths.setdefault(trial.task, trial)
        if first.optimal_length != trial.optimal_length:
            words = (
                f"optimal_length of task {trial.task} is {trial.optimal_length:g} here and"
                f" {first.optimal_length:g} on line {first.line}"
            )
            yield Problem(words, file=str(path), line=trial.line)
