"""A layout file as columns of numbers.

What this program writes has one line a key and the same eight keys for every facet. Such lines are
read as they stand, columns at a time, which takes a hundredth of the time that YAML takes. A file in
any other form, or with anything in it that is not right, is read as YAML, which says what is wrong
and where. The facets of a large layout stand as columns in a file of their own.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from quiltcli.errors import JobError, Problem
from quiltcli.formats.yaml.source import Source, parse_text
from quiltcli.formats.yaml.syntax import read_yaml_text
from quiltcli.geometry import FloatArray, Int32Array, IntArray, offsets, some_rows
from quiltcli.job.layout import LayoutFile
from quiltcli.job.layout_columns import ColumnLines, Columns, read_columns
from quiltcli.job.load import layout_of, load_layout_file

FACET_KEYS = ("id", "page", "size", "quilt_from_facet", "origin", "du", "dv", "polygon")
"""Keys of a facet, in the order in which they are written."""

_PREFIXES = tuple(("  " if at else "- ") + f"{key}: " for at, key in enumerate(FACET_KEYS))
_NUMBERS = re.compile(r"[-+0-9eE., \[\]]*")
_MOST_PIXELS = 1_000_000


@dataclass(frozen=True, eq=False)
class Places:
    """Where F facets lie on the pages of a quilt.

    Attributes:
        facet: (F,) facet ids, 1-based.
        page: (F,) 0-based page, −1 for a facet that has no place in the quilt.
        size: (F, 2) facet raster width and height, pixels.
        quilt_from_facet: (F, 2, 3) affine maps from facet pixels to pixels of the page.
        origin: (F, 3) world position of the raster's top-left corner, metres.
        du: (F, 3) world step to the next facet pixel right, metres.
        dv: (F, 3) world step to the next facet pixel down, metres.
        corner_start: (F+1,) offsets into `polygon`.
        polygon: (C, 2) corners in facet pixels.
        pages: (G, 2) page width and height, pixels.
        padding: pixels kept free between facets.
    """

    facet: Int32Array
    page: Int32Array
    size: Int32Array
    quilt_from_facet: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    corner_start: IntArray
    polygon: FloatArray
    pages: Int32Array
    padding: int

    def outline(self, row: int) -> FloatArray:
        """Corners (n, 2) of one facet, in facet pixels."""
        return self.polygon[self.corner_start[row] : self.corner_start[row + 1]]

    def taken(self, rows: IntArray) -> Self:
        """Some of the facets, in this order, on the same pages."""
        start, corners = some_rows(self.corner_start, rows)
        return replace(
            self,
            facet=self.facet[rows],
            page=self.page[rows],
            size=self.size[rows],
            quilt_from_facet=self.quilt_from_facet[rows],
            origin=self.origin[rows],
            du=self.du[rows],
            dv=self.dv[rows],
            corner_start=start,
            polygon=self.polygon[corners],
        )


@dataclass(frozen=True, eq=False)
class LayoutTable(Places):
    """A validated layout file; the facets in the order of the file.

    Attributes:
        head: the file's other keys; of its facets it may have the first alone.
        source: finds lines in the file.
    """

    head: LayoutFile
    source: Source | LayoutLines | ColumnLines


@dataclass(frozen=True)
class LayoutLines:
    """Where keys of a layout file stand; the file is read for that only when a problem is to be told."""

    path: Path

    def problem(self, key: Sequence[str | int], message: str) -> Problem:
        """A problem with file, line, column and key filled in."""
        try:
            return load_layout_file(self.path).source.problem(key, message)
        except JobError:  # it has changed since
            return Problem(message, file=str(self.path))


def read_layout_table(path: Path | str) -> LayoutTable:
    """Read a layout file strictly.

    Raises:
        JobError: with every problem of the file.
    """
    path = Path(path)
    text = read_yaml_text(path)
    return _from_lines(text, path) or table_of(load_layout_file(path))


def places_sha256(places: Places) -> str:
    """Hash of where facets lie, hexadecimal: pages, rasters, maps and outlines of all that have a page."""
    digest = hashlib.sha256(b"quilt places 1")
    rows = np.flatnonzero(places.page >= 0)
    placed = places.taken(rows[np.argsort(places.facet[rows], kind="stable")])
    counts = np.diff(placed.corner_start)
    for whole in (placed.pages, placed.padding, counts, placed.facet, placed.page, placed.size):
        digest.update(np.ascontiguousarray(whole, dtype="<i8").tobytes())
    for exact in (placed.quilt_from_facet, placed.origin, placed.du, placed.dv, placed.polygon):
        digest.update(np.ascontiguousarray(exact, dtype="<f8").tobytes())
    return digest.hexdigest()


def table_of(spec: LayoutFile) -> LayoutTable:
    """Columns of a validated layout file.

    Raises:
        JobError: the columns stand in a file of their own, and that cannot be read or is wrong.
    """
    if spec.columns is not None:
        return _from_columns(spec, read_columns(spec.columns, len(spec.pages), spec.columns_sha256))
    columns = {key: [getattr(facet, key) for facet in spec.facets or ()] for key in FACET_KEYS}
    return _table(spec, spec.source, columns)


def columns_of(places: Places) -> Columns:
    """The columns of a file for the facets that have a page; see `quiltcli.job.layout_columns`."""
    placed = places.taken(np.flatnonzero(places.page >= 0))
    whole = {
        "id": placed.facet,
        "page": placed.page + 1,
        "size": placed.size,
        "corners": np.diff(placed.corner_start),
    }
    exact = {name: getattr(placed, name) for name in ("quilt_from_facet", "origin", "du", "dv", "polygon")}
    columns: Columns = {name: values.astype("<i4") for name, values in whole.items()}
    return columns | {name: values.astype("<f8") for name, values in exact.items()}


def _from_columns(head: LayoutFile, columns: Columns) -> LayoutTable:
    assert head.columns is not None
    return LayoutTable(
        head=head,
        source=ColumnLines(head.columns),
        facet=columns["id"].astype(np.int32),
        page=(columns["page"] - 1).astype(np.int32),
        size=columns["size"].astype(np.int32),
        quilt_from_facet=columns["quilt_from_facet"],
        origin=columns["origin"],
        du=columns["du"],
        dv=columns["dv"],
        corner_start=offsets(columns["corners"]),
        polygon=columns["polygon"],
        **_on_pages(head),
    )


def _on_pages(head: LayoutFile) -> dict[str, Any]:
    """What a table takes from the file's other keys."""
    return {
        "pages": np.array([page.size for page in head.pages], dtype=np.int32),
        "padding": head.padding,
    }


def _table(head: LayoutFile, source: Source | LayoutLines, columns: dict[str, list[Any]]) -> LayoutTable:
    polygons = columns["polygon"]
    corners = [corner for polygon in polygons for corner in polygon]
    return LayoutTable(
        head=head,
        source=source,
        facet=np.array(columns["id"], dtype=np.int32),
        page=np.array(columns["page"], dtype=np.int32) - 1,
        size=np.array(columns["size"], dtype=np.int32),
        quilt_from_facet=np.array(columns["quilt_from_facet"], dtype=np.float64),
        origin=np.array(columns["origin"], dtype=np.float64),
        du=np.array(columns["du"], dtype=np.float64),
        dv=np.array(columns["dv"], dtype=np.float64),
        corner_start=np.cumsum([0, *map(len, polygons)]),
        polygon=np.array(corners, dtype=np.float64),
        **_on_pages(head),
    )


def _from_lines(text: str, path: Path) -> LayoutTable | None:
    """The table of a file in the form this program writes, with nothing wrong; else None."""
    before, mark, after = text.removesuffix("\n").partition("\nfacets:\n")
    facets, other, packed = after.partition("\npacked:\n")
    lines = facets.split("\n")
    step = len(FACET_KEYS)
    if not mark or not text.endswith("\n") or len(lines) % step:
        return None
    columns: dict[str, list[Any]] = {}
    for at, (key, prefix) in enumerate(zip(FACET_KEYS, _PREFIXES, strict=True)):
        values = _column(lines[at::step], prefix)
        if values is None:
            return None
        columns[key] = values
    try:
        # The first facet stands for all: what is before and behind them is read as always.
        head = layout_of(parse_text(before + mark + "\n".join(lines[:step]) + other + packed, path))
        table = _table(head, LayoutLines(path), columns)
    except (JobError, ValueError, TypeError, OverflowError):
        return None
    return table if _sound(table, columns) else None


def _column(lines: Sequence[str], prefix: str) -> list[Any] | None:
    """What stands behind a key in the lines of all facets, all of it numbers; None when it does not."""
    if not all(line.startswith(prefix) for line in lines):
        return None
    text = ",".join([line[len(prefix) :] for line in lines])
    if not _NUMBERS.fullmatch(text):
        return None
    try:
        values: list[Any] = json.loads(f"[{text}]")
    except ValueError:
        return None
    return values if len(values) == len(lines) else None


def _sound(table: LayoutTable, columns: dict[str, list[Any]]) -> bool:
    """Whether nothing is wrong with the facets of a table that was read from lines: see `LayoutFile`."""
    count = len(table.facet)
    whole = all(type(value) is int for key in ("id", "page") for value in columns[key])
    whole &= all(type(side) is int for size in columns["size"] for side in size)
    shapes = {"size": (2,), "quilt_from_facet": (2, 3), "origin": (3,), "du": (3,), "dv": (3,)}
    if not whole or any(getattr(table, key).shape != (count, *shape) for key, shape in shapes.items()):
        return False
    corners = np.diff(table.corner_start)
    if table.polygon.shape != (int(corners.sum()), 2) or (corners < 3).any():
        return False
    numbers = (table.quilt_from_facet, table.origin, table.du, table.dv, table.polygon)
    if not all(np.isfinite(each).all() for each in numbers):
        return False
    (a, b), (c, d) = table.quilt_from_facet[:, :, :2].transpose(1, 2, 0)
    return bool(
        len(np.unique(table.facet)) == count
        and (table.facet >= 1).all()
        and ((table.page >= 0) & (table.page < len(table.pages))).all()
        and ((table.size >= 1) & (table.size <= _MOST_PIXELS)).all()
        and all((np.linalg.norm(step, axis=1) > 1e-9).all() for step in (table.du, table.dv))
        and (a * d != b * c).all()
    )
