"""`quilt new`: a job from tape-measure figures."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from quiltcli.cli.options import PATH, POINT, SIZE
from quiltcli.errors import JobError

if TYPE_CHECKING:
    from quiltcli.exchange.newjob.wishes import Wishes


@click.command()
@click.argument("kind", required=False)
@click.option("-o", "--output", type=PATH, help="Folder for the job.")
@click.option("--list", "listing", is_flag=True, help="Name the kinds and leave.")
@click.option("--size", metavar="8x4.5m", help="Width x height (x depth); a length, or pixels: 1333x750px.")
@click.option("--left", metavar="8x4.5m", help="Left wall of a corner.")
@click.option("--right", metavar="6x4.5m", help="Right wall of a corner.")
@click.option("--angle", type=float, help="Degrees between the lit sides of a corner: 90, or 270 outside.")
@click.option("--radius", metavar="6m", help="Radius of a curve; negative bends away from the viewer.")
@click.option("--columns", type=int, help="Flat columns of a curve, cylinder, sphere or arena.")
@click.option("--rows", type=int, help="Rows of a sphere, or of an arena's panels.")
@click.option("--steps", type=int, help="Steps of stairs.")
@click.option("--preset", metavar="G6_2x10", help="A known arena.")
@click.option("--installed", type=int, help="Columns of an arena that are there; the gap is behind.")
@click.option("--pitch", metavar="6mm", help="Distance from pixel to pixel.")
@click.option("--pixels", metavar="1920x1080", help="Pixels of every panel, instead of a pitch.")
@click.option("--cabinet", metavar="500x500mm/128x128px", help="Size and pixels of a cabinet.")
@click.option("--base", metavar="1m", help="Height of the lower edge over the ground.")
@click.option("--inside", is_flag=True, help="Cylinder, sphere: lit inside, around the viewer.")
@click.option("--ceiling", is_flag=True, help="A cave with a ceiling.")
@click.option("--treads/--no-treads", default=True, help="Stairs whose treads are lit as well.")
@click.option("--eye", type=POINT, metavar="X,Y,Z", help="Where the viewer's eye is, metres.")
@click.option("--canvas", type=SIZE, metavar="2112x1024", help="Pixels of the processor's canvas.")
@click.option(
    "--place", "places", metavar="NAME=X,Y[,TURN]", multiple=True, help="A panel's spot on the canvas."
)
@click.option("--padding", type=click.IntRange(min=0), default=0, help="Pixels between panels on the canvas.")
@click.option("--scene", help="Mesh to show, instead of a stand-in.")
@click.option("--frames", default="1-48", show_default=True, help="Frames of the job.")
@click.option("--fps", type=click.IntRange(min=1), default=24, show_default=True, help="Frames a second.")
def new(kind: str | None, output: Path | None, listing: bool, **figures: Any) -> None:
    """Write a job of this KIND, ready to render, from what a tape measure says.

    Figures that are missing are asked for on a terminal. --list names the kinds.
    """
    from quiltcli.analysis.check import check_files
    from quiltcli.exchange.newjob.kinds import KINDS
    from quiltcli.exchange.newjob.wishes import Wishes
    from quiltcli.exchange.newjob.write import write_new_job

    if listing:
        for name, known in KINDS.items():
            click.echo(f"{name:10}{known.about}")
        return
    if kind is None or output is None:
        absent = "a KIND (quilt new --list names them)" if kind is None else "-o FOLDER"
        raise click.UsageError(f"expected {absent}")
    written = write_new_job(_complete(Wishes(kind, **figures)), output)
    for path in written:
        click.echo(str(path))
    check_files([path for path in written if path.name == "job.yaml"], _note)


def _note(words: str) -> None:
    click.echo(f"note: {words}", err=True)


def _complete(wishes: Wishes) -> Wishes:
    """The wishes with what they lack asked for, where there is somebody to ask."""
    from quiltcli.exchange.newjob.kinds import missing

    asked = missing(wishes)
    if asked and not _somebody_to_ask():
        lines = [f"--{'pitch' if name == 'grain' else name}: {text}" for name, text in asked.items()]
        raise JobError(f"{wishes.kind} needs to be told more:\n  " + "\n  ".join(lines))
    for name, question in asked.items():
        kind = int if name in ("columns", "rows", "steps") else str
        answer: Any = click.prompt(question if name == "grain" else f"{name}: {question}", type=kind)
        given: dict[str, Any] = {_grain_key(answer) if name == "grain" else name: answer}
        wishes = replace(wishes, **given)
    return wishes


def _somebody_to_ask() -> bool:
    return sys.stdin.isatty()


def _grain_key(answer: str) -> str:
    """Which of the three ways to say how many pixels there are an answer is."""
    if "/" in answer and "x" in answer:
        return "cabinet"
    return "pixels" if answer.strip().lower().endswith("px") else "pitch"
