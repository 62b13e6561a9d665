"""`quilt diff`: two images, sequences or folders."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import PATH
from quiltcli.cli.printing import print_rows


@click.command()
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
