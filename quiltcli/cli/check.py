"""`quilt check`: every problem of a file."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from quiltcli.cli.options import PATH


@click.command()
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Fail on what is only worth a second look, too.")
@click.option(
    "--for",
    "target",
    type=click.Choice(("disguise", "7thsense", "resolume", "hap")),
    help="Hold a job's names and sizes against what those who play the images ask.",
)
def check(files: tuple[Path, ...], strict: bool, target: str | None) -> None:
    """Read FILES strictly and report every problem found; what is only worth a second look goes to stderr."""
    from quiltcli.analysis.check import check_files

    notices: list[str] = []
    plans: list[str] = []
    problems = check_files(files, notices.append, target or "", plans.append)
    for problem in problems:
        click.echo(str(problem))
    if problems:
        sys.exit(1)
    for notice in notices:
        click.echo(f"note: {notice}", err=True)
    if strict and notices:
        click.echo(f"{len(notices)} note{'s' * (len(notices) > 1)}, which --strict does not allow", err=True)
        sys.exit(1)
    for plan in plans:
        click.echo(plan, err=True)
    click.echo(f"{len(files)} file{'s' * (len(files) > 1)}: nothing is wrong", err=True)
