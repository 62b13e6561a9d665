"""`quilt project`: a picture made for the viewpoint, onto the facets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import COLORSPACE, OVERWRITE, PATH, SETS, THREADS, frames_option, refuse_typed


@click.command()
@click.argument("job", type=PATH)
@click.option(
    "--picture",
    "path",
    type=PATH,
    required=True,
    help="Picture or film; #### stands for the frame number, {face} for right, left, up, down, front, back.",
)
@click.option(
    "--as",
    "kind",
    type=click.Choice(("pinhole", "equirect", "cubemap", "fisheye")),
    required=True,
    help="What it is.",
)
@click.option("-o", "--output", type=PATH, required=True, help="Folder for pages and facet images.")
@click.option("--fov-deg", "fov", type=float, help="Of a pinhole: its angle across, as the viewer looks.")
@click.option("--camera", type=PATH, help="Of a pinhole: its camera, in USD, glTF or JSON of quilt cameras.")
@click.option("--camera-name", default="", help="Which camera of the file.")
@click.option("--yaw-deg", "yaw", type=float, default=0.0, help="Turn its front from −Z to the left.")
@click.option("--aperture-deg", "aperture", type=float, default=180.0, help="Of a fisheye: its circle.")
@click.option("--tilt-deg", "tilt", type=float, default=0.0, help="Of a fisheye: its middle from the zenith.")
@click.option(
    "--stereo",
    type=click.Choice(("side-by-side", "top-bottom")),
    help="Both eyes' pictures are halves of it.",
)
@click.option("--st-map", is_flag=True, help="Write maps from pages to the picture, for compositors.")
@frames_option("Frames; the job's by default.")
@COLORSPACE
@OVERWRITE
@THREADS
@SETS
def project(
    job: Path,
    output: Path,
    st_map: bool,
    frames: tuple[int, ...] | None,
    stereo: str | None,
    overwrite: bool,
    threads: int | None,
    sets: tuple[str, ...],
    **master: Any,
) -> None:
    """Put a picture made for JOB's viewer, or a sequence of them, on the facets."""
    from quiltcli.cli.progress import watched
    from quiltcli.exchange.elsewhere import MadeOptions
    from quiltcli.exchange.project.master import Master
    from quiltcli.exchange.project.project import project as put_on_facets
    from quiltcli.job import load_job

    if master["kind"] != "fisheye":
        refuse_typed(f"with --as {master['kind']}", ("aperture", "tilt"))
    if master["kind"] == "pinhole":
        refuse_typed("with --as pinhole, which looks as the job's viewer does, or its camera", ("yaw",))
    loaded, picture = load_job(job, sets), Master(stereo=stereo or "", **master)
    options = MadeOptions(output, frames, overwrite, threads or 0)
    records = watched(lambda listener: put_on_facets(loaded, picture, options, listener, st_map=st_map))
    click.echo(f"{len(records)} view{'s' * (len(records) != 1)} written to {output}")
