"""`quilt compare`: every render method against rays."""

from __future__ import annotations

from pathlib import Path

import click

from quiltcli.cli.options import PATH, RENDER_METHOD, SETS, THREADS
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", "--frames", "frame", type=int, help="The frame; the job's first by default.")
@click.option("-o", "--output", type=PATH, help="Folder to write to; compare in the job's by default.")
@click.option(
    "--method", "methods", type=RENDER_METHOD, multiple=True, help="Only this method; may be given again."
)
@THREADS
@SETS
def compare(
    job: Path,
    frame: int | None,
    output: Path | None,
    methods: tuple[str, ...],
    threads: int | None,
    sets: tuple[str, ...],
) -> None:
    """Draw a frame of JOB by every render method and hold each against rays.

    Writes a page with figures, charts and close views, and the same as JSON; a table goes to stdout.
    """
    from quiltcli.analysis.methods import COLUMNS, CompareOptions, study_rows, study_words, variants_of
    from quiltcli.analysis.methods import compare as compare_methods
    from quiltcli.analysis.methods.page import write_comparison
    from quiltcli.job import load_job

    loaded = load_job(job, sets)
    options = CompareOptions(
        frame,
        variants_of(methods) if methods else None,
        threads or 0,
        lambda name: click.echo(f"drawing {name}", err=True),
    )
    study = compare_methods(loaded, options)
    paths = write_comparison(study, output or loaded.output.directory / "compare")
    print_aligned(COLUMNS, study_rows(study))
    for words in study_words(study):
        click.echo(words)
    for path in paths:
        click.echo(f"written to {path}")
