"""`quilt cameras`: the facets' cameras, for other renderers."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH, SETS, frames_option


@click.command()
@click.argument("job", type=PATH)
@click.option(
    "-o",
    "--output",
    type=PATH,
    required=True,
    help="File to write: .json, .py (Blender), .usda, .pvx (ParaView) or .sgct.json.",
)
@frames_option("Frames, such as 1-240; the job's by default.")
@SETS
def cameras(job: Path, output: Path, frames: tuple[int, ...] | None, sets: tuple[str, ...]) -> None:
    """Write the exact camera of every facet, frame and eye of JOB: its picture is the facet's image."""
    from quiltcli.exchange.cameras.write import write_cameras
    from quiltcli.job import load_job
    from quiltcli.render.setup import set_stage

    loaded = load_job(job, sets)
    count = write_cameras(set_stage(loaded), frames or loaded.frames, output)
    click.echo(f"{count} camera{'s' * (count != 1)} {output}")
