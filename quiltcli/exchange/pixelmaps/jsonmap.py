"""JSON: the layout file's own keys, with the facts programs would otherwise have to work out."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from quiltcli.display import Facets
from quiltcli.errors import JobError, LayoutError, Problem
from quiltcli.exchange.pixelmaps.placing import adopted, panel, placed_rows
from quiltcli.formats.inputs import read_input
from quiltcli.formats.whole import write_text
from quiltcli.formats.yaml.source import Source, parse_yaml
from quiltcli.job import LayoutFile
from quiltcli.job.layout_table import table_of
from quiltcli.job.messages import problems_of
from quiltcli.job.model import attach
from quiltcli.layout import Layout, quilt_polygons, whole_pixel
from quiltcli.layout.file import layout_from_table

DERIVED = ("name", "x", "y", "width", "height", "rotation", "mirror", "quilt_polygon")
"""Keys of a facet that repeat what others say; they are not read."""


def write_json(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write the layout as JSON, a facet a line; numbers read back exactly (OutputError)."""
    write_text(path, json_text(layout, facets, path.parent))
    return [path]


def json_text(layout: Layout, facets: Facets | None = None, folder: Path | None = None) -> str:
    """The JSON text; the display is named relative to `folder`, and left out without one."""
    head: dict[str, Any] = {"quilt_layout": 1}
    if layout.display and folder is not None:
        head["display"] = Path(os.path.relpath(layout.display, folder)).as_posix()
    if layout.display_sha256:
        head["display_sha256"] = layout.display_sha256
    head |= {"method": layout.method, "padding": layout.padding}
    head["pages"] = [{"size": size} for size in layout.pages.tolist()]
    lines = [f"  {_dumped(key)}: {_dumped(value)}," for key, value in head.items()]
    rows = [f"    {_dumped(entry)}" for entry in _entries(layout, facets)]
    body = ",\n".join(rows)
    return "\n".join(["{", *lines, '  "facets": [', body, "  ]", "}"]) + "\n"


def _dumped(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _entries(layout: Layout, facets: Facets | None) -> list[dict[str, Any]]:
    whole, quilt = whole_pixel(layout), quilt_polygons(layout)
    found = []
    for row in placed_rows(layout):
        facet = int(layout.facet[row])
        corners = slice(int(layout.corner_start[row]), int(layout.corner_start[row + 1]))
        entry: dict[str, Any] = {"id": facet, "page": int(layout.page[row]) + 1}
        if facets is not None:
            entry["name"] = facets.names[facet - 1]
        if whole[row]:
            place = panel(layout, row)
            entry |= {key: getattr(place, key) for key in ("x", "y", "width", "height", "rotation", "mirror")}
        entry["size"] = layout.size[row].tolist()
        for key in ("quilt_from_facet", "origin", "du", "dv"):
            entry[key] = getattr(layout, key)[row].tolist()
        entry |= {"polygon": layout.polygon[corners].tolist(), "quilt_polygon": quilt[corners].tolist()}
        found.append(entry)
    return found


def read_json(path: Path, display: Facets | None, size: tuple[int, int] | None) -> Layout:
    """Read what `write_json` wrote; `size` says nothing new, for the pages have theirs."""
    data = read_input(path, LayoutError)
    return adopted(layout_from_json(data, path, lambda: _marked(path)), display, path)


def layout_from_json(
    data: bytes, path: Path, marks: Callable[[], Source] | None = None, what: str = ""
) -> Layout:
    """The layout in JSON text, checked key by key but not yet as a whole.

    Args:
        data: the text.
        path: the file it is from, for messages and as what file names are relative to.
        marks: tells where values stand, asked only when something is wrong.
        what: the part of the file that is the text, empty when it is all of it.

    Raises:
        LayoutError, JobError: it is no JSON, or no layout.
    """
    found = _parsed(data, path, f"{what} " if what else "")
    try:
        model = LayoutFile.model_validate(_essential(found), context={"base": path.parent})
    except ValidationError as error:
        problems = problems_of(error, LayoutFile, marks() if marks else Source(path))
        if what:
            problems = [replace(problem, key=f"{what}: {problem.key}".strip(": ")) for problem in problems]
        raise JobError(problems) from None
    attach(model, Source(path))
    return layout_from_table(table_of(model))


def _parsed(data: bytes, path: Path, before: str) -> Any:
    try:
        return json.loads(data, parse_int=_whole)
    except json.JSONDecodeError as error:
        message = f"{before}is not JSON: {error.msg[0].lower()}{error.msg[1:]}"
        place = (error.lineno, error.colno) if not before else (0, 0)
        raise LayoutError(Problem(message, str(path), *place)) from None
    except UnicodeDecodeError:
        raise LayoutError(Problem(f"{before}is not JSON: it is not UTF-8 text", file=str(path))) from None
    except RecursionError:
        raise LayoutError(Problem(f"{before}nests its values too deeply", file=str(path))) from None
    except ValueError as error:  # of `_whole`
        raise LayoutError(Problem(f"{before}{error}", file=str(path))) from None


def _whole(text: str) -> int:
    """A whole number; Python itself refuses to write out those of thousands of digits."""
    if len(text) > 300:
        raise ValueError(f"holds a number of {len(text):,} digits, more than any that is meant")
    return int(text)


def _marked(path: Path) -> Source:
    """Where the values of the file stand: JSON is YAML as well, but for tabs and the like."""
    try:
        return parse_yaml(path).source
    except JobError:
        return Source(path)


def _essential(data: Any) -> Any:
    """The data without what only repeats other keys."""
    for entry in data["facets"] if isinstance(data, dict) and isinstance(data.get("facets"), list) else []:
        for key in DERIVED if isinstance(entry, dict) else ():
            entry.pop(key, None)
    return data
