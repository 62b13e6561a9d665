"""Quilts whose pixels were made elsewhere, written as a render writes its own.

The files have the names, attributes and job hash of a render of the job that shows colours alone, and
`quilt:made` says by what they were made; so whatever works on a render's output folder works on theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import MOST_HALF
from quiltcli.geometry import Float32Array
from quiltcli.job import JobFile, job_sha256
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.interrupt import stop_between_frames
from quiltcli.render.methods import corrected
from quiltcli.render.outputs import Drawn, outputs, refuse_to_overwrite, view_lit, write_settings
from quiltcli.render.report import Clock, FrameRecord
from quiltcli.render.resume import clear_away
from quiltcli.render.sequence import Listener, Prepared, Writer, failing_run
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.view import View, by_file

HalfArray: TypeAlias = NDArray[np.float16]


@dataclass(frozen=True)
class MadeOptions:
    """What the command line says beside the job.

    Attributes:
        folder: where the images go.
        frames: frames instead of the job's.
        overwrite: replace images that exist.
        threads: files worked on at a time; 0 takes every core.
    """

    folder: Path
    frames: Sequence[int] | None = None
    overwrite: bool = False
    threads: int = 0


@dataclass(frozen=True)
class Made:
    """What was put into the buffers of a view.

    Attributes:
        pixels: facet pixels that show something.
        warnings: sentences for the user.
    """

    pixels: int
    warnings: tuple[str, ...] = ()


def prepare_made(
    job: JobFile,
    options: MadeOptions,
    word: str,
    also: Callable[[Stage, Sequence[View]], tuple[str, ...]] = lambda stage, views: (),
) -> Prepared:
    """Load what a job names, and find every reason not to write its images.

    Args:
        job: the job; of its channels colours are written.
        options: what the command line says beside it.
        word: what makes the pixels, for the attribute `quilt:made`.
        also: the job's channels that are written beside colours.

    Raises:
        QuiltError: bad input, or files that are in the way.
    """
    update = {"channels": ("rgba",), "directory": options.folder}
    job = job.model_copy(update={"output": job.output.model_copy(update=update)})
    frames = list(job.frames if options.frames is None else options.frames)
    stage = set_stage(job, options.folder)
    views = stage.views(frames)
    if channels := also(stage, views):
        output = job.output.model_copy(update={"channels": ("rgba", *channels)})
        job = job.model_copy(update={"output": output})
        stage = replace(stage, job=job)
    out = outputs(stage, options.folder, job_sha256(job))
    out = replace(out, besides=out.besides | {"quilt:made": word})
    if not options.overwrite:
        refuse_to_overwrite(stage, out, views)
    return Prepared(stage, out, tuple(views), None)


def write_made(
    ready: Prepared,
    fill: Callable[[View, Buffers], Made],
    threads: int,
    listener: Listener | None = None,
) -> list[FrameRecord]:
    """Fill and write the views; while one is written, the next is filled.

    Args:
        ready: what to write.
        fill: puts light into the buffers of a view, which are empty; what it says of that.
        threads: files worked on at a time; 0 takes every core.
        listener: told of every finished frame.

    Raises:
        CheckFailedError: a file cannot be written; the frames before it are whole and reported.
        Stopped: a signal came; likewise.
    """
    threads, listener, stage = threads or default_threads(), listener or Listener(), ready.stage
    clear_away(stage, ready.out)
    with failing_run(of_the_disk=True):
        write_settings(stage, ready.out)
    with ExitStack() as ends:
        ends.enter_context(failing_run())
        listener.begin(len(ready.views))
        request = ends.enter_context(stop_between_frames())
        writer = ends.enter_context(Writer(ready, threads, listener))
        for group in by_file(ready.views):
            request.check()
            writer.leave(1 if len(group) == 1 else 0)
            drawn = [Drawn(view, new_buffers(stage)) for view in group]
            records = []
            for one in drawn:
                clock = Clock()
                with clock.stage("fill"):
                    made = fill(one.view, one.buffers)
                record = _record(stage, one.view, made, clock.seconds)
                records.append(corrected(stage, one.view, one.buffers, record, threads, None))
            writer.take(records, drawn)
        writer.leave(0)
        request.check()
    return writer.records


def _record(stage: Stage, view: View, made: Made, seconds: dict[str, float]) -> FrameRecord:
    """The record of a view in which no triangle was drawn."""
    lit = int(np.count_nonzero(view_lit(stage, view) & (stage.layout.page >= 0)))
    return FrameRecord(
        view.frame,
        triangles=0,
        reaching=0,
        pairs=0,
        settled=0,
        lit_facets=lit,
        visible_pixels=made.pixels,
        fill=stage.fill,
        seconds=seconds,
        warnings=made.warnings,
        eye=view.eye,
    )


def half(light: Float32Array) -> HalfArray:
    """Light as half floats, the brightest that they hold at most; what is no number is black."""
    result: HalfArray = np.clip(np.nan_to_num(light, nan=0.0), -MOST_HALF, MOST_HALF).astype(np.float16)
    return result
