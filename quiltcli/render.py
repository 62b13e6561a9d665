"""The walk from a job to its images.

job → display, layout, scene            once (`draw.set_stage`)
frame → viewer                          a function of the frame number
    bin, prewarp, rasterize, shade      `draw.draw_frame`
    unmap, write                        `outputs.write_frame`
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quiltcli import __version__
from quiltcli.display import pitch_mm
from quiltcli.draw import Stage, default_threads, draw_frame, new_buffers, set_stage
from quiltcli.errors import JobError, Problem, ViewerError, raise_all
from quiltcli.geometry import BoolArray, dot
from quiltcli.interrupt import stop_between_frames
from quiltcli.job import JobFile, job_sha256
from quiltcli.outputs import (
    Outputs,
    frame_is_complete,
    outputs,
    read_quilt,
    refuse_to_overwrite,
    write_frame,
    write_settings,
)
from quiltcli.report import FrameRecord, write_report
from quiltcli.viewer import Viewer, check_viewer, viewer_at


@dataclass(frozen=True)
class RenderOptions:
    """What the command line says beside the job.

    Attributes:
        frames: frames to render instead of the job's.
        folder: output folder instead of the job's.
        resume: skip frames that are complete and made by the same job.
        overwrite: replace images that exist.
        facets: ids of the only facets to draw, merged into the quilts that exist.
        threads: batches and files worked on at a time; 0 takes every core.
        dry_run: find every problem, write nothing.
    """

    frames: Sequence[int] | None = None
    folder: Path | None = None
    resume: bool = False
    overwrite: bool = False
    facets: Sequence[int] | None = None
    threads: int = 0
    dry_run: bool = False


@dataclass(frozen=True)
class Listener:
    """Whom a render tells of its progress.

    Attributes:
        begin: the number of frames that will be rendered.
        frame_done: the record of a frame whose files are all written.
        say: a sentence for the user.
    """

    begin: Callable[[int], None] = lambda count: None
    frame_done: Callable[[FrameRecord], None] = lambda record: None
    say: Callable[[str], None] = lambda sentence: None


def render(
    job: JobFile, options: RenderOptions | None = None, listener: Listener | None = None
) -> list[FrameRecord]:
    """Render the frames of a job: quilts, facet images, report.

    Args:
        job: the job.
        options: what the command line says beside it.
        listener: told of notices and of every finished frame.

    Returns:
        The records of the frames that were rendered.

    Raises:
        QuiltError: bad input, found before anything is written, or a file that cannot be written.
        Stopped: a signal came; the frames rendered so far are whole and reported.
    """
    options, listener = options or RenderOptions(), listener or Listener()
    frames = list(job.frames if options.frames is None else options.frames)
    viewers = viewer_path(job, frames)
    stage = set_stage(job)
    check_eyes(stage, viewers)
    only = chosen_facets(stage, options.facets)
    out = outputs(stage, options.folder or job.output.directory, job_sha256(job), options.facets)
    viewers = [
        viewer for viewer in viewers if not (options.resume and frame_is_complete(stage, out, viewer.frame))
    ]
    if not (options.resume or options.overwrite or only is not None):
        refuse_to_overwrite(stage, out, frames)
    for notice in (*stage.scene.notices, *stage_warnings(stage)):
        listener.say(notice)
    listener.begin(len(viewers))
    if options.dry_run or not viewers:
        return []
    write_settings(stage, out)
    return render_frames(stage, out, viewers, only, options.threads or default_threads(), listener)


def render_frames(
    stage: Stage,
    out: Outputs,
    viewers: Sequence[Viewer],
    only: BoolArray | None,
    threads: int,
    listener: Listener,
) -> list[FrameRecord]:
    """Draw and write one frame after the other; a signal stops between two of them."""
    buffers = new_buffers(stage)
    records: list[FrameRecord] = []
    report = out.folder / "report.json"
    with stop_between_frames() as request:
        for viewer in viewers:
            request.check()
            if only is not None:
                read_quilt(stage, out, viewer.frame, buffers)
            record = draw_frame(stage, viewer, buffers, threads, only)
            record = record.timed("write", partial(write_frame, stage, out, viewer, buffers, threads))
            records.append(record)
            write_report(report, out.job_sha, __version__, [record])
            listener.frame_done(record)
        request.check()
    return records


def viewer_path(job: JobFile, frames: Sequence[int]) -> list[Viewer]:
    """The viewer of every frame.

    Raises:
        ViewerError: with every problem of the path.
    """
    raise_all(ViewerError, check_viewer(job.viewer, frames))
    return [viewer_at(job.viewer, frame, job.render.depth) for frame in frames]


def check_eyes(stage: Stage, viewers: Sequence[Viewer]) -> None:
    """Raise ViewerError where the eye lies in the plane of a facet, whose image would be a line."""
    facets = stage.facets
    problems = []
    for viewer in viewers:
        height = dot(viewer.eye - facets.origin, facets.normal)
        flat = np.flatnonzero(facets.enabled & (np.abs(height) <= 1e-9))
        if flat.size:
            problems.append(_edge_on(stage, viewer, flat.tolist()))
    raise_all(ViewerError, problems[:20])


def _edge_on(stage: Stage, viewer: Viewer, flat: list[int]) -> Problem:
    """The problem of an eye that sees some facets edge-on."""
    name = stage.facets.names[flat[0]]
    which = f"facet {flat[0] + 1}" + (f" ({name})" if name else "")
    which += f" and of {len(flat) - 1} more" if len(flat) > 1 else ""
    message = (
        f"at frame {viewer.frame} the eye lies in the plane of {which}, which would be a line to it"
        " (move the path by a millimetre)"
    )
    return stage.job.viewer.source.problem(("path",), message)


def chosen_facets(stage: Stage, ids: Sequence[int] | None) -> BoolArray | None:
    """The facets (F,) with these ids, None for all.

    Raises:
        JobError: the display has no such facet, or it has no place in the layout.
    """
    if ids is None:
        return None
    chosen = np.zeros(stage.facets.count, dtype=np.bool_)
    for facet in ids:
        if not 1 <= facet <= stage.facets.count:
            raise JobError(f"--facets: there is no facet {facet} (the display has 1 to {stage.facets.count})")
        if stage.layout.page[facet - 1] < 0:
            raise JobError(f"--facets: facet {facet} is not enabled and has no place in the layout")
        chosen[facet - 1] = True
    return chosen


def stage_warnings(stage: Stage) -> Iterator[str]:
    """What is worth a second look before rendering starts."""
    least, greatest = pitch_mm(stage.facets)
    if least < 0.1 or greatest > 100:
        yield (
            f"the pixel pitch is {least:.3g} to {greatest:.3g} mm, outside 0.1 to 100 mm:"
            " are the display's units and resolution right?"
        )
    if stage.job.render.bleed > stage.layout.padding:
        yield (
            f"the bleed of {stage.job.render.bleed} pixels is wider than the layout's padding of"
            f" {stage.layout.padding}: neighbours share what lies between them"
        )
