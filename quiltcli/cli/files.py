"""Commands that say what files are: check, info, diff."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.group import main
from quiltcli.cli.options import PATH
from quiltcli.cli.printing import ROWS, print_aligned, print_rows


@main.command()
@click.argument("files", nargs=-1, required=True, type=PATH)
def check(files: tuple[Path, ...]) -> None:
    """Read FILES strictly and report every problem found."""
    from quiltcli.analysis.check import check_files

    problems = check_files(files)
    for problem in problems:
        click.echo(str(problem))
    if problems:
        sys.exit(1)
    click.echo(f"{len(files)} file{'s' * (len(files) > 1)}: nothing is wrong", err=True)


@main.command()
@click.argument("file", type=PATH)
@click.option("--all", "every", is_flag=True, help=f"Every row of the table, not only the first {ROWS}.")
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def info(file: Path, every: bool, as_json: bool) -> None:
    """Say what FILE is: a display, layout, scene, job, mesh or EXR image."""
    from quiltcli.analysis.info import describe

    found = describe(file)
    if as_json:
        import json

        click.echo(json.dumps(found.as_json(), indent=2, ensure_ascii=False, allow_nan=False))
        return
    width = max(len(label) for label, _ in found.lines)
    for label, text in (("", f"{found.kind} {file}"), *found.lines):
        click.echo(f"{label:<{width}}  {text}" if label else text)
    rows = found.rows if every else found.rows[:ROWS]
    if rows:
        click.echo()
        print_aligned(found.columns, rows)
    if len(rows) < len(found.rows):
        click.echo(f"and {len(found.rows) - len(rows):,} more (--all shows them)")


@main.command()
@click.argument("a", type=PATH)
@click.argument("b", type=PATH)
@click.option("--fail", type=float, default=0.0, show_default=True, help="Difference a pixel may not exceed.")
@click.option("--fail-percent", type=float, default=0.0, show_default=True, help="Share of pixels that may.")
@click.option("--hard-fail", type=float, help="Difference no pixel may exceed.")
@click.option("--warn", type=float, help="Difference that is worth a warning.")
@click.option(
    "--warn-percent", type=float, default=0.0, show_default=True, help="Share of pixels that may have it."
)
def diff(a: Path, b: Path, **limits: Any) -> None:
    """Compare two images, EXR sequences or output folders, all parts and channels.

    Exit codes are idiff's: 0 match, 1 warning, 2 failure, 3 size, 4 file error.
    """
    from quiltcli.images.diff import COLUMNS, Limits, diff_rows
    from quiltcli.images.diff import diff as compare

    result = compare(a, b, Limits(**{name: value for name, value in limits.items() if value is not None}))
    print_rows(COLUMNS, diff_rows(result))
    sys.exit(result.code)
