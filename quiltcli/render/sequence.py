"""The walk from a job to its images.

job → display, layout, scene            once (`setup.set_stage`)
frame → views                           a function of the frame number (`viewer.view`)
    bin, warp, rasterize, shade         `frame.draw_frame`, or another of `methods`
    unmap, write                        `outputs.write_views`
"""

from __future__ import annotations

import errno
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from quiltcli import __version__
from quiltcli.errors import CheckFailedError, JobError, OutputError, Problem, QuiltError, raise_all
from quiltcli.formats.exr.image import use_threads
from quiltcli.formats.noted import noting_inputs
from quiltcli.geometry import BoolArray
from quiltcli.job import JobFile, job_sha256
from quiltcli.render.buffers import new_buffers
from quiltcli.render.crew import default_threads
from quiltcli.render.interrupt import stop_between_frames
from quiltcli.render.memory import estimate_text, less_words, shared_out
from quiltcli.render.methods import draw_moment
from quiltcli.render.moments import moment
from quiltcli.render.notices import stage_warnings
from quiltcli.render.outputs import (
    Drawn,
    Outputs,
    merge_problems,
    outputs,
    read_quilt,
    refuse_to_overwrite,
    write_settings,
    write_views,
)
from quiltcli.render.report import FrameRecord, write_report
from quiltcli.render.resume import clear_away, unfinished
from quiltcli.render.setup import Stage, set_stage
from quiltcli.render.unseen import unseen_in
from quiltcli.render.workers import Pool, can_fork, shared_buffers, worth_forking
from quiltcli.shading.mattes import matte_attributes
from quiltcli.viewer.view import View, by_file, views_of

_OF_THE_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EIO}


@dataclass(frozen=True)
class RenderOptions:
    """What the command line says beside the job.

    Attributes:
        frames: frames to render instead of the job's.
        folder: output folder instead of the job's.
        resume: skip frames that are complete and made by the same job.
        overwrite: replace images that exist.
        facets: ids of the only facets to draw, merged into the quilts that exist, if there are quilts.
        eye: the only eye to draw, `left` or `right`; None for all.
        threads: batches and files worked on at a time; 0 takes every core.
        dry_run: find every problem, write nothing.
        strict: take what is only worth a second look for a problem.
    """

    frames: Sequence[int] | None = None
    folder: Path | None = None
    resume: bool = False
    overwrite: bool = False
    facets: Sequence[int] | None = None
    eye: str | None = None
    threads: int = 0
    dry_run: bool = False
    strict: bool = False


@dataclass(frozen=True)
class Listener:
    """Whom a render tells of its progress.

    Attributes:
        begin: the number of frames that will be rendered.
        frame_done: the record of a frame whose files are all written.
        say: a sentence for the user.
        plan: what the run will take of the machine.
    """

    begin: Callable[[int], None] = lambda count: None
    frame_done: Callable[[FrameRecord], None] = lambda record: None
    say: Callable[[str], None] = lambda sentence: None
    plan: Callable[[str], None] = lambda sentence: None


@dataclass(frozen=True)
class Prepared:
    """A job with every problem found and nothing written yet.

    Attributes:
        stage: what the frames share.
        out: where the files go.
        views: what is left to draw.
        only: (F,) the only facets to draw, None for all.
        inputs: hashes of the files that were read, by absolute path.
    """

    stage: Stage
    out: Outputs
    views: tuple[View, ...]
    only: BoolArray | None
    inputs: Mapping[str, str] = field(default_factory=dict)


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
        QuiltError: bad input, found before anything is written.
        CheckFailedError: a file cannot be written; the frames before it are whole and reported.
        Stopped: a signal came; the frames rendered so far are whole and reported.
    """
    options, listener = options or RenderOptions(), listener or Listener()
    start = time.perf_counter()
    ready = prepare(job, options)
    say_notices(ready, options, listener)
    threads = options.threads or default_threads()
    if ready.views:
        triangles = len(ready.stage.scene.triangles)
        listener.plan(
            estimate_text(ready.stage.job, ready.stage.layout, len(ready.views), triangles, threads)
        )
    if options.dry_run:
        for notice in unseen_in(ready.stage, ready.views):
            listener.say(notice)
        return []
    clear_away(ready.stage, ready.out)
    if not ready.views:
        return []
    with failing_run(of_the_disk=True):
        write_settings(ready.stage, ready.out)
    return render_frames(ready, threads, listener, start)


def say_notices(ready: Prepared, options: RenderOptions, listener: Listener) -> None:
    """Tell what is worth a second look; raise it as a JobError where that is wanted."""
    notices = (*ready.stage.scene.notices, *stage_warnings(ready.stage, options.frames))
    if options.strict and notices:
        raise JobError([*map(Problem, notices), Problem("--strict does not allow what is said above")])
    for notice in notices:
        listener.say(notice)


def prepare(job: JobFile, options: RenderOptions) -> Prepared:
    """Load what a job names, and find every reason not to render it.

    Raises:
        QuiltError: bad input, or files that are in the way.
    """
    frames = list(job.frames if options.frames is None else options.frames)
    with noting_inputs() as inputs:
        views_of(job, frames)  # what is wrong with the path is said before anything is loaded
        stage = set_stage(job, options.folder)
        job_sha = job_sha256(job)
        views = chosen_views(stage, frames, options.eye)
    only = chosen_facets(stage, options.facets)
    out = outputs(stage, options.folder or job.output.directory, job_sha, options.facets)
    if only is not None and job.output.quilts:
        raise_all(OutputError, merge_problems(stage, out, views))
    elif options.resume:
        views = unfinished(stage, out, views, options.threads or default_threads())
    elif not options.overwrite:
        refuse_to_overwrite(stage, out, views)
    return Prepared(stage, out, tuple(views), only, inputs)


def render_frames(
    ready: Prepared, threads: int, listener: Listener, start: float | None = None
) -> list[FrameRecord]:
    """Draw and write the views; while one is written, the next is drawn into other buffers.

    Args:
        ready: what to draw.
        threads: batches and files worked on at a time.
        listener: told of every finished frame.
        start: when the run began, by `time.perf_counter`; None for now.
    """
    stage, views = ready.stage, ready.views
    share = shared_out(stage.job, stage.layout, views, threads)
    if words := less_words(share, threads, min(len(views), 2)):
        listener.say(words)
    threads = share.workers
    pooled = threads > 1 and can_fork() and worth_forking(stage)
    groups = by_file(views)
    most = max(map(len, groups), default=1)
    sheets = [(shared_buffers if pooled else new_buffers)(stage) for _ in range(share.sheets)]
    # Forked before this process has threads of its own: a lock that one holds would stay locked.
    with ExitStack() as ends:
        ends.enter_context(failing_run())
        pool = ends.enter_context(Pool(stage, sheets, threads)) if pooled else None
        listener.begin(len(views))
        request = ends.enter_context(stop_between_frames())
        writer = ends.enter_context(Writer(ready, threads, listener, start))
        dirty = [np.zeros(stage.blocks.used.size, dtype=np.bool_) for _ in sheets]
        for number, group in enumerate(groups):
            request.check()
            # One file is written while the next is drawn, unless it takes all the sheets there are.
            writer.leave(len(sheets) // most - 1)
            turns = [(number * most + place) % len(sheets) for place in range(len(group))]
            records, drawn = [], []
            for turn, view in zip(turns, group, strict=True):
                if ready.only is not None and stage.job.output.quilts:
                    read_quilt(stage, ready.out, view, sheets[turn])
                now, sheet = moment(stage, view), sheets[turn]
                records.append(draw_moment(now, sheet, threads, ready.only, dirty=dirty[turn], crew=pool))
                drawn.append(Drawn(view, sheet, matte_attributes(now.stage.scene, stage.job.output.channels)))
            writer.take(records, drawn)
        writer.leave(0)
        request.check()
    return writer.records


@contextmanager
def failing_run(*, of_the_disk: bool = False) -> Iterator[None]:
    """Turn files that cannot be written into a failure of the run, for the input was good.

    Args:
        of_the_disk: only those that the disk is to blame for, not the user.

    Raises:
        CheckFailedError: with the problems of an OutputError.
    """
    try:
        yield
    except OutputError as error:
        if of_the_disk and getattr(error.__cause__, "errno", None) not in _OF_THE_DISK:
            raise
        raise CheckFailedError(error.problems) from error


class Writer:
    """Writes frames behind the drawing, in order; a context manager that leaves no frame unwritten.

    Attributes:
        records: of the frames whose files are all there.
    """

    def __init__(self, ready: Prepared, threads: int, listener: Listener, start: float | None = None) -> None:
        now = time.perf_counter()
        self._done = now if start is None else start  # when the frame before was
        self._load = now - self._done
        use_threads(threads)
        self.records: list[FrameRecord] = []
        self._ready = ready
        self._threads = threads
        self._listener = listener
        self._executor = ThreadPoolExecutor(1)
        self._waiting: deque[Future[list[FrameRecord]]] = deque()

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            while self._waiting:
                # After a first error the frames behind it are still finished; it is the one that is told.
                with suppress(*(QuiltError,) if kind else ()):
                    self.leave(len(self._waiting) - 1)
        finally:
            self._executor.shutdown()

    def take(self, records: Sequence[FrameRecord], drawn: Sequence[Drawn]) -> None:
        """Write views that share their files; their buffers must not change until `leave` has let them go."""
        work = partial(write_views, self._ready.stage, self._ready.out, drawn, self._threads)
        first, *others = records
        first = first.after("load", self._load)
        self._load = 0.0
        self._waiting.append(self._executor.submit(lambda: [first.written(work), *others]))

    def leave(self, count: int) -> None:
        """Wait until at most `count` frames are unwritten; report those that are."""
        while len(self._waiting) > count:
            start = time.perf_counter()
            first, *others = self._waiting.popleft().result()
            now = time.perf_counter()
            records = [first.done(waited=now - start, wall=now - self._done), *others]
            self._done = now
            self.records += records
            out = self._ready.out
            write_report(out.folder / "report.json", out.job_sha, __version__, records)
            for record in records:
                self._listener.frame_done(record)


def chosen_views(stage: Stage, frames: Sequence[int], eye: str | None) -> list[View]:
    """The views of frames, or those of an eye.

    Raises:
        JobError: the job has one eye, or files that both eyes share.
    """
    views = stage.views(frames)
    if eye is None:
        return views
    if not stage.job.is_stereo:
        raise JobError(f"--eye {eye}: the job has one eye (viewer.stereo gives it two)")
    if stage.job.output.stereo == "parts":
        words = f"--eye {eye}: both eyes are parts of one file, which is drawn whole"
        raise JobError(f"{words} (output.stereo: files makes two)")
    return [view for view in views if view.eye == eye]


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
