"""Commands about layouts: pack, export, import, pattern."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.group import main
from quiltcli.cli.options import PATH, SIZE


@main.command()
@click.argument("display", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file to write.")
@click.option("--method", help="Packing method.")
@click.option("--size", type=SIZE, help="Page size such as 8192x8192; auto takes the smallest page.")
@click.option("--max-pages", type=click.IntRange(min=1), help="Most pages that may be used.")
@click.option(
    "--padding", type=click.IntRange(min=0), default=2, show_default=True, help="Pixels between facets."
)
@click.option("--picture", type=PATH, help="Draw the layout, as .png or .svg.")
def pack(
    display: Path,
    output: Path,
    method: str | None,
    size: tuple[int, int] | None,
    max_pages: int | None,
    padding: int,
    picture: Path | None,
) -> None:
    """Make a facet layout for DISPLAY; print its fill and pages."""
    from quiltcli.display import load_display
    from quiltcli.job import load_display_file
    from quiltcli.layout import fill, layout_picture, write_layout
    from quiltcli.packing import DEFAULT_METHOD
    from quiltcli.packing import pack as pack_facets

    facets = load_display(load_display_file(display))
    layout = pack_facets(facets, method or DEFAULT_METHOD, size, padding, max_pages)
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets.names)
    pages = layout.pages.tolist()
    click.echo(f"fill {100 * fill(layout):.1f} %")
    click.echo(f"pages {len(pages)} of {pages[0][0]}×{pages[0][1]} pixels")


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
    from quiltcli.layout import read_layout
    from quiltcli.pixelmaps import known_display, write_map

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
    from quiltcli.job import load_display_file
    from quiltcli.layout import layout_picture, write_layout
    from quiltcli.pixelmaps import read_map

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
    from quiltcli.layout import align, read_layout
    from quiltcli.pattern import KINDS
    from quiltcli.patternfiles import write_patterns
    from quiltcli.pixelmaps import known_display

    loaded = read_layout(layout)
    facets = known_display(loaded, display)
    names = align(loaded, facets)[0].names if facets is not None else ()
    chosen = tuple(KINDS) if "all" in kinds else tuple(dict.fromkeys(kinds))
    paths = write_patterns(
        loaded, output, chosen, image_format=image_format, names=names, step=step, overwrite=overwrite
    )
    for path in paths:
        click.echo(str(path))
