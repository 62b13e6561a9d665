"""`quilt calibrate`: where a projector stands, from marks on the mirror."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import OVERWRITE, PATH
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("clicks", type=PATH)
@click.option("-o", "--output", type=PATH, help="Display file to write, or whose projector to replace.")
@click.option(
    "--tolerance", type=float, default=1.0, show_default=True, help="Pixels, rms, that points may be off."
)
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
@OVERWRITE
def calibrate(clicks: Path, output: Path | None, tolerance: float, as_json: bool, overwrite: bool) -> None:
    """Find the projector that lights the marks in CLICKS where they were seen.

    CLICKS is a quilt_calibration file: six or more points of a spinning mirror and the pixels that light
    them. The points are listed with the worst first; the exit code is 1 where they are off by more than
    the tolerance, and then no display is written.
    """
    from quiltcli.calibration import clicks as library

    file, found = library.calibrate_file(clicks)
    if as_json:
        import json

        click.echo(json.dumps(library.figures(found), indent=2, allow_nan=False))
    else:
        for label, text in library.lines(found):
            click.echo(f"{label:<13} {text}")
        click.echo()
        print_aligned(library.COLUMNS, library.rows(file, found))
    library.within(clicks, found, tolerance)
    if output is not None:
        library.write_display(output, file, found, overwrite=overwrite)
