"""`quilt assemble`: pictures of facets made elsewhere, into pages."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import COLORSPACE, OVERWRITE, PATH, SETS, THREADS, frames_option


@click.command()
@click.argument("job", type=PATH)
@click.option("--from", "folder", type=PATH, required=True, help="Folder of the pictures.")
@click.option("-o", "--output", type=PATH, required=True, help="Folder for pages and facet images.")
@click.option(
    "--pattern",
    default="{name}{.eye}.{frame:04}",
    show_default=True,
    help="Names of the pictures: {name} or {facet:04}, {frame:04} or ####, {.eye} or {eye}.",
)
@click.option("--cameras", type=PATH, help="The cameras they were made through; older pictures are refused.")
@click.option(
    "--depth",
    type=click.Choice(("axis", "distance", "job")),
    help="What their depth measures: along the camera's axis (else), along the ray, or what the job's does.",
)
@click.option("--allow-missing", is_flag=True, help="Leave facets dark whose pictures are missing.")
@frames_option("Frames; the job's by default.")
@COLORSPACE
@OVERWRITE
@THREADS
@SETS
def assemble(
    job: Path,
    folder: Path,
    output: Path,
    pattern: str,
    cameras: Path | None,
    depth: str | None,
    allow_missing: bool,
    frames: tuple[int, ...] | None,
    colorspace: str,
    overwrite: bool,
    threads: int | None,
    sets: tuple[str, ...],
) -> None:
    """Put pictures of facets, which another renderer has made for JOB, into pages and facet images."""
    from quiltcli.cli.progress import watched
    from quiltcli.exchange.assemble import Source
    from quiltcli.exchange.assemble import assemble as put_together
    from quiltcli.exchange.elsewhere import MadeOptions
    from quiltcli.job import load_job

    source = Source(folder, pattern, cameras, colorspace, allow_missing, depth)
    options = MadeOptions(output, frames, overwrite, threads or 0)
    loaded = load_job(job, sets)
    records = watched(lambda listener: put_together(loaded, source, options, listener))
    click.echo(f"{len(records)} view{'s' * (len(records) != 1)} written to {output}")
