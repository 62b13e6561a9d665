"""`quilt verify`: a frame against ray casts."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import PATH, SETS, THREADS
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", type=int, help="The frame; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="Folder of the images, instead of the job's.")
@click.option("--redraw", is_flag=True, help="Draw the frame in memory even if its images exist.")
@click.option("--all", "everything", is_flag=True, help="Look at every pixel, not a sample.")
@click.option("--pixels", type=click.IntRange(min=1), help="Pixels to look at; 200000 by default.")
@click.option("--json", "as_json", type=PATH, metavar="FILE", help="Write the result as JSON; - is stdout.")
@click.option("--picture", type=PATH, help="Draw the pages with a mark at every fault, as .png.")
@THREADS
@SETS
def verify(
    job: Path,
    frame: int | None,
    output: Path | None,
    redraw: bool,
    everything: bool,
    pixels: int | None,
    as_json: Path | None,
    picture: Path | None,
    threads: int | None,
    sets: tuple[str, ...],
) -> None:
    """Hold a frame of JOB against ray casts, pixel by pixel; exit 1 if a tolerance is missed."""
    from quiltcli.analysis.verify import SAMPLE, VerifyOptions
    from quiltcli.analysis.verify import verify as verify_frame
    from quiltcli.analysis.verify.picture import write_picture
    from quiltcli.job import load_job

    options = VerifyOptions(frame, everything, pixels or SAMPLE, output, redraw, threads or 0)
    verdict, stage, images = verify_frame(load_job(job, sets), options)
    _print_verdict(verdict, as_json)
    if picture is not None:
        write_picture(picture, stage.layout, images, verdict.faults)
    if not verdict.passed:
        sys.exit(1)


def _print_verdict(verdict: Any, as_json: Path | None) -> None:
    """The verdict as a table on stdout, as JSON, or both."""
    import json

    from quiltcli.analysis.verify import COLUMNS, verdict_rows
    from quiltcli.formats.whole import write_text

    text = json.dumps(verdict.as_json(), indent=2, allow_nan=False)
    if as_json == Path("-"):
        click.echo(text)
        return
    if as_json is not None:
        write_text(as_json, text + "\n")
    print_aligned(COLUMNS, verdict_rows(verdict))
    click.echo(f"frame {verdict.frame}, {verdict.images}: {verdict.words}")
