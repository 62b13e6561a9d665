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
@click.option(
    "--domemaster",
    metavar="NAME",
    help="For planetaria: 16 bits, as NAME_000001.png … in the folder.",
)
def preview(
    images: tuple[Path, ...],
    output: Path,
    kind: str | None,
    depth: str,
    largest: int | None,
    view: str,
    exposure: float,
    domemaster: str | None,
) -> None:
    """Turn EXR IMAGES, quilts or facets, into pictures; sequences too, as page_01.####.exr.

    Pictures of 8 bits are to look at, at most 2048 pixels wide and high; those of 16 bits are to be
    shown, every pixel of them.
    """
    from quiltcli.images.preview import LARGEST, Look, domemaster_paths, preview_paths
    from quiltcli.images.preview import preview as write_preview

    if domemaster is not None:
        depth = "16"
    if largest is None:
        largest = LARGEST if depth == "8" else 0
    look = Look(view, exposure, int(depth), largest)
    pairs = (
        preview_paths(images, output, kind)
        if domemaster is None
        else domemaster_paths(images, output, domemaster)
    )
    for image, picture in pairs:
        width, height = write_preview(image, picture, look)
        click.echo(f"{picture}  {width}×{height}")
