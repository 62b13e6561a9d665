"""`quilt preview`: pictures of EXR images."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import EXPOSURE, PATH, STILL_VIEW


@click.command()
@click.argument("images", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Picture to write, or a folder for several.")
@click.option("--format", "kind", type=click.Choice(("png", "tiff")), help="By the picture's name; else PNG.")
@click.option(
    "--depth", type=click.Choice(("8", "16")), default="8", show_default=True, help="Bits a channel."
)
@click.option(
    "--largest", type=click.IntRange(min=0), metavar="PIXELS", help="Most in width and height; 0: all."
)
@click.option("--view", type=STILL_VIEW, default="aces", show_default=True, help="How light becomes colour.")
@EXPOSURE
def preview(
    images: tuple[Path, ...],
    output: Path,
    kind: str | None,
    depth: str,
    largest: int | None,
    view: str,
    exposure: float,
) -> None:
    """Turn EXR IMAGES, quilts or facets, into pictures; sequences too, as page_01.####.exr.

    Pictures of 8 bits are to look at, at most 2048 pixels wide and high; those of 16 bits are to be
    shown, every pixel of them.
    """
    from quiltcli.images.preview import LARGEST, Look, preview_paths
    from quiltcli.images.preview import preview as write_preview

    if largest is None:
        largest = LARGEST if depth == "8" else 0
    look = Look(view, exposure, int(depth), largest)
    for image, picture in preview_paths(images, output, kind):
        width, height = write_preview(image, picture, look)
        click.echo(f"{picture}  {width}×{height}")
