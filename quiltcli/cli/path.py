"""`quilt path`: what a take is."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH, SETS
from quiltcli.cli.printing import ROWS, print_aligned


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "-o", "--output", type=PATH, metavar="PICTURE", help="Draw it from above and over time, .png or .svg."
)
@click.option("--viewer", help="Whose path, in a job with several viewers.")
@SETS
@click.option("--all", "every", is_flag=True, help=f"Every gap and jump, not only the first {ROWS}.")
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def path(
    file: Path, output: Path | None, viewer: str | None, sets: tuple[str, ...], every: bool, as_json: bool
) -> None:
    """Say what FILE is: the take of a tracker or a camera, or a job that is shown along one.

    How often and how well somebody was seen, what the filter changes, and what noise of the tracker does to
    the picture. What a take's file does not say is said with --set units=mm, --set up_axis=z, and so on, as
    in a job's path.recorded.
    """
    from quiltcli.analysis.path.plot import path_picture
    from quiltcli.analysis.path.report import GAP_COLUMNS, as_data, gap_rows, lines
    from quiltcli.analysis.path.study import study_path
    from quiltcli.analysis.sweetspot.picture import check_picture

    if output is not None:
        check_picture(output)
    study = study_path(file, sets, viewer)
    if output is not None:
        path_picture(study, output)
    if as_json:
        import json

        click.echo(json.dumps(as_data(study), indent=1, ensure_ascii=False, allow_nan=False))
        return
    for label, text in lines(study):
        click.echo(f"{label:<11}{text}")
    rows = gap_rows(study)
    if rows:
        click.echo()
        print_aligned(GAP_COLUMNS, rows if every else rows[:ROWS])
    if len(rows) > ROWS and not every:
        click.echo(f"and {len(rows) - ROWS:,} more (--all shows them)")
