"""`quilt unmap`: facet images out of quilts."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH


@click.command()
@click.argument("quilts", nargs=-1, required=True, type=PATH)
@click.option("--layout", type=PATH, required=True, help="The layout the quilts were made for.")
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the facet images.")
@OVERWRITE
def unmap(quilts: tuple[Path, ...], layout: Path, output: Path, overwrite: bool) -> None:
    """Cut facet images out of existing QUILTS."""
    from quiltcli.images.unmap import unmap as unmap_quilts
    from quiltcli.layout import read_layout

    written = unmap_quilts(quilts, read_layout(layout), output, overwrite=overwrite)
    click.echo(f"{len(written)} facet images in {output / 'facets'}")
