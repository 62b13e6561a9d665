"""`quilt view`: a page to turn the display in the hands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import EXPOSURE, PATH, VIEW, frames_option, refuse_typed


@click.command()
@click.argument("out", type=PATH)
@frames_option("Frames such as 7 or 1-12; all that are there by default.")
@click.option("-o", "--output", type=PATH, help="Page to write, as .html; OUT/view.html by default.")
@click.option("--model/--no-model", default=True, help="Write a model beside it, as .glb.")
@click.option(
    "--filter",
    type=click.Choice(("nearest", "linear")),
    default="linear",
    show_default=True,
    help="At first.",
)
@click.option("--errors", is_flag=True, help="Hold every frame against a direct picture, as a heat map.")
@click.option(
    "--ghost",
    type=click.IntRange(min=0),
    default=20000,
    show_default=True,
    help="Most triangles of the scene.",
)
@click.option(
    "--texture", type=click.IntRange(64, 16384), default=4096, show_default=True, help="Most pixels a side."
)
@click.option(
    "--max-mb", "size", type=click.FloatRange(min=1), default=8.0, show_default=True, help="Size of the page."
)
@click.option("--view", type=VIEW, default="aces", show_default=True, help="How light becomes colour.")
@EXPOSURE
def view(out: Path, frames: tuple[int, ...] | None, output: Path | None, **how: Any) -> None:
    """Write a page to turn the display in the hands, from the output folder OUT of a render.

    The page is one file that opens in any browser and needs no network: the display with its images on,
    from the viewer's eye and from everywhere else, with the scene as a ghost of at most so many triangles.
    Of a 360° light field display: what an eye sees from all around, as it turns.
    """
    from quiltcli.images.turns import is_ring_output

    if is_ring_output(out):
        idle = ("filter", "errors", "ghost", "texture")
        refuse_typed("on a page of a spinning mirror", idle)
        from quiltcli.exchange.web.turning import Turning, turning_view

        wishes = Turning(view=how["view"], exposure=how["exposure"], size_mb=how["size"])
        page = turning_view(out, frames, output, wishes, lambda line: click.echo(line, err=True))
        click.echo(f"page      {page}")
        return
    from quiltcli.exchange.web import ViewOptions
    from quiltcli.exchange.web import view as write_view

    options = ViewOptions(nearest=how.pop("filter") == "nearest", **how)
    for label, text in write_view(out, frames, output, options).lines:
        click.echo(f"{label:<10}{text}")
