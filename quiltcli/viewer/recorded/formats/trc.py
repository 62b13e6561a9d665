"""TRC files of markers: a line of keys, one of values, names over every third column, X1 Y1 Z1 …, tabs."""

from __future__ import annotations

from quiltcli.job import RecordedSpec
from quiltcli.job.lengths import UNITS
from quiltcli.viewer.recorded.tables import Dialect, read_rows, take_lines
from quiltcli.viewer.recorded.take import Recording, choose, wrong

_TAB = Dialect("\t")


def read_trc(spec: RecordedSpec) -> Recording:
    """Samples of one marker of a TRC file: places alone. Which way is up is not in the file.

    Raises:
        ViewerError: the lines above the samples are not those of a TRC file, or the marker is not told.
    """
    lines = take_lines(spec.file)
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise wrong(spec.file, "expected a line PathFileType and four more above the samples", 1, 1)
    facts = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    at = next((k for k, line in enumerate(lines[:10]) if line.startswith("Frame#")), None)
    if at is None:
        raise wrong(spec.file, "has no line that begins with Frame#")
    markers = [(k, name) for k, name in enumerate(_TAB.cells(lines[at])) if k >= 2 and name]
    start, name = markers[choose(spec, [name for _, name in markers], "markers")]
    wanted = [(1, "Time"), *((start + k, f"{name} {axis}") for k, axis in enumerate("XYZ"))]
    rows = read_rows(spec.file, lines[at + 2 :], wanted, _TAB, first=at + 3, needed=1)
    if not len(rows.values):
        raise wrong(spec.file, "holds no samples")
    unit = facts.get("Units", "").lower()
    return Recording(
        subject=name,
        positions=rows.values[:, 1:4],
        rotations=None,
        times=rows.values[:, 0],
        lines=rows.lines,
        metres=UNITS.get(unit),
        settled=unit in UNITS,
    )
