"""Commands about layouts: pack, export, import, pattern."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.group import main
from quiltcli.cli.options import ASPECT, PATH, SIZE


@main.command()
@click.argument("display", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option(
    "--method",
    help="auto (the best of rects and nest), rows (by id, as people read), rects (bounding rectangles),"
    " maxrects, nest (outlines interlock), net (neighbours stay neighbours at any angle: each facet's"
    " raster is then taken from the quilt, not from the display), or sparrow (a search of minutes for few"
    " facets, by the optional package spyrrow; its layouts differ from run to run).",
)
@click.option(
    "--size",
    type=SIZE,
    help="Page size such as 8192x8192; uhd, dci4k or uhd8k; auto (the default) takes the smallest page.",
)
@click.option("--aspect", type=ASPECT, help="Aspect of the smallest page, such as 16:9.")
@click.option("--max-pages", type=click.IntRange(min=1), help="Most pages that may be used.")
@click.option(
    "--padding", type=click.IntRange(min=0), default=2, show_default=True, help="Pixels between facets."
)
@click.option("--align", type=click.IntRange(min=1), default=1, help="Facets' corners at multiples of this.")
@click.option("--mirror", is_flag=True, help="Let nest and auto mirror facets.")
@click.option("--page-facets", type=click.IntRange(min=1), help="Most facets on a page.")
@click.option("--page-pixels", type=click.IntRange(min=1), help="Most pixels of facets on a page.")
@click.option("--pins", type=PATH, help="A layout whose facets stay; the others are packed around them.")
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="Effort, 10 by default: seconds on a slow computer; every computer packs alike (not sparrow).",
)
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def pack(
    display: Path,
    output: Path,
    method: str | None,
    pins: Path | None,
    seconds: float | None,
    picture: Path | None,
    **wishes: Any,
) -> None:
    """Make a facet layout for DISPLAY; print its fill and pages.

    By every method but net a facet's own pixels are the quilt's pixels, moved and perhaps turned.
    """
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file
    from quiltcli.layout import fill, layout_picture, read_layout, write_layout
    from quiltcli.layout.packing import DEFAULT_METHOD, DEFAULT_SECONDS
    from quiltcli.layout.packing import pack as pack_facets

    facets = load_display(load_display_file(display))
    layout = pack_facets(
        facets,
        method or DEFAULT_METHOD,
        pins=read_layout(pins) if pins is not None else None,
        seconds=seconds or DEFAULT_SECONDS,
        **wishes,
    )
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets=facets)
    pages = list(dict.fromkeys(map(tuple, layout.pages.tolist())))
    click.echo(f"fill {100 * fill(layout):.1f} %")
    click.echo(f"pages {len(layout.pages)} of {' and '.join(f'{w}×{h}' for w, h in pages)} pixels")


@main.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="File to write; its suffix says the format.")
@click.option(
    "--format", "format_name", help="obj, csv, json, mpcdi, mpcdi1, st, png or svg, whatever the suffix."
)
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
def export(layout: Path, output: Path, format_name: str | None, display: Path | None) -> None:
    """Write LAYOUT as a pixel map other tools read.

    Textured mesh (.obj), table of panels (.csv), JSON (.json), MPCDI (.mpcdi), ST maps (.exr), or a
    template picture (.png, .svg).
    """
    from quiltcli.exchange.pixelmaps import known_display, write_map
    from quiltcli.layout import read_layout

    loaded = read_layout(layout)
    written = write_map(loaded, known_display(loaded, display), output, format_name)
    for path in written[:12]:
        click.echo(str(path))
    if len(written) > 12:
        click.echo(f"and {len(written) - 12} more in {written[-1].parent}")


@main.command("import")
@click.argument("file", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option("--format", "format_name", help="obj, csv, json or mpcdi, whatever the suffix.")
@click.option("--display", type=PATH, help="Display the layout is for; says what the file does not.")
@click.option("--size", type=SIZE, help="Page size such as 3840x2160, where the file does not say it.")
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def import_(
    file: Path,
    output: Path,
    format_name: str | None,
    display: Path | None,
    size: tuple[int, int] | None,
    picture: Path | None,
) -> None:
    """Make a layout from a pixel map: .obj, .csv, .json or .mpcdi."""
    from quiltcli.display import load_display
    from quiltcli.exchange.pixelmaps import read_map
    from quiltcli.job import load_display_file
    from quiltcli.layout import layout_picture, write_layout

    facets = load_display(load_display_file(display)) if display is not None else None
    layout = read_map(file, facets, size=size, format_name=format_name)
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets.names if facets else ())
    pages = len(layout.pages)
    click.echo(f"{layout.facet.size} facets on {pages} page{'s' * (pages > 1)}")


@main.command()
@click.argument("layout", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the images.")
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    default=("id",),
    show_default=True,
    help="id, marker, border, grid, checker, gradient, white, or all; may be given again.",
)
@click.option("--format", "image_format", default="png", show_default=True, help="png or exr.")
@click.option("--step", type=int, default=32, show_default=True, help="Pixels between lines of a grid.")
@click.option("--display", type=PATH, help="Display file, instead of the one the layout names.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
def pattern(
    layout: Path,
    output: Path,
    kinds: tuple[str, ...],
    image_format: str,
    step: int,
    display: Path | None,
    overwrite: bool,
) -> None:
    """Draw test patterns for LAYOUT at exact pixels: which facet, which way up, where it ends."""
    from quiltcli.calibration.pattern import KINDS
    from quiltcli.calibration.pattern_files import write_patterns
    from quiltcli.exchange.pixelmaps import known_display
    from quiltcli.layout import align, read_layout

    loaded = read_layout(layout)
    facets = known_display(loaded, display)
    names = align(loaded, facets)[0].names if facets is not None else ()
    chosen = tuple(KINDS) if "all" in kinds else tuple(dict.fromkeys(kinds))
    paths = write_patterns(
        loaded, output, chosen, image_format=image_format, names=names, step=step, overwrite=overwrite
    )
    for path in paths:
        click.echo(str(path))
