"""CSV files of OptiTrack Motive, format versions 1.2x.

The first line is key,value pairs; then rows say of each column its type (Rigid Body, Bone, Marker …),
name, id, whether it is rotation or position, and at last its axis, in the row that begins with `Frame`.
A lost sample is a row of blank cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.job import RecordedSpec
from quiltcli.job.recorded import ROTATION_ORDERS
from quiltcli.viewer.recorded.columns import angles_to_rotations
from quiltcli.viewer.recorded.tables import Dialect, dialect_of, number_of, read_rows, take_lines
from quiltcli.viewer.recorded.take import Y_UP, Recording, choose, wrong

_TYPES = ("rigid body", "bone", "rigid body marker", "marker", "bone marker")
_LENGTHS = {"meters": 1.0, "centimeters": 0.01, "millimeters": 0.001, "m": 1.0, "cm": 0.01, "mm": 0.001}
_HEAD_ROWS = 40


@dataclass(frozen=True)
class _Asset:
    """A thing that was tracked: its type and name, and the columns of its position and rotation."""

    kind: str
    name: str
    position: tuple[int, ...]
    rotation: tuple[int, ...]
    axes: str


def read_motive(spec: RecordedSpec) -> Recording:
    """Samples of one rigid body, bone or marker of a Motive CSV.

    Raises:
        ViewerError: the rows above the samples are not Motive's, or the subject is not told.
    """
    lines = take_lines(spec.file)
    dialect = dialect_of(lines)
    at = _axis_row(lines, dialect)
    if at is None:
        raise wrong(spec.file, "has no row that begins with Frame (expected a CSV file of Motive)")
    facts = _facts(dialect.cells(lines[0])) if at else {}
    asset = _chosen(spec, _assets([dialect.cells(line) for line in lines[:at]], dialect.cells(lines[at])))
    timed = dialect.cells(lines[at])[1].lower().startswith("time")
    wanted = [(1, "time") if timed else (0, "frame")]
    wanted += [(k, f"{asset.name} position") for k in asset.position]
    wanted += [(k, f"{asset.name} rotation") for k in asset.rotation]
    rows = read_rows(spec.file, lines[at + 1 :], wanted, dialect, first=at + 2, needed=1)
    if not len(rows.values):
        raise wrong(spec.file, "holds no samples")
    metres = _LENGTHS.get(facts.get("length units", "").lower())
    rate = number_of(facts.get("export frame rate") or facts.get("capture frame rate") or "")
    return Recording(
        subject=asset.name,
        positions=rows.values[:, 1:4],
        rotations=_rotations(asset, rows.values[:, 4:]),
        times=rows.values[:, 0] if timed else None,
        frames=None if timed else rows.values[:, 0] + 1,  # Motive counts from 0
        lines=rows.lines,
        metres=metres,
        settled=metres is not None,
        axes=Y_UP,
        rate=rate if rate is not None and rate > 0 else None,
    )


def is_motive(lines: Sequence[str]) -> bool:
    """Whether these lines begin a CSV file of Motive."""
    dialect = dialect_of(lines)
    at = _axis_row(lines, dialect)
    return at is not None and (lines[0].lower().startswith("format version") or at >= 3)


def _axis_row(lines: Sequence[str], dialect: Dialect) -> int | None:
    """Index of the row of axes: the one that begins with `Frame` and a time."""
    for k, line in enumerate(lines[:_HEAD_ROWS]):
        cells = [cell.lower() for cell in dialect.cells(line)[:2]]
        if len(cells) == 2 and cells[0] == "frame" and cells[1].startswith("time"):
            return k
    return None


def _facts(cells: Sequence[str]) -> dict[str, str]:
    """Key and value of the pairs in the first line."""
    return {key.lower(): value for key, value in zip(cells[::2], cells[1::2], strict=False)}


def _assets(above: list[list[str]], axes: list[str]) -> list[_Asset]:
    """Everything that has a position, in the order of the file."""
    width = len(axes)
    rows = [row + [""] * (width - len(row)) for row in above]
    kinds = next((row for row in rows if any(cell.lower() in _TYPES for cell in row[2:])), [""] * width)
    labelled = [row for row in rows if row[1].lower() == "name"]
    after = rows[rows.index(kinds) + 1 :] if kinds in rows else []
    names = (labelled or after or [[""] * width])[0]
    what = rows[-1] if rows else [""] * width
    found: dict[tuple[str, str], dict[tuple[str, str], int]] = {}
    for k in range(2, width):
        role, axis = what[k].lower(), axes[k].lower()
        if role in ("position", "rotation") and axis in ("x", "y", "z", "w"):
            parts = found.setdefault((kinds[k].lower(), names[k]), {})
            parts.setdefault((role, axis), k)
    assets = []
    for (kind, name), parts in found.items():
        position = tuple(parts[("position", axis)] for axis in "xyz" if ("position", axis) in parts)
        turn = [axis for role, axis in parts if role == "rotation"]
        order = "xyzw" if "w" in turn else "".join(turn)
        whole = sorted(turn) in (["w", "x", "y", "z"], ["x", "y", "z"])
        rotation = tuple(parts[("rotation", axis)] for axis in order) if whole else ()
        if len(position) == 3:
            assets.append(_Asset(kind, name, position, rotation, order))
    return assets


def _chosen(spec: RecordedSpec, assets: list[_Asset]) -> _Asset:
    """The asset asked for; bodies go before bones, and bones before markers of the same name."""
    assets = sorted(assets, key=lambda asset: _rank(asset.kind))
    bodies = [asset for asset in assets if asset.kind == "rigid body"]
    named = {asset.name: asset for asset in reversed(assets)}
    among = bodies if bodies and (spec.subject is None or len(bodies) == len(assets)) else named.values()
    listed = sorted(among, key=lambda asset: _rank(asset.kind))
    what = "rigid bodies" if among is bodies else "rigid bodies, bones and markers"
    return listed[choose(spec, [asset.name for asset in listed], what)]


def _rank(kind: str) -> int:
    return _TYPES.index(kind) if kind in _TYPES else len(_TYPES)


def _rotations(asset: _Asset, values: FloatArray) -> FloatArray | None:
    """Rotations (N, 4), from quaternions, or degrees about axes that turn along, in the columns' order."""
    if not asset.rotation:
        return None
    if asset.axes == "xyzw":
        return values[:, :4]
    order = asset.axes[::-1]
    assert order in ROTATION_ORDERS
    by_axis = np.stack([values[:, asset.axes.index(axis)] for axis in "xyz"], axis=1)
    return angles_to_rotations(np.radians(by_axis), order)
