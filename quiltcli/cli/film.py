"""`quilt film`: the images of a render as films and numbered pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import EXPOSURE, OVERWRITE, PATH, SIZE, frames_option, refuse_typed

_CODECS = ("prores", "h264", "h265", "dnxhr", "hap", "dxv", "png", "tiff", "dpx")


@click.command()
@click.argument("out", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="A film, or a folder for several.")
@click.option(
    "--of",
    "subject",
    type=click.Choice(("pages", "facets", "simulation")),
    default="pages",
    show_default=True,
    help="Pages, facets' images, or what the viewer sees of the display.",
)
@click.option("--codec", type=click.Choice(_CODECS), help="ProRes for .mov and H.264 for .mp4 by default.")
@frames_option("Frames; all there are by default.")
@click.option("--view", help="View of the screen, as OpenColorIO has it; Un-tone-mapped by default.")
@click.option("--display", help="The screen; sRGB - Display by default.")
@click.option(
    "--config", metavar="NAME", help="Configuration: ocio://… or a file; a pinned ACES one by default."
)
@EXPOSURE
@click.option(
    "--bits", type=click.Choice(("8", "16")), default="8", show_default=True, help="Of PNG and TIFF."
)
@click.option("--size", type=SIZE, default="1920x1080", show_default=True, help="Of a simulation.")
@OVERWRITE
def film(
    out: Path,
    output: Path,
    bits: str,
    size: tuple[int, int] | None,
    exposure: float,
    view: str | None,
    display: str | None,
    config: str | None,
    **how: Any,
) -> None:
    """Make films, or folders of numbered pictures, of the images in OUT, the output folder of a render."""
    from quiltcli.exchange.film.film import FilmOptions, make_film
    from quiltcli.images.grade import Grade

    if how["subject"] != "simulation":
        refuse_typed("without --of simulation", ("size",))
    if how["codec"] not in ("png", "tiff"):
        refuse_typed("without --codec png or tiff", ("bits",))
    given = {"view": view, "display": display, "config": config}
    grade = Grade(exposure=exposure, **{name: value for name, value in given.items() if value is not None})
    options = FilmOptions(grade=grade, bits=int(bits), size=size or (1920, 1080), **how)
    make_film(out, output, options, click.echo)
