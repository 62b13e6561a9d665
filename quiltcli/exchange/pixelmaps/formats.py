"""The table of formats, and the two functions that go through it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from quiltcli.display import Facets, load_display
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.exchange.pixelmaps.jsonmap import read_json, write_json
from quiltcli.exchange.pixelmaps.mpcdiread import read_mpcdi
from quiltcli.exchange.pixelmaps.mpcdiwrite import write_mpcdi, write_mpcdi_1
from quiltcli.exchange.pixelmaps.objmap import read_obj_map, write_obj_map
from quiltcli.exchange.pixelmaps.panels import read_panels, write_panels
from quiltcli.exchange.pixelmaps.resolume import read_resolume, write_resolume
from quiltcli.exchange.pixelmaps.stmap import write_st_maps
from quiltcli.exchange.pixelmaps.template import write_png_template, write_svg_template
from quiltcli.formats.inputs import is_regular
from quiltcli.job import load_display_file
from quiltcli.job.model import suggest
from quiltcli.layout import Layout, align, file_problems

Writer = Callable[[Layout, Facets | None, Path], list[Path]]
Reader = Callable[[Path, Facets | None, tuple[int, int] | None], Layout]


@dataclass(frozen=True)
class Format:
    """A form a layout can take.

    Attributes:
        suffix: what file names of this format end in.
        about: one line for people.
        write: writes a layout (with its display, when that is known) and returns the files.
        read: reads a layout for a display, when one is given, with pages of a size, when one is given.
    """

    suffix: str
    about: str
    write: Writer
    read: Reader | None = None


FORMATS: dict[str, Format] = {
    "obj": Format(".obj", "mesh with texture coordinates, one file a page", write_obj_map, read_obj_map),
    "csv": Format(".csv", "table of panels", write_panels, read_panels),
    "json": Format(".json", "everything a layout says", write_json, read_json),
    "mpcdi": Format(".mpcdi", "MPCDI 2.0 archive, 2D media profile", write_mpcdi, read_mpcdi),
    "mpcdi1": Format(".mpcdi", "MPCDI 1 archive, 2D media profile", write_mpcdi_1, read_mpcdi),
    "resolume": Format(".xml", "Resolume's Advanced Output, one file a page", write_resolume, read_resolume),
    "st": Format(".exr", "ST maps of pages and facets", write_st_maps),
    "png": Format(".png", "template picture at exact pixels, one file a page", write_png_template),
    "svg": Format(".svg", "template drawing, one file a page", write_svg_template),
}


def format_of(path: Path, name: str | None = None) -> Format:
    """The format called `name`, or else the one whose suffix the file has.

    Raises:
        LayoutError: there is none.
    """
    if name is not None and name in FORMATS:
        return FORMATS[name]
    if name is not None:
        near = suggest(name, FORMATS)
        hint = f"; did you mean {near}?" if near else ""
        raise LayoutError(Problem(f"unknown format {name!r} (known: {', '.join(FORMATS)}{hint})"))
    for entry in FORMATS.values():
        if path.name.lower().endswith((entry.suffix, f"{entry.suffix}.xml")):
            return entry
    known = ", ".join(dict.fromkeys(entry.suffix for entry in FORMATS.values()))
    found = f"the suffix {path.suffix!r}" if path.suffix else "no suffix"
    raise LayoutError(Problem(f"has {found}, which names no format (expected {known})", file=str(path)))


def write_map(
    layout: Layout, facets: Facets | None, path: str | Path, format_name: str | None = None
) -> list[Path]:
    """Write the layout in a format of the table; return the files, each whole or not there at all.

    Args:
        layout: a layout that `check_layout` accepts.
        facets: its display, for names and lit sides; may be None.
        path: the file; layouts of several pages may become several files beside it.
        format_name: a key of `FORMATS`; by default the suffix of `path` decides.

    Raises:
        LayoutError: an unknown format, or a display that is not the layout's.
        OutputError: the format cannot hold this layout, or a file cannot be written.
    """
    path = Path(path)
    entry = format_of(path, format_name)
    if facets is not None:
        align(layout, facets)
    return entry.write(layout, facets, path)


def read_map(
    path: str | Path,
    facets: Facets | None = None,
    *,
    size: tuple[int, int] | None = None,
    format_name: str | None = None,
) -> Layout:
    """Read a layout from a format of the table.

    Args:
        path: the file; of a mesh of several pages the name without `_page_01`, or any page of it.
        facets: the display the layout is for: says what the file does not (rasters, ids by place).
        size: width and height of pages whose size the file does not say.
        format_name: a key of `FORMATS`; by default the suffix of `path` decides.

    Raises:
        LayoutError: a format that is only written, a file that is broken or says too little, or a
            layout that makes no sense or does not fit the display; all that is found, together.
        MeshError, DisplayError: a mesh that cannot be read or makes no display.
        JobError: a JSON file with wrong keys.
    """
    path = Path(path)
    entry = format_of(path, format_name)
    if entry.read is None:
        known = ", ".join(name for name, other in FORMATS.items() if other.read)
        message = f"holds {entry.about}, a format that is only written (formats to read: {known})"
        raise LayoutError(Problem(message, file=str(path)))
    layout = entry.read(path, facets, size)
    raise_all(LayoutError, file_problems(layout, path))
    return layout


def imported_map(
    path: str | Path,
    display: Path | None,
    *,
    size: tuple[int, int] | None = None,
    format_name: str | None = None,
) -> tuple[Layout, Facets | None, str]:
    """A layout to write to a file, one that `check` accepts; with its display, and what is worth saying.

    The display is the one named, else the one that the map names: it must fit, and if it is not there the
    layout does not name it any more.

    Raises:
        QuiltError: as for `read_map`, or the display is wrong.
    """
    facets = load_display(load_display_file(display)) if display is not None else None
    layout = read_map(path, facets, size=size, format_name=format_name)
    if facets is not None or not layout.display:
        return layout, facets, ""
    facets = known_display(layout)
    if facets is None:
        words = f"the display {layout.display} that the map names is not there: the layout names none"
        return replace(layout, display="", display_sha256=""), None, words
    align(replace(layout, path=str(path), place=None, file_row=None), facets)
    return layout, facets, ""


def known_display(layout: Layout, path: Path | None = None) -> Facets | None:
    """The display at `path`, or else the one the layout names, if that file is there.

    Raises:
        JobError, MeshError, DisplayError: it is there, but cannot be read.
    """
    if path is None and not (layout.display and is_regular(Path(layout.display))):
        return None
    return load_display(load_display_file(path or layout.display))
