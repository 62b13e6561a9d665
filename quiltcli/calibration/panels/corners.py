"""Facets from measured corners: a total station's list, or a tape's."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.calibration.panels.display_files import mesh_display, moved_display
from quiltcli.calibration.panels.start import middles_of
from quiltcli.calibration.pattern import corner_letter
from quiltcli.display import Facets
from quiltcli.errors import JobError, Problem, raise_all
from quiltcli.formats.inputs import read_input
from quiltcli.geometry import FloatArray
from quiltcli.job import DisplayFile
from quiltcli.job.lengths import UNITS

_MOST_TURN = 40  # degrees; no panel is put up so much awry
_MODELS = 64  # facets that may be what others are held against
COLUMNS = ("facet", "corner", "x", "y", "z")


@dataclass(frozen=True)
class Measured:
    """A display whose corners were measured.

    Attributes:
        files: texts of the display's files; that of the display file itself under an empty name.
        residual: (C,) how far each corner is from where the facet has it now, metres.
    """

    files: dict[str, str]
    residual: FloatArray


def read_corners(path: Path, facets: Facets, units: str = "m") -> FloatArray:
    """World metres (C, 3) of all corners of a display, in the order of its own, from a CSV table.

    A row has facet (its id or its name), corner (1 for the first of the mesh face or panel, or A, as the
    pattern `id` writes beside it), x, y, z.

    Raises:
        JobError: corners that are missing, named twice, on no facet, or no numbers.
    """
    text = read_input(path, JobError, "a CSV").decode("utf-8-sig", "replace")
    rows = list(csv.reader(io.StringIO(text), delimiter=";" if ";" in text.partition("\n")[0] else ","))
    if not rows or [name.strip().lower() for name in rows[0]] != list(COLUMNS):
        found = ", ".join(rows[0])[:60] if rows else "nothing"
        raise JobError(
            Problem(f"expected a first row {', '.join(COLUMNS)}, got {found}", file=str(path), line=1)
        )
    corners = np.full(facets.corners.shape, np.nan)
    problems: list[Problem] = []
    for line, row in enumerate(rows[1:], 2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            at, point = _row(row, facets)
        except ValueError as error:
            problems.append(Problem(str(error), file=str(path), line=line))
            continue
        if not np.isnan(corners[at, 0]):
            words = f"facet {row[0].strip()} has corner {row[1].strip()} already"
            problems.append(Problem(words, file=str(path), line=line))
        corners[at] = point
    raise_all(JobError, problems[:20])
    raise_all(JobError, list(_missing(corners, facets, path))[:20])
    return corners * UNITS[units]


def fit_corners(spec: DisplayFile, facets: Facets, corners: FloatArray, mesh: str) -> Measured:
    """The display with its corners where they were measured.

    A panel keeps its size and is moved as a rigid rectangle (Kabsch); a face of a mesh becomes the polygon
    of its corners, dropped onto the plane that fits them best.
    """
    start = facets.corner_start
    middles = middles_of(facets.corners, start)
    measured = middles_of(corners, start)
    turns = np.empty((facets.count, 3, 3))
    fitted = np.empty_like(corners)
    for k in range(facets.count):
        own = slice(start[k], start[k + 1])
        should, are = facets.corners[own] - middles[k], corners[own] - measured[k]
        turns[k] = _rotation(should, are)
        fitted[own] = should @ turns[k].T + measured[k]
        if spec.panels is None:
            normal = np.linalg.svd(are)[2][-1]
            fitted[own] = corners[own] - (are @ normal)[:, None] * normal
    residual = np.linalg.norm(corners - fitted, axis=1)
    if spec.panels is not None:
        return Measured(moved_display(spec, facets, turns, middles, measured - middles, mesh), residual)
    up = (turns @ -facets.dv[..., None])[..., 0]
    up /= np.linalg.norm(up, axis=1)[:, None]
    return Measured(mesh_display(spec, facets, fitted, up, mesh), residual)


def doubtful_corners(path: Path, facets: Facets, corners: FloatArray, units: str) -> Iterator[Problem]:
    """What shows that a table is not of this display: another unit, letters exchanged, another facet.

    A facet that was measured is as large as it should be, but for a quarter, and each of its corners is
    nearer to its own place than halfway to another's. Shapes are compared, never places: a survey has
    axes of its own.

    Args:
        path: the table's file, for the problems.
        facets: the display as it should be.
        corners: (C, 3) where its corners were measured, metres.
        units: what the table is taken to be measured in.
    """
    start = facets.corner_start
    counts = np.diff(start)
    should = facets.corners - np.repeat(middles_of(facets.corners, start), counts, axis=0)
    are = corners - np.repeat(middles_of(corners, start), counts, axis=0)
    sizes = [np.sqrt(np.add.reduceat((points * points).sum(axis=1), start[:-1])) for points in (are, should)]
    share = sizes[0] / sizes[1]
    most = max(float(np.median(share)), np.finfo(float).tiny)
    likely = min(UNITS, key=lambda unit: abs(math.log(most * UNITS[unit] / UNITS[units])))
    if likely != units and not 0.8 < most < 1.25 and 0.8 < most * UNITS[likely] / UNITS[units] < 1.25:
        words = f"its facets are {most:.4g} × as large as the display's"
        yield Problem(f"{words}, taken in {units} (is it measured in {likely}? --units)", file=str(path))
        return
    for k, name in enumerate(facets.names):
        own = slice(start[k], start[k + 1])
        called = f"facet {k + 1}" + (f" ({name})" if name else "")
        if not 0.8 < share[k] < 1.25:
            words = f"{called} is {share[k]:.4g} × as large as in the display (expected about its size)"
            yield Problem(words, file=str(path))
            continue
        fitted = should[own] @ _rotation(should[own], are[own]).T
        off = np.linalg.norm(are[own] - fitted, axis=1)
        apart = np.linalg.norm(fitted[:, None] - fitted[None, :], axis=2)
        nearest = np.where(apart > 0, apart, np.inf).min(axis=1)
        if (off > nearest / 2).any():
            worst = int((off / nearest).argmax())
            yield Problem(
                f"the corners of {called} do not make its figure: {corner_letter(worst)} is"
                f" {1000 * off[worst]:.4g} mm from where the others put it"
                " (are two exchanged? quilt pattern --kind id shows their letters)",
                file=str(path),
            )


def turned_facets(facets: Facets, corners: FloatArray) -> Iterator[str]:
    """Facets whose corners make their figure, but turned by over 40° against most others.

    That may be so; but a square fits as well when its letters begin at another corner, or run backwards.
    """
    start = facets.corner_start
    middles, measured = middles_of(facets.corners, start), middles_of(corners, start)
    turns = np.empty((facets.count, 9))
    for k in range(facets.count):
        own = slice(start[k], start[k + 1])
        turns[k] = _rotation(facets.corners[own] - middles[k], corners[own] - measured[k]).ravel()
    # The sum of a rotation's products with another is its trace, 1 + 2 cos of the angle between the two.
    angles = np.degrees(np.arccos(np.clip((turns @ turns[:_MODELS].T - 1) / 2, -1, 1)))
    model = int((angles < _MOST_TURN).sum(axis=0).argmax())
    for k in np.flatnonzero(angles[:, model] > _MOST_TURN).tolist():
        called = f"facet {k + 1}" + (f" ({facets.names[k]})" if facets.names[k] else "")
        yield (
            f"{called} is turned by {angles[k, model]:.0f}° against facet {model + 1}, beyond"
            " what the display has (are its corners lettered as quilt pattern --kind id shows them?)"
        )


def corner_table(facets: Facets, residual: FloatArray) -> Iterator[str]:
    """A line a facet: how far its corners are from the flat figure that was made of them."""
    yield "facet  name          corners   rms mm   most mm"
    start = facets.corner_start
    for k, name in enumerate(facets.names):
        own = 1000 * residual[start[k] : start[k + 1]]
        rms = math.sqrt(float((own * own).mean()))
        yield f"{k + 1:>5}  {name[:12]:<12}  {own.size:>7}  {rms:7.2f}   {own.max():7.2f}"


def _row(row: list[str], facets: Facets) -> tuple[int, list[float]]:
    """The corner's place among all, and where it was measured; ValueError says what is wrong."""
    cells = [cell.strip() for cell in row]
    if len(cells) != len(COLUMNS):
        raise ValueError(f"expected {len(COLUMNS)} values, got {len(cells)}")
    if cells[0] in facets.names:
        facet = facets.names.index(cells[0])
    elif cells[0].isascii() and cells[0].isdigit() and 1 <= int(cells[0]) <= facets.count:
        facet = int(cells[0]) - 1
    else:
        raise ValueError(
            f"there is no facet {cells[0]!r} (expected a name, or an id from 1 to {facets.count})"
        )
    count = int(facets.corner_start[facet + 1] - facets.corner_start[facet])
    known = {name: k for k in range(count) for name in (str(k + 1), corner_letter(k))}
    if cells[1].upper() not in known:
        raise ValueError(f"facet {cells[0]} has no corner {cells[1]!r} (expected 1 to {count}, or a letter)")
    try:
        point = [float(cell.replace(",", ".")) for cell in cells[2:]]
    except ValueError:
        point = []
    if len(point) != 3 or not all(abs(value) < 1e9 for value in point):
        raise ValueError(f"expected numbers x, y, z, got {', '.join(cells[2:])}")
    return int(facets.corner_start[facet]) + known[cells[1].upper()], point


def _missing(corners: FloatArray, facets: Facets, path: Path) -> Iterator[Problem]:
    start = facets.corner_start
    for k in range(facets.count):
        gone = np.flatnonzero(np.isnan(corners[start[k] : start[k + 1], 0]))
        if gone.size:
            names = ", ".join(corner_letter(int(at)) for at in gone)
            yield Problem(f"corners {names} of facet {k + 1} are missing", file=str(path))


def _rotation(should: FloatArray, are: FloatArray) -> FloatArray:
    """The rotation (3, 3) that takes points (n, 3) about the origin nearest to others (Kabsch)."""
    left, _, right = np.linalg.svd(are.T @ should)
    turn = np.eye(3)
    turn[2, 2] = np.sign(np.linalg.det(left @ right))
    result: FloatArray = left @ turn @ right
    return result
