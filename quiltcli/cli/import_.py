"""`quilt import`: a pixel map of another tool as a layout."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import MAP_FORMAT, PATH, SIZE


@click.command("import")
@click.argument("file", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Layout file, or display file, to write.")
@click.option(
    "--format", "format_name", type=MAP_FORMAT, help="obj, csv, json, mpcdi or resolume, whatever the suffix."
)
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
    """Make a layout from a pixel map: .obj, .csv, .json, .mpcdi or Resolume's .xml.

    An .mpcdi archive of the advanced 3D profile, or of shader lamps, says where pixels are in the world: of
    such a one it makes a display file, with maps beside it.
    """
    from quiltcli.exchange.pixelmaps import holds_surfaces, imported_map, read_surfaces
    from quiltcli.layout import write_layout
    from quiltcli.layout.picture.picture import layout_picture

    if format_name in (None, "mpcdi", "mpcdi1") and holds_surfaces(file):
        if display is not None or size is not None or picture is not None:
            raise click.UsageError("a display is made of this archive: no --display, --size or --picture")
        made = read_surfaces(file, output)
        for words in made.notices:
            click.echo(words, err=True)
        click.echo(f"{made.surfaces} surface{'s' * (made.surfaces > 1)} in {output}")
        return
    layout, facets, notice = imported_map(file, display, size=size, format_name=format_name)
    if notice:
        click.echo(notice, err=True)
    write_layout(layout, output)
    if picture is not None:
        layout_picture(layout, picture, facets.names if facets else ())
    pages = len(layout.pages)
    click.echo(f"{layout.facet.size} facets on {pages} page{'s' * (pages > 1)}")
