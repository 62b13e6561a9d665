"""`quilt simulate`: the lit display, seen from somewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import (
    EXPOSURE,
    EYE,
    PAIR,
    PATH,
    POINT,
    SETS,
    SIZE,
    THREADS,
    VIEW,
    frames_option,
    refuse_typed,
)
from quiltcli.cli.stereo import MATRICES


@click.command()
@click.argument("job", type=PATH)
@frames_option("Frames such as 7 or 1-12; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="PNG to write; #### in its name is the frame number.")
@click.option("--video", type=PATH, help="Film to write of all the frames, as .mp4 or .mov.")
@click.option("--size", type=SIZE, default="1200x900", show_default=True, help="Size of the picture.")
@click.option("--from", "place", type=POINT, metavar="X,Y,Z", help="Look from here; from the eye by default.")
@click.option("--look-at", type=POINT, metavar="X,Y,Z", help="Look there; at the display by default.")
@click.option("--third-person", is_flag=True, help="Show the viewer too, with rays to the display's outline.")
@click.option(
    "--scene",
    type=click.Choice(("ghost", "solid", "none")),
    default="ghost",
    help="As a third person sees it.",
)
@click.option("--fov", type=click.FloatRange(0, 170, min_open=True), help="Degrees from top to bottom.")
@click.option("--filter", type=click.Choice(("nearest", "linear")), default="linear", show_default=True)
@click.option(
    "--supersample", type=click.IntRange(1, 16), default=2, show_default=True, help="Rays across a pixel."
)
@click.option(
    "--compare/--no-compare",
    default=None,
    help="From the eye, compare with a direct picture; not for a film alone.",
)
@click.option(
    "--eye",
    type=EYE,
    metavar="left|right|AZ,H,D",
    help="One eye of two; both by default. On a ring, azimuth in degrees, height and distance in metres.",
)
@click.option("--glasses", type=click.Choice(MATRICES), help="Both eyes' pictures as one anaglyph.")
@click.option("--edges", is_flag=True, help="Draw a line along the edges of the facets.")
@click.option("--head", is_flag=True, help="Draw the viewer's head, as --third-person sees it.")
@click.option(
    "--triptych",
    is_flag=True,
    help="Beside each other: the scene without a display, the display from the eye, the display unfolded;"
    " --size is that of each, 640x480 by default.",
)
@click.option(
    "--corrected/--uncorrected",
    default=True,
    help="Images that make up for the panels (corrections in the display file), or as if they did not.",
)
@click.option("--direct", type=PATH, help="Write the direct picture, as PNG.")
@click.option("--heat-map", type=PATH, help="Write a picture of the errors, as PNG.")
@click.option("--view", type=VIEW, default="aces", show_default=True, help="How light becomes colour.")
@click.option(
    "--content",
    type=click.Choice(("mcop", "perspective", "diffuse")),
    default="mcop",
    help="On a ring: what the mirror shows, to compare with the exact map (mcop).",
)
@click.option("--tones", is_flag=True, help="On a ring: tones, not bits.")
@click.option("--slices", is_flag=True, help="On a ring: alternate mirror positions dark and bright.")
@click.option("--photometric", is_flag=True, help="On a ring: leave gaps between mirror positions dark.")
@click.option("--aperture", type=PAIR, metavar="W,H", help="On a ring: a camera's opening, metres.")
@click.option("--focus", type=float, help="On a ring: where such a camera is sharp; the axis by default.")
@EXPOSURE
@THREADS
@SETS
@click.pass_context
def simulate(
    context: click.Context, /, job: Path, frames: tuple[int, ...] | None, sets: tuple[str, ...], **how: Any
) -> None:
    """Light the display of JOB with its images and look at it.

    From the viewer's eye the picture is compared with a direct one of the scene; the figures go to
    stdout. The images are those that a render has left; where there are none they are drawn in memory.
    """
    from quiltcli.analysis.simulate import PictureOptions
    from quiltcli.analysis.simulate.files import Pictures, write_pictures
    from quiltcli.job import load_job

    wanted = ("direct", "heat_map", "view", "exposure", "video")
    glasses, how["eye"] = how.pop("glasses") or "", how["eye"] or ""
    pictures = Pictures(how.pop("output"), **{name: how.pop(name) for name in wanted}, glasses=glasses)
    if pictures.picture is None and pictures.video is None:
        raise click.UsageError("nothing to write: give -o PICTURE.png, --video FILM.mp4, or both")
    if how["compare"] is None:
        how["compare"] = any((pictures.picture, pictures.direct, pictures.heat_map))
    if how["size"] is None:
        raise click.UsageError("--size: a picture needs a width and a height")
    _check_kinds(how)
    if how["triptych"] and context.get_parameter_source("size") is click.core.ParameterSource.DEFAULT:
        how["size"] = (640, 480)
    samples, threads = how.pop("supersample"), how.pop("threads") or 0
    loaded = load_job(job, sets)
    ring = {name: how.pop(name) for name in _RING}
    if loaded.ring is not None:
        refuse_typed("on a ring of viewers", but=(*_RING, *_ANYWHERE))
        _around(loaded, frames or loaded.frames[:1], pictures, {**ring, **how})
        return
    refuse_typed("without a ring of viewers", _RING)
    if isinstance(how["eye"], tuple):
        raise click.UsageError("--eye: expected left or right, for the viewers of this job are no ring")
    options = PictureOptions(samples=samples, threads=threads, resampled=True, **how)
    for line in write_pictures(loaded, frames or loaded.frames[:1], options, pictures, _note):
        click.echo(line)


def _check_kinds(how: dict[str, Any]) -> None:
    """Refuse kinds of pictures that exclude each other."""
    if how["head"] and not how["third_person"]:
        raise click.UsageError("--head is what a third person sees (give --third-person too)")
    if not how["triptych"]:
        return
    for name, option in (("third_person", "--third-person"), ("place", "--from"), ("look_at", "--look-at")):
        if how[name]:
            raise click.UsageError(f"--triptych is seen from the eye (expected no {option} beside it)")


_RING = ("content", "tones", "slices", "photometric", "aperture", "focus")
_ANYWHERE = (
    *("job", "frames", "output", "size", "eye", "direct", "heat_map", "view", "exposure", "threads", "sets"),
    "video",
)


def _around(job: Any, frames: Any, pictures: Any, how: dict[str, Any]) -> None:
    """Look at a spinning mirror from one place, or from where the ring and every user are."""
    from quiltcli.analysis.ring.files import write_eye_pictures
    from quiltcli.analysis.ring.simulate import EyeOptions

    if pictures.picture is None or pictures.video is not None:
        raise click.UsageError("give -o PICTURE.png (a film of a ring comes from its pictures)")
    eye = how["eye"] or None
    if isinstance(eye, str):
        raise click.UsageError("--eye: expected AZIMUTH,HEIGHT,DISTANCE on a ring of viewers")
    options = EyeOptions(eye=eye, **{name: how[name] for name in (*_RING, "size")})
    for line in write_eye_pictures(job, frames, options, pictures):
        click.echo(line)


def _note(notice: str) -> None:
    """Say what is good to know, beside the figures."""
    click.echo(f"note: {notice}", err=True)
