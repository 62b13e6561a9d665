"""`quilt facet`: a curved display cut into flat facets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import PATH
from quiltcli.cli.printing import print_files


def _pixels(context: click.Context, option: click.Parameter, value: str) -> float:
    try:
        pixels = float(value.strip().removesuffix("px"))
    except ValueError:
        pixels = 0.0
    if not 1e-6 <= pixels <= 1e6:
        raise click.BadParameter(f"expected pixels such as 0.25px, got {value!r}")
    return pixels


@click.command()
@click.argument("display", type=PATH)
@click.option(
    "-o", "--output", type=PATH, required=True, help="Display file to write; its mesh goes beside it."
)
@click.option(
    "--error",
    default="0.25px",
    show_default=True,
    callback=_pixels,
    help="How far the surface may be away from its facets, pixels.",
)
@click.option("--limit", type=click.IntRange(min=1), help="Facets at most.")
def facet(display: Path, output: Path, error: float, limit: int | None) -> None:
    """Cut the curved surface of DISPLAY into flat facets with the same pixels.

    For whatever needs planes: nets, panels of their own, other programs. A picture for the flat facets is one
    for the surface, off by --error pixels at most as seen from straight above.
    """
    from quiltcli.exchange.flatten import MOST, flatten_display

    given: dict[str, Any] = {"most": limit or MOST}
    found = flatten_display(display, output, error, **given)
    click.echo(f"{found.facets:,} facets, at most {found.error:.3g} pixels off the surface")
    print_files(list(found.files), output.parent)
