"""`quilt board`: boards of markers to print."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH


@click.command()
@click.argument("board", metavar="3x2,40mm,10mm,4x4,20")
@click.option("-o", "--output", type=PATH, required=True, help="SVG file to print at its own size.")
def board(board: str, output: Path) -> None:
    """Draw a BOARD of markers to print and fix to panels, for quilt calibrate --attached.

    BOARD is markers across and down, their side, the gap between them, dictionary, and id of the first; quilt
    calibrate takes the same words.
    """
    from quiltcli.calibration.panels.attached import parse_attached
    from quiltcli.calibration.panels.printing import write_board

    made = parse_attached(board)
    wide, high = write_board(output, made, board.partition("=")[0].replace(" ", ""))
    click.echo(
        f"{output}  {wide:.1f} × {high:.1f} mm; measure a marker once it is printed: {1000 * made.side:g} mm"
    )
