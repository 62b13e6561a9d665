"""CSV files of Vicon Tracker, Nexus and Shogun: tables, one below another.

They are of objects, segments or trajectories. Each has a line with its kind, one with the rate, then
subjects, axes and units, and ends with a blank line. What three angles R mean differs from one program
to the next: they are read where it is stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.job import RecordedSpec
from quiltcli.job.lengths import UNITS
from quiltcli.viewer.recorded.columns import angles_to_rotations
from quiltcli.viewer.recorded.tables import Dialect, dialect_of, number_of, read_rows, take_lines
from quiltcli.viewer.recorded.take import Z_UP, Recording, choose, wrong

KINDS = ("objects", "segments", "trajectories", "global angle (quaternion)")


@dataclass(frozen=True)
class _Subject:
    """One subject of a table: its name, its columns by axis, and where the table's samples begin and end."""

    name: str
    columns: dict[str, int]
    first: int
    last: int
    rate: float | None
    unit: str
    turn_unit: str


def read_vicon(spec: RecordedSpec) -> Recording:
    """Samples of one subject of a Vicon CSV.

    Raises:
        ViewerError: there is no table of Vicon's, or the subject is not told.
    """
    lines = take_lines(spec.file)
    dialect = dialect_of(lines)
    subjects = [subject for at in _tables(lines) for subject in _subjects(lines, at, dialect)]
    if not subjects:
        raise wrong(spec.file, "holds no table of positions (expected Objects, Segments or Trajectories)")
    subject = subjects[choose(spec, [subject.name for subject in subjects], "subjects")]
    turns = [name for name in ("RX", "RY", "RZ", "RW") if name in subject.columns]
    names = ["TX", "TY", "TZ", *turns] if "TX" in subject.columns else ["X", "Y", "Z"]
    wanted = [(0, "Frame"), *((subject.columns[name], name) for name in names)]
    body = lines[subject.first : subject.last]
    rows = read_rows(spec.file, body, wanted, dialect, first=subject.first + 1, needed=1)
    if not len(rows.values):
        raise wrong(spec.file, f"holds no samples of {subject.name}")
    rotations = _rotations(spec, rows.values[:, 4:], subject.turn_unit)
    notices: tuple[str, ...] = ()
    if turns and rotations is None:
        notices = ("its angles were left out, as their meaning is not stated (rotation_order)",)
    return Recording(
        subject=subject.name,
        positions=rows.values[:, 1:4],
        rotations=rotations,
        times=None,
        frames=rows.values[:, 0],
        lines=rows.lines,
        metres=UNITS.get(subject.unit),
        settled=subject.unit in UNITS,
        axes=Z_UP,
        rate=subject.rate,
        notices=notices,
    )


def is_vicon(lines: Sequence[str]) -> bool:
    """Whether these lines begin a CSV file of Vicon's."""
    return next(iter(_tables(lines[:10])), None) is not None


def _tables(lines: Sequence[str]) -> list[int]:
    """Index of the first line of every table with positions."""
    found = []
    for k, line in enumerate(lines[:-4] if len(lines) > 4 else ()):
        if line[:1].isalpha() and line.strip(" ,;\t\r").lower() in KINDS:
            found.append(k)
    return found


def _subjects(lines: Sequence[str], at: int, dialect: Dialect) -> list[_Subject]:
    """The subjects of the table that begins at a line."""
    rate = number_of(dialect.cells(lines[at + 1])[0])
    names, axes = dialect.cells(lines[at + 2]), dialect.cells(lines[at + 3])
    units = dialect.cells(lines[at + 4])
    names += [""] * (len(axes) - len(names))
    units += [""] * (len(axes) - len(units))
    first = at + 5
    # A blank line, or one of empty cells, ends the table.
    ends = (k for k in range(first, len(lines)) if not lines[k].strip(" ,;\t"))
    last = next(ends, len(lines))
    starts = [k for k in range(2, len(axes)) if names[k]]
    found = []
    for start, stop in pairwise([*starts, len(axes)]):
        columns = {axes[k].upper(): k for k in reversed(range(start, stop)) if axes[k]}
        place = columns.get("TX", columns.get("X"))
        if place is None:
            continue
        turn = units[columns["RX"]].lower() if "RX" in columns else ""
        good = rate if rate is not None and rate > 0 else None
        found.append(_Subject(names[start], columns, first, last, good, units[place].lower(), turn))
    return found


def _rotations(spec: RecordedSpec, values: FloatArray, unit: str) -> FloatArray | None:
    """Rotations (N, 4), or None where there are none or nobody says what they mean."""
    if values.shape[1] == 4:
        return values
    if values.shape[1] != 3 or spec.rotation_order is None:
        return None
    return angles_to_rotations(np.radians(values) if unit == "deg" else values, spec.rotation_order)
