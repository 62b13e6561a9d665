"""`quilt farm`: a job as render farms take it."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH, SETS


@click.command()
@click.argument("job", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="A name in .openjd.yaml or .outline.py.")
@click.option("--chunk", type=click.IntRange(min=1), default=10, show_default=True, help="Frames a task.")
@click.option("--command", default="quilt", show_default=True, help="How quilt is called on the farm.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads of a task; every core by default.")
@click.option(
    "--by",
    type=click.Choice(("eyes", "facets")),
    multiple=True,
    help="Hand out these too, beside frames; facets of jobs without quilts.",
)
@SETS
def farm(
    job: Path,
    output: Path,
    chunk: int,
    command: str,
    threads: int | None,
    by: tuple[str, ...],
    sets: tuple[str, ...],
) -> None:
    """Write JOB for a render farm: an Open Job Description template, or an outline of OpenCue."""
    from quiltcli.exchange.farms import FarmOptions, write_farm_job
    from quiltcli.job import load_job

    write_farm_job(output, job, load_job(job, sets), FarmOptions(chunk, command, threads, by, sets))
    click.echo(f"written to {output}")
