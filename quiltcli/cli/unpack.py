"""`quilt unpack`: the binary pictures out of packed ones."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH


@click.command()
@click.argument("packed", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the pictures of one bit.")
@click.option("--order", default="rgb", show_default=True, help="Channels in the order they are shown.")
@click.option("--bits", default="lsb", show_default=True, help="Bit that is shown first: lsb or msb.")
@OVERWRITE
def unpack(packed: tuple[Path, ...], output: Path, order: str, bits: str, overwrite: bool) -> None:
    """Take the 24 binary pictures out of each of the PACKED pictures, or of folders of them."""
    from quiltcli.cli.printing import print_files
    from quiltcli.images.bits import unpack_files

    written = unpack_files(packed, output, order=order, bits=bits, overwrite=overwrite)
    print_files(written, output)
