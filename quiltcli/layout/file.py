"""The layout file: YAML that people read and every bit of the numbers survives.

The facets of a large layout stand in a file of their own beside it, as columns of numbers.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from quiltcli.errors import Problem
from quiltcli.formats.whole import write_text, write_whole
from quiltcli.formats.yaml.source import Source
from quiltcli.job.layout_columns import columns_bytes
from quiltcli.job.layout_table import LayoutTable, Places, columns_of, read_layout_table
from quiltcli.layout.check import check_layout
from quiltcli.layout.layout import Layout, Packed

MOST_AS_TEXT = 4096
"""Facets that stand in the layout file itself."""

_COLUMNS = ("size", "quilt_from_facet", "origin", "du", "dv")


def read_layout(path: str | Path) -> Layout:
    """Read a layout file strictly.

    Raises:
        JobError: the YAML is broken or a key is wrong, all problems together.
        LayoutError: the layout makes no sense: `check_layout` says what is looked at.
    """
    layout = layout_from_table(read_layout_table(path))
    check_layout(layout)
    return layout


def layout_from_table(table: LayoutTable) -> Layout:
    """The record of a layout file, facets sorted by id."""
    head = table.head
    order = np.argsort(table.facet, kind="stable")
    places = table.taken(order)
    return Layout(
        **{column.name: getattr(places, column.name) for column in fields(Places)},
        method=head.method,
        display=os.path.normpath(head.display) if head.display else "",
        display_sha256=head.display_sha256 or "",
        packed=None if head.packed is None else Packed(**head.packed.model_dump()),
        path=str(table.source.path),
        place=table.source,
        file_row=order,
        surfaces=table.surfaces,
    )


def file_problems(layout: Layout, path: Path) -> list[Problem]:
    """What would keep the layout from being read back from a file at `path`."""
    from quiltcli.job import LayoutFile
    from quiltcli.job.messages import problems_of

    try:
        LayoutFile.model_validate(_plain(layout))
    except ValidationError as error:
        return problems_of(error, LayoutFile, Source(path))
    return []


def _plain(layout: Layout) -> dict[str, object]:
    """What the file says, as plain data."""
    rows = np.flatnonzero(layout.page >= 0).tolist()
    facets = [
        {
            "id": int(layout.facet[row]),
            "page": int(layout.page[row]) + 1,
            **{key: getattr(layout, key)[row].tolist() for key in _COLUMNS},
            "polygon": layout.outline(row).tolist(),
        }
        for row in rows
    ]
    pages = [{"size": size} for size in layout.pages.tolist()]
    return {
        "quilt_layout": 1,
        "method": layout.method,
        "padding": layout.padding,
        "pages": pages,
        "facets": facets,
    }


def write_layout(layout: Layout, path: str | Path) -> None:
    """Write the layout file, whole or not at all.

    The display is named relative to the file's folder, so that the two can move together. More than
    `MOST_AS_TEXT` facets are written to a second file, `NAME.columns.npz`, that the layout file names.

    Raises:
        OutputError: the file cannot be written.
    """
    path = Path(path)
    if np.count_nonzero(layout.page >= 0) <= MOST_AS_TEXT:
        write_text(path, layout_text(layout, path.parent))
        return
    data, digest = columns_bytes(columns_of(layout))
    beside = path.with_name(f"{path.stem}.columns.npz")
    write_whole(beside, data)
    facets = [f"columns: {json.dumps(beside.name, ensure_ascii=False)}", f"columns_sha256: {digest}"]
    write_text(path, _text(layout, path.parent, facets))


def layout_text(layout: Layout, folder: str | Path = ".") -> str:
    """The layout file's text, facets and all, as it would be written to `folder`.

    Facets without a place are left out. Numbers are the shortest text that reads back as the same float64.
    """
    rows = np.flatnonzero(layout.page >= 0).tolist()
    facets = ["facets:" if rows else "facets: []"]
    return _text(layout, folder, [*facets, *(line for row in rows for line in _facet_lines(layout, row))])


def _text(layout: Layout, folder: str | Path, facets: list[str]) -> str:
    """The file's text around the lines that tell of the facets."""
    lines = [
        "quilt_layout: 1",
        *_display_lines(layout, folder),
        f"method: {json.dumps(layout.method, ensure_ascii=False)}",
        f"padding: {layout.padding}",
        "pages:",
        *(f"- size: {_flow(size)}" for size in layout.pages),
        *facets,
        *_packed_lines(layout),
    ]
    return "\n".join(lines) + "\n"


def _display_lines(layout: Layout, folder: str | Path) -> Iterator[str]:
    if layout.display:
        display = Path(os.path.relpath(layout.display, folder)).as_posix()
        yield f"display: {json.dumps(display, ensure_ascii=False)}"
    if layout.display_sha256:
        yield f"display_sha256: {layout.display_sha256}"


def _packed_lines(layout: Layout) -> Iterator[str]:
    if layout.packed is not None:
        yield "packed:"
        for field in fields(layout.packed):
            yield f"  {field.name}: {getattr(layout.packed, field.name)}"


def _facet_lines(layout: Layout, row: int) -> list[str]:
    return [
        f"- id: {layout.facet[row]}",
        f"  page: {layout.page[row] + 1}",
        *(f"  {key}: {_flow(getattr(layout, key)[row])}" for key in _COLUMNS),
        f"  polygon: {_flow(layout.outline(row))}",
        *_surface_line(layout.surfaces.get(int(layout.facet[row]), "")),
    ]


def _surface_line(name: str) -> list[str]:
    return [f"  surface: {json.dumps(name, ensure_ascii=False)}"] if name else []


def _flow(values: np.ndarray) -> str:
    """Numbers as a YAML flow sequence, nested like the array."""
    if values.ndim == 0:
        return number_text(float(values))
    return "[" + ", ".join(_flow(value) for value in values) + "]"


def number_text(value: float) -> str:
    """The shortest text a YAML 1.1 or 1.2 reader takes for exactly this number."""
    if value.is_integer() and abs(value) < 2**53 and str(value) != "-0.0":
        return str(int(value))
    text = repr(value)
    # YAML 1.1 takes 1e-05 for a word; with a point it is a number.
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
