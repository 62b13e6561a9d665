"""CSV: a table of panels, the form LED technicians and spreadsheets share."""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import LayoutError, Problem
from quiltcli.exchange.pixelmaps.placing import (
    Panel,
    Rasters,
    adopted,
    demand_panels,
    display_rasters,
    entries,
    panel,
    placed_rows,
    rows_in_order,
)
from quiltcli.formats.inputs import read_input
from quiltcli.formats.whole import write_text
from quiltcli.formats.yaml.source import shorten
from quiltcli.job.model import FARTHEST
from quiltcli.layout import Layout

PLACE = ("page", "x", "y", "width", "height")
VECTORS = tuple(f"{vector}_{axis}" for vector in ("origin", "du", "dv") for axis in "xyz")
_FORMULAS = ("=", "+", "-", "@")
_MOST_PAGES, _MOST_LINES, _MOST_PROBLEMS = 100_000, 1_000_000, 10_000
COLUMNS = ("id", "name", *PLACE, "rotation", "mirror", "page_width", "page_height", *VECTORS, "polygon")


def write_panels(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write one line a facet. Raises OutputError for facets that are no turned rectangles of whole pixels."""
    demand_panels(layout, path, "cannot stand in a table of panels (json and obj hold it)")
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for row in placed_rows(layout):
        table.writerow(_line(layout, facets, row))
    write_text(path, text.getvalue())
    return [path]


def _line(layout: Layout, facets: Facets | None, row: int) -> list[object]:
    facet, place = int(layout.facet[row]), panel(layout, row)
    corners = layout.outline(row)
    vectors = (number for key in (layout.origin, layout.du, layout.dv) for number in key[row].tolist())
    return [
        facet,
        harmless(facets.names[facet - 1]) if facets else "",
        *(place.page + 1, place.x, place.y, place.width, place.height, place.rotation, int(place.mirror)),
        *layout.pages[place.page].tolist(),
        *map(_number, vectors),
        "; ".join(f"{_number(x)} {_number(y)}" for x, y in corners.tolist()),
    ]


def harmless(text: str) -> str:
    """Text that no spreadsheet takes for a formula: an apostrophe leads what starts like one."""
    return f"'{text}" if text.lstrip("' ").startswith(_FORMULAS) else text


def _name(text: str) -> str:
    """The text that `harmless` was given."""
    return text.removeprefix("'") if text.lstrip("' ").startswith(_FORMULAS) else text


def _number(value: float) -> str:
    """The shortest text that reads back as the same number."""
    return str(int(value)) if value.is_integer() and abs(value) < 2**53 else repr(value)


@dataclass
class _Table:
    """A table as it is read, and what is wrong with it.

    Attributes:
        path: the file.
        columns: place of each column by its name.
        lines: line of the file and cells of each row; the last cells may lack.
        problems: what is wrong.
    """

    path: Path
    columns: Mapping[str, int]
    lines: list[tuple[int, list[str]]]
    problems: list[Problem] = field(default_factory=list)

    def problem(self, message: str, line: int, column: str = "") -> None:
        self.problems.append(Problem(message, str(self.path), line, key=column))
        if len(self.problems) == _MOST_PROBLEMS:  # a file of another kind: its other lines are no better
            entries(self.path, self.problems)

    def text(self, at: int, column: str) -> str:
        """A cell of a line, empty where there is none."""
        cells, place = self.lines[at][1], self.columns.get(column, -1)
        return cells[place].strip() if 0 <= place < len(cells) else ""

    def number(self, at: int, column: str, kind: Any = int, default: Any = None, spare: int = 0) -> Any:
        """A number of a line; where there is none, `default`, or a problem and `spare`."""
        text = self.text(at, column)
        if not text and default is not None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= FARTHEST or (kind is int and not value.is_integer()):
            wanted = "a whole number" if kind is int else "a number"
            far = f" from -{FARTHEST:.0f} to {FARTHEST:.0f}" if abs(value) > FARTHEST else ""
            self.problem(f"found {shorten(text)!r}, expected {wanted}{far}", self.lines[at][0], column)
            return kind(spare)
        return kind(value)


def read_panels(path: Path, display: Facets | None, size: tuple[int, int] | None) -> Layout:
    """Read a table of panels.

    Lines need `id` or, with a display, `name`; `x`, `y`, `width`, `height`; all else has a default:
    page 1, no rotation, no mirror, pages of `size`, and the rasters and polygons of the display.
    """
    table = _read_table(path)
    _check_columns(table, display)
    ids = _ids(table, display)
    panels = [_panel(table, at) for at in range(len(table.lines))]
    pages = _pages(table, panels, size)
    entries(path, table.problems)
    order = rows_in_order(ids)
    rasters = _rasters(table, [ids[at] for at in order], [panels[at] for at in order], order, display)
    entries(path, table.problems)
    layout = Layout(
        facet=np.array([ids[at] for at in order], dtype=np.int32),
        page=np.array([panels[at].page for at in order], dtype=np.int32),
        size=rasters.size,
        quilt_from_facet=np.array([panels[at].quilt_from_facet for at in order]),
        origin=rasters.origin,
        du=rasters.du,
        dv=rasters.dv,
        corner_start=rasters.corner_start,
        polygon=rasters.polygon,
        pages=np.array(pages, dtype=np.int32),
        padding=0,
        method="csv",
        display="",
        display_sha256="",
    )
    return adopted(layout, display, path)


def _read_table(path: Path) -> _Table:
    try:
        text = read_input(path, LayoutError).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise LayoutError(Problem("is not UTF-8 text (expected a table of panels)", file=str(path))) from None
    # Spreadsheets of half of Europe separate by semicolons.
    first = text.partition("\n")[0]
    separator = ";" if first.count(";") > first.count(",") else "\t" if "\t" in first else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    rows = ((reader.line_num, row) for row in reader if any(cell.strip() for cell in row))
    try:
        line, names = next(rows, (1, []))
        columns = [cell.strip().lower() for cell in names]
        lines = list(itertools.islice(rows, _MOST_LINES + 1))
    except csv.Error:
        message = "has a cell longer than any table of panels needs (is a quote left open?)"
        raise LayoutError(Problem(message, str(path), reader.line_num)) from None
    if len(lines) > _MOST_LINES:
        raise LayoutError(Problem(f"has more than {_MOST_LINES:,} lines, expected a line a facet", str(path)))
    if not names:
        raise LayoutError(Problem("is empty (expected a line of column names)", file=str(path)))
    table = _Table(path, {name: place for place, name in reversed(list(enumerate(columns)))}, lines)
    for name, count in Counter(filter(None, columns)).items():
        if count > 1:
            table.problem(f"the column {shorten(name)!r} stands {count} times, expected once", line)
    for line, row in lines:
        if len(row) > len(columns):
            table.problem(f"has {len(row)} cells, but there are {len(columns)} columns", line)
    return table


def _check_columns(table: _Table, display: Facets | None) -> None:
    needed = ["x", "y", "width", "height"]
    if "id" not in table.columns and not (display and "name" in table.columns):
        needed.insert(0, "id")
    if display is None:
        needed += [*VECTORS, "polygon"]
    missing = [name for name in needed if name not in table.columns]
    hint = "; name the display, and it says the rest" if {*missing} & {*VECTORS, "polygon"} else ""
    if missing:
        found = ", ".join(shorten(name) for name in sorted(table.columns, key=table.columns.__getitem__)[:40])
        message = f"has no column {', '.join(missing)} (columns found: {found}{hint})"
        raise LayoutError(Problem(message, str(table.path), 1))
    if not table.lines:
        message = "has no lines below its column names (expected a line a facet)"
        raise LayoutError(Problem(message, str(table.path), 1))


def _ids(table: _Table, display: Facets | None) -> list[int]:
    """Facet ids, by name where the table has no ids."""
    found: dict[int, int] = {}
    ids = []
    known: dict[str, list[int]] = {}
    for facet, name in enumerate(display.names if display else (), 1):
        known.setdefault(name, []).append(facet)
    for at, (line, _) in enumerate(table.lines):
        if "id" in table.columns:
            facet, column = table.number(at, "id"), "id"
            if facet < 1 and table.text(at, "id").strip("+-0."):
                table.problem(f"found {facet}, but facets count from 1", line, column)
        else:
            name, column = _name(table.text(at, "name")), "name"
            named = known.get(name, [])
            facet = named[0] if len(named) == 1 else 0
            if not facet and display:
                words = f"{display.path} has {len(named)} facets named {shorten(name)!r}, expected one"
                table.problem(words, line, column)
        if facet and display and not 1 <= facet <= display.count:
            table.problem(
                f"facet {facet} is not in {display.path}, which has facets 1 to {display.count}", line, column
            )
        elif facet in found and facet:
            table.problem(f"facet {facet} stands in line {found[facet]} already", line, column)
        found.setdefault(facet, line)
        ids.append(facet)
    return ids


def _panel(table: _Table, at: int) -> Panel:
    line, _ = table.lines[at]
    numbers = {name: table.number(at, name) for name in ("x", "y")}
    numbers |= {name: table.number(at, name, spare=1) for name in ("width", "height")}
    rotation = table.number(at, "rotation", int, 0)
    mirror = table.text(at, "mirror").lower()
    page = table.number(at, "page", int, 1, spare=1)
    if rotation % 90:
        table.problem(f"found {rotation}, expected 0, 90, 180 or 270", line, "rotation")
    if mirror not in ("", "0", "1", "false", "true", "no", "yes"):
        table.problem(f"found {shorten(mirror)!r}, expected 0 or 1", line, "mirror")
    if page < 1:
        table.problem(f"found {page}, but pages count from 1", line, "page")
    elif page > _MOST_PAGES:
        table.problem(f"found {page}, expected at most {_MOST_PAGES}", line, "page")
        page = 1
    for name in ("width", "height"):
        if numbers[name] < 1:
            table.problem(f"found {numbers[name]}, expected at least 1 pixel", line, name)
    return Panel(page - 1, **numbers, rotation=rotation % 360, mirror=mirror in ("1", "true", "yes"))


def _pages(table: _Table, panels: Sequence[Panel], size: tuple[int, int] | None) -> list[tuple[int, int]]:
    """Page sizes: the table's own, or `size`."""
    count = max((place.page + 1 for place in panels), default=0)
    pages = [size or (0, 0)] * count
    said: dict[int, int] = {}
    for at, place in enumerate(panels):
        line = table.lines[at][0]
        fallback = size or (0, 0)
        own = tuple(
            table.number(at, column, int, fallback[side])
            for side, column in enumerate(("page_width", "page_height"))
        )
        if not all(own) or place.page < 0:
            continue
        if place.page in said and pages[place.page] != own:
            before = "×".join(map(str, pages[place.page]))
            table.problem(
                f"page {place.page + 1} is {own[0]}×{own[1]} here, but {before} in line {said[place.page]}",
                line,
            )
        said.setdefault(place.page, line)
        pages[place.page] = (own[0], own[1])
    for page, known in enumerate(pages):
        if not all(known):
            message = f"does not say how large page {page + 1} is (expected the columns page_width and"
            table.problem(f"{message} page_height, or a size)", 0)
    return pages


def _rasters(
    table: _Table, ids: Sequence[int], panels: Sequence[Panel], order: Sequence[int], display: Facets | None
) -> Rasters:
    """The table's own rasters where it has them, else the display's, which must have the panels' sizes."""
    if {*VECTORS, "polygon"} <= {*table.columns}:
        vectors = np.array([[table.number(at, column, float) for column in VECTORS] for at in order])
        polygons = [_polygon(table, at) for at in order]
        origin, du, dv = np.split(vectors.reshape(-1, 9), 3, axis=1)
        start = np.cumsum([0, *map(len, polygons)])
        size = np.array([place.raster for place in panels], dtype=np.int32)
        return Rasters(size, origin, du, dv, start, np.concatenate(polygons))
    assert display is not None  # `_check_columns` has seen to it
    rasters = display_rasters(display, ids)
    for row, place in enumerate(panels):
        own = (int(rasters.size[row, 0]), int(rasters.size[row, 1]))
        if place.raster != own:
            turned = f" turned by {place.rotation}°" if place.rotation else ""
            message = f"facet {ids[row]} is {place.width}×{place.height} pixels{turned}, but its raster in"
            table.problem(
                f"{message} {display.path} is {own[0]}×{own[1]}", table.lines[order[row]][0], "width"
            )
    return rasters


def _polygon(table: _Table, at: int) -> np.ndarray:
    """`x y; x y; …` in facet pixels."""
    text = table.text(at, "polygon")
    try:
        points = [[float(number) for number in pair.split()] for pair in text.split(";")]
    except ValueError:
        points = []
    if len(points) < 3 or any(len(point) != 2 for point in points):
        words = f"found {text[:40]!r}, expected 3 or more pairs such as 0 0; 9 0; 9 9"
        table.problem(words, table.lines[at][0], "polygon")
        points = [[0.0, 0.0]] * 3
    return np.array(points)
