"""`quilt verify`: a frame against ray casts."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from quiltcli.cli.options import PATH, SETS, THREADS, refuse_typed
from quiltcli.cli.printing import print_aligned


@click.command()
@click.argument("job", type=PATH)
@click.option("-f", "--frame", "--frames", "frame", type=int, help="The frame; the job's first by default.")
@click.option("--eye", type=click.Choice(("left", "right")), help="One eye of two; both by default.")
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
    eye: str | None,
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

    loaded = load_job(job, sets)
    if loaded.ring is not None:
        refuse_typed("on a ring of viewers", ("eye", "picture"))
        _verify_turn(loaded, (frame, everything, pixels, output, redraw), as_json)
        return
    options = VerifyOptions(frame, everything, pixels or SAMPLE, output, redraw, threads or 0, eye or "")
    verdicts = []
    for found in verify_frame(loaded, options):
        verdicts.append(found.verdict)
        if as_json != Path("-"):
            _print_verdict(found.verdict)
        if picture is not None:
            who = filter(None, (picture.stem, found.verdict.viewer, found.verdict.eye))
            path = picture.with_stem("_".join(who))
            write_picture(path, found.stage.layout, found.images, found.verdict.faults)
    if as_json is not None:
        _write_json(verdicts, as_json)
    if not all(verdict.passed for verdict in verdicts):
        sys.exit(1)


def _verify_turn(job: Any, how: tuple[Any, ...], as_json: Path | None) -> None:
    """Verify a turn of a spinning mirror."""
    from quiltcli.analysis.ring.verify import COLUMNS, SAMPLE, RingVerifyOptions, verify_turn

    frame, everything, pixels, output, redraw = how
    verdict = verify_turn(job, RingVerifyOptions(frame, everything, pixels or SAMPLE, output, redraw))
    if as_json != Path("-"):
        print_aligned(COLUMNS, verdict.rows())
        words = "nothing is wrong" if verdict.passed else "FAILED"
        click.echo(f"frame {verdict.frame}, {verdict.source}, {verdict.positions} positions: {words}")
    if as_json is not None:
        _write_json([verdict], as_json)
    if not verdict.passed:
        sys.exit(1)


def _write_json(verdicts: list[Any], path: Path) -> None:
    """One verdict as it is, several in a list under `views`."""
    import json

    from quiltcli.formats.whole import write_text

    told = [verdict.as_json() for verdict in verdicts]
    passed = all(verdict.passed for verdict in verdicts)
    whole = told[0] if len(told) == 1 else {"quilt_verify": 1, "passed": passed, "views": told}
    text = json.dumps(whole, indent=2, allow_nan=False)
    if path == Path("-"):
        click.echo(text)
    else:
        write_text(path, text + "\n")


def _print_verdict(verdict: Any) -> None:
    """The verdict as a table on stdout."""
    from quiltcli.analysis.verify import COLUMNS, verdict_rows

    print_aligned(COLUMNS, verdict_rows(verdict))
    who = "".join(f", {name}" for name in (verdict.viewer, verdict.eye and f"{verdict.eye} eye") if name)
    click.echo(f"frame {verdict.frame}{who}, {verdict.images}: {verdict.words}")
