"""`quilt render`: the frames of a job."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import FACETS, OVERWRITE, PATH, POSITIONS, SETS, THREADS, frames_option
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("job", type=PATH)
@frames_option("Frames such as 1-240, 1-9x2 or 1,5,20-30; inclusive.")
@click.option("-o", "--output", type=PATH, help="Output folder, instead of the job's.")
@click.option("--resume", is_flag=True, help="Skip frames that are complete and made by the same job.")
@OVERWRITE
@click.option(
    "--facets",
    type=FACETS,
    help="Draw only these facets, such as 3,7-9 or left,right, into existing quilts, if it has quilts.",
)
@click.option("--eye", type=click.Choice(("left", "right")), help="Draw only one eye of two.")
@click.option(
    "--positions",
    type=POSITIONS,
    help="Draw only these mirror positions of a 360° light field display, such as 1-72 or 1-288x12.",
)
@THREADS
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Hand the frames to a dask scheduler; it and its workers need the same quilt, and workers the same"
    " files at the same paths.",
)
@click.option(
    "--progress",
    type=click.Choice(("auto", "openjd")),
    default="auto",
    is_eager=True,
    help="openjd: lines for farms of Open Job Description, whose frames may have a step 1-9:2.",
)
@click.option("--dry-run", is_flag=True, help="Find every problem, write nothing.")
@click.option("--scale", metavar="SHARE", help="Draw fewer pixels, 1/4 across and down, for a proxy.")
@click.option(
    "--max-memory",
    "memory",
    metavar="SIZE",
    help="Take at most so much, such as 8GB: fewer workers, or refuse.",
)
@click.option("--strict", is_flag=True, help="Refuse what would only be worth a second look.")
@click.option("--profile", is_flag=True, help="Say where the time went, by stage.")
@SETS
def render(
    job: Path,
    frames: tuple[int, ...] | None,
    output: Path | None,
    resume: bool,
    overwrite: bool,
    facets: tuple[int, ...] | str | None,
    eye: str | None,
    positions: tuple[int, ...] | None,
    threads: int | None,
    scheduler: str | None,
    progress: str,
    dry_run: bool,
    scale: str | None,
    memory: str | None,
    strict: bool,
    profile: bool,
    sets: tuple[str, ...],
) -> None:
    """Render the frames of JOB: quilts, facet images, report."""
    from quiltcli.job import load_job
    from quiltcli.render.sequence import RenderOptions

    if resume and overwrite:
        raise click.UsageError("--resume keeps finished frames and --overwrite replaces them: give one")
    if memory is not None:
        from quiltcli.formats.capacity import limit_memory, read_bytes

        limit_memory(read_bytes(memory))
    if scale is not None:
        sets = (*sets, f"render.scale={scale}")
    loaded = load_job(job, sets)
    if loaded.ring is not None:
        if facets is not None or eye is not None or scheduler is not None:
            words = "a 360° light field display has no facets, and its turns are drawn by one machine's cores"
            raise click.UsageError(f"--facets, --eye, --scheduler: {words} (--positions draws some of them)")
        from quiltcli.render.ring.walk import RingOptions

        how = RingOptions(frames, output, positions, resume, overwrite, threads or 0, dry_run, strict)
        _render_turns(loaded, how, profile=profile)
        return
    if positions is not None:
        raise click.UsageError("--positions are a 360° light field display's, and this job's has facets")
    ids = _named(loaded, facets) if isinstance(facets, str) else facets
    options = RenderOptions(frames, output, resume, overwrite, ids, eye, threads or 0, dry_run, strict)
    records = _render(loaded, options, scheduler, progress)
    if profile and records:
        _print_profile(records)


def _named(job: Any, text: str) -> tuple[int, ...]:
    """Ids of facets that are given by name."""
    from quiltcli.display import load_display
    from quiltcli.display.named import facet_ids
    from quiltcli.job import load_display_file

    return facet_ids(text, load_display(load_display_file(job.display)).names)


def _render(job: Any, options: Any, scheduler: str | None, form: str) -> Any:
    """Render here or on a farm, with progress on stderr and the summary on stdout."""
    from quiltcli.cli.progress import watched
    from quiltcli.render.farm import render_on
    from quiltcli.render.sequence import render as render_here

    def work(listener: Any) -> Any:
        if scheduler is None:
            return render_here(job, options, listener)
        return render_on(scheduler, job, options, listener)

    records = watched(work, form, planned=options.dry_run)
    if options.dry_run:
        click.echo("nothing is wrong with this job")
    elif records:
        _print_summary(records)
        click.echo(f"written to {options.folder or job.output.directory}")
    else:
        click.echo("every frame is complete already")
    return records


def _render_turns(job: Any, options: Any, *, profile: bool) -> None:
    """Render turns of a spinning mirror, with a line a frame on stderr."""
    from quiltcli.render.interrupt import Stopped
    from quiltcli.render.ring.walk import render_turns

    try:
        records = render_turns(job, options, lambda words: click.echo(words, err=True))
    except Stopped as stopped:
        click.echo(str(stopped), err=True)
        sys.exit(stopped.exit_code)
    if options.dry_run:
        click.echo("nothing is wrong with this job")
    elif not records:
        click.echo("every frame is complete already")
    else:
        click.echo(f"written to {options.folder or job.output.directory}")
    for record in records if profile else ():
        click.echo(f"frame {record.frame}: seconds by stage, then those of all workers by what they did")
        rows = [
            *record.seconds.items(),
            *((f"  {name}", each) for name, each in record.counts.seconds.items()),
        ]
        print_aligned(("stage", "seconds"), [(name, f"{each:.3f}") for name, each in rows])


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
