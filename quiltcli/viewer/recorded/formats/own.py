"""CSV with named columns: `time` (seconds) or `frame`, `x, y, z`, and how the head is turned if it says.

Cells are separated by commas, semicolons (then with decimal commas, if there are commas), tabs or
blanks. A file without a line of names takes them from the job's `columns`.
"""

from __future__ import annotations

import numpy as np

from quiltcli.errors import Problem, ViewerError, raise_all
from quiltcli.job import RecordedSpec
from quiltcli.job.model import suggest
from quiltcli.viewer.recorded import columns
from quiltcli.viewer.recorded.tables import Dialect, dialect_of, read_rows, separator_problem, take_lines
from quiltcli.viewer.recorded.take import Y_UP, Recording, wrong

_SKIPPED = ("-", "_", "")


def read_own(spec: RecordedSpec) -> Recording:
    """Samples of a CSV file with named columns.

    Raises:
        ViewerError: columns are missing or contradict one another, or a cell is no number.
    """
    lines = take_lines(spec.file)
    dialect = dialect_of(lines)
    if problem := separator_problem(spec.file, lines, dialect):
        raise ViewerError(problem)
    at = _first_line(lines)
    has_header = at < len(lines) and _is_header(dialect.cells(lines[at]))
    if has_header:
        names = [columns.full_name(cell) for cell in dialect.cells(lines[at])]
    else:
        names = [columns.full_name(name) for name in spec.columns or ()]
    if not names:
        words = f"{spec.file} has no line of names (state columns, such as [time, x, y, z, qx, qy, qz, qw])"
        raise ViewerError(spec.source.problem("columns", words))
    if has_header and spec.columns is not None:
        words = f"{spec.file} names its columns itself, in line {at + 1} (leave columns out)"
        raise ViewerError(spec.source.problem("columns", words))
    return read_named(spec, lines, names, dialect, at + has_header)


def read_named(
    spec: RecordedSpec, lines: list[str], names: list[str], dialect: Dialect, first: int
) -> Recording:
    """Samples of the lines of a table from `first` on, whose columns have these names."""
    raise_all(ViewerError, list(_name_problems(spec, names, first)))
    wanted = [name for name in columns.NAMES if name in names]
    # The time comes first: it alone must not be blank.
    wanted.sort(key=lambda name: name != "time")
    if "time" in wanted and "frame" in wanted:
        wanted.remove("frame")
    clock = wanted[0] in ("time", "frame")
    rows = read_rows(
        spec.file,
        lines[first:],
        [(names.index(name), name) for name in wanted],
        dialect,
        first=first + 1,
        width=len(names),
        needed=int(clock),
    )
    if not len(rows.values):
        raise wrong(spec.file, "holds no samples")
    axes = spec.axis_map if spec.axis_map is not None else Y_UP
    rotations, is_camera = columns.rotations_of(wanted, rows.values, spec.rotation_order, axes)
    left = [name for name in names if name not in columns.NAMES and name not in _SKIPPED]
    return Recording(
        subject="head",
        positions=np.stack([rows.values[:, wanted.index(name)] for name in columns.EYE], axis=1),
        rotations=rotations,
        times=rows.values[:, 0] if wanted[0] == "time" else None,
        frames=rows.values[:, 0] if wanted[0] == "frame" else None,
        lines=rows.lines,
        is_camera=is_camera,
        notices=(f"columns left out: {', '.join(left[:12])}",) if left else (),
    )


def _first_line(lines: list[str]) -> int:
    """Index of the first line that is neither blank nor a comment."""
    good = (k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#"))
    return next(good, len(lines))


def _is_header(cells: list[str]) -> bool:
    return bool(cells) and cells[0][:1].isalpha() and cells[0].lower() not in ("nan", "inf")


def _name_problems(spec: RecordedSpec, names: list[str], line: int) -> list[Problem]:
    """What is wrong with the names of the columns."""

    def problem(words: str) -> Problem:
        if spec.columns is not None:
            return spec.source.problem("columns", words)
        return Problem(words, str(spec.file), line, 1)

    found = [problem(f"column {name!r} stands twice") for name in columns.NAMES if names.count(name) > 1]
    unknown = [name for name in names if name not in columns.NAMES and name not in _SKIPPED]
    for name in columns.missing_names(names):
        near = next((other for other in unknown if suggest(other, [name])), "")
        hint = f" (is it {near!r}?)" if near else ""
        found.append(problem(f"there is no column {name!r}{hint}"))
    turns = columns.turn_groups(names)
    if len(turns) > 1:
        found.append(problem(f"both {turns[0][0]} and {turns[1][0]} say how the head is turned"))
    angles = (name for name in ("yaw", "pitch", "roll", "rx", "ry", "rz") if name in names)
    found += [problem(f"column {name!r} has no unit (name it {name}_deg or {name}_rad)") for name in angles]
    return found
