"""The places of a layout's facets as columns of numbers in a file beside the layout, for thousands of them.

YAML that people read has a dozen lines a facet; of ten thousand facets nobody reads it, and reading it takes
longer than drawing them. Their numbers stand in a NumPy archive then, an array a key.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import JobError, Problem, first_of, raise_all
from quiltcli.formats.npz import npz_bytes, read_npz
from quiltcli.geometry import offsets
from quiltcli.job.model import FARTHEST, LARGEST_WHOLE

COLUMNS = {
    "id": "i",
    "page": "i",
    "size": "i",
    "quilt_from_facet": "f",
    "origin": "f",
    "du": "f",
    "dv": "f",
    "corners": "i",
    "polygon": "f",
}
"""The arrays, `i` of whole numbers and `f` of any; `corners` tells how many rows of `polygon` a facet has."""

_SHAPES = {"id": (), "page": (), "size": (2,), "quilt_from_facet": (2, 3), "origin": (3,), "du": (3,),
           "dv": (3,), "corners": ()}  # fmt: skip
_MOST_PIXELS = 1_000_000
_MOST_PROBLEMS = 50

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class ColumnLines:
    """Where the numbers of facets stand: in an array of a file, by row."""

    path: Path

    def problem(self, key: Sequence[str | int], message: str) -> Problem:
        """A problem with the file and the row filled in; the key is that of a layout's `facets`."""
        parts = list(key)
        if len(parts) > 1 and parts[0] == "facets":
            name = f"{parts[2]}[{parts[1]}]" if len(parts) > 2 else f"[{parts[1]}]"
            return Problem(message, str(self.path), key=name)
        return Problem(message, str(self.path), key=".".join(str(part) for part in parts))


def columns_bytes(columns: Columns) -> tuple[bytes, str]:
    """The file of some columns, and its SHA-256, hexadecimal."""
    data = npz_bytes({name: columns[name] for name in COLUMNS})
    return data, hashlib.sha256(data).hexdigest()


def read_columns(path: Path, pages: int, sha256: str | None) -> Columns:
    """The columns of a file, checked as the facets of a YAML file are.

    Args:
        path: the file.
        pages: how many pages the layout has.
        sha256: hash of the file, when the layout says it.

    Raises:
        JobError: with every problem of the file.
    """
    columns, data = read_npz(path, COLUMNS, JobError)
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        words = (
            "is not the file that the layout was written with: their hashes differ (take columns_sha256 out"
        )
        raise JobError(Problem(f"{words} of the layout if it was changed on purpose)", str(path)))
    lines = ColumnLines(path)
    raise_all(JobError, list(_odd_shapes(columns, lines)))
    problems = [
        lines.problem(("facets", row, key), message) for key, row, message in _odd_rows(columns, pages)
    ]
    raise_all(JobError, first_of(problems, _MOST_PROBLEMS, str(path)))
    return columns


def _odd_shapes(columns: Columns, lines: ColumnLines) -> Iterator[Problem]:
    count = columns["id"].shape[0] if columns["id"].ndim == 1 else 0
    if count == 0:
        yield lines.problem(("id",), "has no facets (expected one number a facet, one or more)")
        return
    for name, rest in _SHAPES.items():
        shape, expected = columns[name].shape, (count, *rest)
        if shape != expected:
            yield lines.problem((name,), f"has the shape {shape} (expected {expected}, a row for each id)")
    corners, polygon = columns["corners"], columns["polygon"].shape
    if corners.shape != (count,):
        return
    # As floats: a sum of whole numbers may overflow.
    total = float(corners.astype(np.float64).sum())
    if polygon != (total, 2):
        yield lines.problem(
            ("polygon",), f"has the shape {polygon} (expected ({total:.0f}, 2), as corners says)"
        )


def _odd_rows(columns: Columns, pages: int) -> Iterator[tuple[str, int, str]]:
    """What is wrong with single facets: key, row and words."""
    ids, page, corners = columns["id"], columns["page"], columns["corners"]
    for row in np.flatnonzero((ids < 1) | (ids > LARGEST_WHOLE)).tolist():
        yield "id", row, f"{ids[row]} (expected a whole number from 1)"
    order = np.argsort(ids, kind="stable")
    for at in np.flatnonzero(np.diff(ids[order]) == 0).tolist():
        row = int(order[at + 1])
        yield "id", row, f"facet {ids[row]} already has a place, at id[{order[at]}]"
    for row in np.flatnonzero((page < 1) | (page > pages)).tolist():
        yield "page", row, f"there is no page {page[row]} (the layout has {pages} page{'s' * (pages > 1)})"
    size = columns["size"]
    for row in np.flatnonzero(((size < 1) | (size > _MOST_PIXELS)).any(axis=1)).tolist():
        yield "size", row, f"{size[row].tolist()} (expected 1 to {_MOST_PIXELS} pixels a side)"
    for row in np.flatnonzero(corners < 3).tolist():
        yield "corners", row, f"{corners[row]} (a polygon has at least 3)"
    yield from _odd_numbers(columns)


def _odd_numbers(columns: Columns) -> Iterator[tuple[str, int, str]]:
    count = len(columns["id"])
    for name in ("quilt_from_facet", "origin", "du", "dv"):
        good = (np.abs(columns[name]) <= FARTHEST).reshape(count, -1).all(axis=1)
        for row in np.flatnonzero(~good).tolist():
            yield name, row, f"has a number that is not finite, or beyond {FARTHEST:.0e}"
    if (columns["corners"] >= 0).all():
        bad = np.flatnonzero(~(np.abs(columns["polygon"]) <= FARTHEST).all(axis=1))
        rows = np.searchsorted(offsets(columns["corners"]), bad, side="right") - 1
        for row in np.unique(rows).tolist():
            yield "polygon", row, f"has a number that is not finite, or beyond {FARTHEST:.0e}"
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are told above
        for name in ("du", "dv"):
            for row in np.flatnonzero((columns[name] ** 2).sum(axis=1) <= 1e-18).tolist():
                yield name, row, "has no length (expected a step to the next pixel, metres)"
        (a, b), (c, d) = columns["quilt_from_facet"][:, :, :2].transpose(1, 2, 0)
        for row in np.flatnonzero(a * d == b * c).tolist():
            yield "quilt_from_facet", row, "flattens the facet (its determinant is 0)"
