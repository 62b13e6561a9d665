"""`quilt export`: a layout as a pixel map of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import MAP_FORMAT, PATH
from quiltcli.cli.printing import print_files


@click.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="File to write; its suffix says the format.")
@click.option(
    "--format",
    "format_name",
    type=MAP_FORMAT,
    help="obj, csv, json, mpcdi, mpcdi1, resolume, st, png or svg; of a display xyz, obj, data, st or mpcdi.",
)
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
def export(layout: Path, output: Path, format_name: str | None, display: Path | None) -> None:
    """Write LAYOUT as a pixel map other tools read.

    Textured mesh (.obj), table of panels (.csv), JSON (.json), MPCDI (.mpcdi), slices of Resolume (.xml),
    ST maps (.exr), or a template picture (.png, .svg).

    LAYOUT may be a display file: its pixels' points in the world (.exr, .pfm, .mpcdi), or a mesh whose
    texture is its image (.obj); of a projection a warp mesh (.data), or an ST map over a plain picture
    (--format st). But for .mpcdi a file a facet.
    """
    from quiltcli.display import load_display
    from quiltcli.exchange.pixelmaps import known_display, write_display_map, write_map
    from quiltcli.job import DisplayFile, file_kind, load_display_file
    from quiltcli.layout import read_layout

    if file_kind(layout) == DisplayFile.kind:
        facets = load_display(load_display_file(layout))
        written = write_display_map(facets, output, format_name)
        print_files(written, written[-1].parent)
        return
    loaded = read_layout(layout)
    written = write_map(loaded, known_display(loaded, display), output, format_name)
    print_files(written, written[-1].parent)
