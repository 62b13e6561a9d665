"""`quilt points`: the colours of single lights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from quiltcli.cli.options import EXPOSURE, PATH, STILL_VIEW, frames_option
from quiltcli.cli.printing import print_files


@click.command()
@click.argument("out", type=PATH)
@click.option(
    "-o",
    "--output",
    type=PATH,
    required=True,
    help=".csv, .rgb or .dmx; with #### in its name a file for each frame.",
)
@frames_option("Frames; all there are by default.")
@click.option("--eye", type=click.Choice(("left", "right")), help="Which, where there are two.")
@click.option("--view", type=STILL_VIEW, default="srgb", show_default=True, help="How light becomes values.")
@EXPOSURE
@click.option("--bits", type=click.Choice(("8", "16")), default="8", show_default=True, help="Of a channel.")
@click.option("--order", default="rgb", show_default=True, help="Order of a light's channels, such as grb.")
@click.option(
    "--universe", type=click.IntRange(min=0), default=1, show_default=True, help="That of the first light."
)
@click.option(
    "--per-universe", type=click.IntRange(min=1), help="Lights in a universe; as many as it holds by default."
)
def points(
    out: Path,
    output: Path,
    frames: Sequence[int] | None,
    eye: str | None,
    view: str,
    exposure: float,
    bits: str,
    order: str,
    universe: int,
    per_universe: int | None,
) -> None:
    """Write a colour for each light, of OUT, the output folder of a render of a display of points.

    A table with universe and channel (.csv), the channels of all lights one after another (.rgb), or
    universes of 512 channels, in the order in which sACN and Art-Net send them (.dmx).
    """
    from quiltcli.exchange.points import Wiring, write_colors
    from quiltcli.images.preview import Look

    look = Look(view, exposure, int(bits))
    wiring = Wiring(look, order.lower(), universe, per_universe)
    written, lights = write_colors(out, output, wiring, frames, eye or "")
    print_files(written, output.parent)
    last = universe + (lights.count - 1) // wiring.lights
    click.echo(f"{lights.number.size:,} points, universes {universe} to {last}", err=True)
