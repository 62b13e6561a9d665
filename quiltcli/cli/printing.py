"""Tables on stdout."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

ROWS = 20  # of a table, before --all
_FILES = 12


def print_files(written: Sequence[Path], folder: Path) -> None:
    """The first files that were written, and how many more are in their folder."""
    for path in written[:_FILES]:
        click.echo(str(path))
    if len(written) > _FILES:
        click.echo(f"and {len(written) - _FILES} more in {folder}")


def print_rows(columns: Any, rows: Any) -> None:
    """A table on stdout: drawn on a terminal, separated by tabs elsewhere."""
    if not sys.stdout.isatty():
        for row in (columns, *rows):
            click.echo("\t".join(row))
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*columns, box=SIMPLE, pad_edge=False)
    for row in rows:
        table.add_row(*map(Text, row))  # brackets are brackets, not markup
    Console().print(table)


def print_aligned(columns: Any, rows: Any) -> None:
    """A table for people to read: drawn on a terminal, aligned by spaces elsewhere."""
    if sys.stdout.isatty():
        print_rows(columns, rows)
        return
    table = [tuple(columns), *map(tuple, rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        click.echo("  ".join(f"{text:<{width}}" for text, width in zip(row, widths, strict=True)).rstrip())
