"""`quilt info`: what a file is."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH
from quiltcli.cli.printing import ROWS, print_aligned


@click.command()
@click.argument("file", type=PATH)
@click.option("--all", "every", is_flag=True, help=f"Every row of the table, not only the first {ROWS}.")
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def info(file: Path, every: bool, as_json: bool) -> None:
    """Say what FILE is: a display, layout, scene, job, mesh, EXR image, or the output folder of a render."""
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
