"""Commands that make and prove images: render, verify, unmap."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.group import main
from quiltcli.cli.options import FACETS, FRAMES, PATH
from quiltcli.cli.printing import print_aligned


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frames", type=FRAMES, help="Frames such as 1-240, 1-9x2 or 1,5,20-30; inclusive.")
@click.option("-o", "--output", type=PATH, help="Output folder, instead of the job's.")
@click.option("--resume", is_flag=True, help="Skip frames that are complete and made by the same job.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
@click.option("--facets", type=FACETS, help="Draw only these facets, such as 3,7-9, into existing quilts.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option("--scheduler", metavar="ADDRESS", help="Hand the frames to a dask scheduler.")
@click.option("--dry-run", is_flag=True, help="Find every problem, write nothing.")
@click.option("--profile", is_flag=True, help="Say where the time went, by stage.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
def render(
    job: Path,
    frames: tuple[int, ...] | None,
    output: Path | None,
    resume: bool,
    overwrite: bool,
    facets: tuple[int, ...] | None,
    threads: int | None,
    scheduler: str | None,
    dry_run: bool,
    profile: bool,
    sets: tuple[str, ...],
) -> None:
    """Render the frames of JOB: quilts, facet images, report."""
    from quiltcli.job import load_job
    from quiltcli.render.sequence import RenderOptions

    if resume and overwrite:
        raise click.UsageError("--resume keeps finished frames and --overwrite replaces them: give one")
    options = RenderOptions(frames, output, resume, overwrite, facets, threads or 0, dry_run)
    records = _render(load_job(job, sets), options, scheduler)
    if profile and records:
        _print_profile(records)


def _render(job: Any, options: Any, scheduler: str | None) -> Any:
    """Render here or on a farm, with progress on stderr and the summary on stdout."""
    from quiltcli.cli.progress import progress
    from quiltcli.render.farm import render_on
    from quiltcli.render.interrupt import Stopped
    from quiltcli.render.report import summary_warnings
    from quiltcli.render.sequence import Listener
    from quiltcli.render.sequence import render as render_here

    def work(*given: Any) -> Any:
        return render_here(*given) if scheduler is None else render_on(scheduler, *given)

    with progress() as shown:
        try:
            records = work(job, options, Listener(shown.begin, shown.frame_done, shown.say))
        except Stopped as stopped:
            shown.say(str(stopped))
            sys.exit(stopped.exit_code)
    for warning in summary_warnings(records):
        click.echo(f"warning: {warning}", err=True)
    if options.dry_run:
        click.echo("nothing is wrong with this job")
    elif records:
        _print_summary(records)
        click.echo(f"written to {options.folder or job.output.directory}")
    else:
        click.echo("every frame is complete already")
    return records


def _print_profile(records: Any) -> None:
    """Where the time of the run went."""
    from quiltcli.render.report import PROFILE_COLUMNS, profile_rows

    click.echo()
    print_aligned(PROFILE_COLUMNS, profile_rows(records))


def _print_summary(records: Any) -> None:
    """The summary table, plain where stdout is no terminal."""
    from rich.console import Console

    from quiltcli.render.report import summary, summary_table

    if sys.stdout.isatty():
        Console().print(summary_table(records))
        return
    for label, value in summary(records):
        click.echo(f"{label:<24}{value}")


@main.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", type=int, help="The frame; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="Folder of the images, instead of the job's.")
@click.option("--redraw", is_flag=True, help="Draw the frame in memory even if its images exist.")
@click.option("--all", "everything", is_flag=True, help="Look at every pixel, not a sample.")
@click.option("--pixels", type=click.IntRange(min=1), help="Pixels to look at; 200000 by default.")
@click.option("--json", "as_json", type=PATH, metavar="FILE", help="Write the result as JSON; - is stdout.")
@click.option("--picture", type=PATH, help="Draw the pages with a mark at every fault, as .png.")
@click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
@click.option(
    "--set", "sets", metavar="KEY=VALUE", multiple=True, help="Set a value of the job, by dotted path."
)
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


@main.command()
@click.argument("quilts", nargs=-1, required=True, type=PATH)
@click.option("--layout", type=PATH, required=True, help="The layout the quilts were made for.")
@click.option("-o", "--output", type=PATH, required=True, help="Folder for the facet images.")
@click.option("--overwrite", is_flag=True, help="Replace images that exist.")
def unmap(quilts: tuple[Path, ...], layout: Path, output: Path, overwrite: bool) -> None:
    """Cut facet images out of existing QUILTS."""
    from quiltcli.images.unmap import unmap as unmap_quilts
    from quiltcli.layout import read_layout

    written = unmap_quilts(quilts, read_layout(layout), output, overwrite=overwrite)
    click.echo(f"{len(written)} facet images in {output / 'facets'}")
