"""`quilt study`: how easy displays are to use."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("log", type=PATH)
@click.option("-o", "--output", type=PATH, help="Write a page, REPORT.html, and REPORT.json beside it.")
@click.option("--skip", metavar="TASK", multiple=True, help="Leave a task out; may be given again.")
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def study(log: Path, output: Path | None, skip: tuple[str, ...], as_json: bool) -> None:
    """How easy are displays to use, by the LOG of a study?

    LOG is a CSV table with the columns person, task, display, optimal_length, path_length, undos, motions,
    seconds; visibility, interactivity and overall hold ratings, if there are any. Ease of use is that of
    Harish & Narayanan's equation 6. Prints means with 95 % intervals and a paired test of each two displays.
    """
    from quiltcli.analysis.ease.ease import ease_of_use
    from quiltcli.analysis.ease.log import read_log
    from quiltcli.analysis.ease.report import check_report, write_report
    from quiltcli.analysis.ease.table import (
        DISPLAY_COLUMNS,
        display_rows,
        person_columns,
        person_rows,
        study_data,
        words_of,
    )

    if output is not None:
        check_report(output)
    ease = ease_of_use(read_log(log, skip))
    paths = () if output is None else write_report(ease, output)
    if as_json:
        import json

        click.echo(json.dumps(study_data(ease), indent=1, ensure_ascii=False, allow_nan=False))
        return
    print_aligned(person_columns(ease), person_rows(ease))
    click.echo()
    print_aligned(DISPLAY_COLUMNS, display_rows(ease))
    click.echo()
    for words in words_of(ease):
        click.echo(words)
    for path in paths:
        click.echo(f"written to {path}")
