"""`quilt contact`: small images side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import EXPOSURE, PATH, STILL_VIEW, frames_option


@click.command()
@click.argument("out", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Sheet to write, as .png or .tif.")
@frames_option("Frames; all of pages, the first of facets by default.")
@click.option("--pages", "kind", flag_value="page", help="Pages of the quilt, the default if there are any.")
@click.option("--facets", "kind", flag_value="facet", help="Images of facets.")
@click.option("--columns", type=click.IntRange(min=1), help="Images in a row.")
@click.option("--width", type=click.IntRange(16, 4096), default=240, show_default=True, metavar="PIXELS")
@click.option("--view", type=STILL_VIEW, default="aces", show_default=True, help="How light becomes colour.")
@EXPOSURE
def contact(out: Path, output: Path, view: str, exposure: float, **how: Any) -> None:
    """Lay the images in the output folder OUT of a render side by side, small, with their names."""
    from quiltcli.formats.whole import make_folder
    from quiltcli.images.contact import Sheet, contact_sheet
    from quiltcli.images.preview import Look

    make_folder(output.parent)
    count, (width, height) = contact_sheet(out, output, Sheet(look=Look(view, exposure), **how))
    click.echo(f"{output}  {width}×{height}, {count} image{'s' * (count > 1)}")
