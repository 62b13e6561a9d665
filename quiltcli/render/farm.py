"""Frames handed to a dask scheduler, one task each.

The machines share the file system. A task is told where the resolved job lies and which frame to
draw, and nothing is sent back but the frame's record. Tasks may run twice, because a worker died or
a result was lost: a frame that is whole is skipped, and files appear whole or not at all.
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from quiltcli import __version__
from quiltcli.errors import CheckFailedError, JobError, MissingExtraError, Problem, QuiltError, raise_all
from quiltcli.job import JobFile, job_sha256, load_job
from quiltcli.render.crew import default_threads
from quiltcli.render.interrupt import Stopped, stop_between_frames
from quiltcli.render.notices import stage_warnings
from quiltcli.render.outputs import outputs, view_is_complete, write_settings
from quiltcli.render.report import FrameRecord, write_report
from quiltcli.render.sequence import (
    Listener,
    Prepared,
    RenderOptions,
    chosen_facets,
    prepare,
    render_frames,
)
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.view import View, by_file

_RETRIES = 2
_SECONDS_TO_CONNECT = 10
_loading = threading.Lock()


@dataclass(frozen=True)
class Task:
    """What a worker must know of what it draws.

    Attributes:
        job_file: the resolved job in the output folder.
        job_sha: its hash; a worker that finds another draws nothing.
        views: what is drawn: views that share their files.
        options: the command line's, with an absolute folder.
    """

    job_file: Path
    job_sha: str
    views: tuple[View, ...]
    options: RenderOptions

    @property
    def name(self) -> str:
        """What it draws, in words."""
        return " and ".join(view.name for view in self.views)


def render_on(
    address: str, job: JobFile, options: RenderOptions, listener: Listener | None = None
) -> list[FrameRecord]:
    """Render the frames of a job on the workers of a scheduler.

    Args:
        address: of the scheduler, such as tcp://farm:8786.
        job: the job; the files it names are found under the same names by all workers.
        options: what the command line says beside it.
        listener: told of notices and of every finished frame.

    Returns:
        Records of the frames that were drawn, by frame.

    Raises:
        MissingExtraError: dask.distributed is not installed.
        QuiltError: bad input, found before a task is sent, or the scheduler cannot be reached.
        CheckFailedError: frames that failed, each named, after all others are finished.
        Stopped: a signal came; what was waiting is cancelled.
    """
    distributed = _distributed()
    listener = listener or Listener()
    folder = (options.folder or job.output.directory).absolute()
    options = replace(options, folder=folder)
    ready = prepare(job, options)
    for notice in (*ready.stage.scene.notices, *stage_warnings(ready.stage)):
        listener.say(notice)
    listener.begin(len(ready.views))
    if options.dry_run or not ready.views:
        return []
    out = ready.out
    with _connected(distributed, address) as client:
        write_settings(ready.stage, out)
        tasks = [Task(folder / "job.yaml", out.job_sha, views, options) for views in by_file(ready.views)]
        records = _collect(distributed, client, tasks, listener)
        if records:
            # Once more from here: workers on a file system without locks may have lost some.
            write_report(folder / "report.json", out.job_sha, __version__, records)
        return records


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        words = "--scheduler needs dask.distributed, which is not installed (pip install quiltcli[dist])"
        raise MissingExtraError(words) from None
    return distributed


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    """A client of the scheduler, closed at the end."""
    try:
        # Checked first: a client that fails on a malformed address is noisy when it is cleaned up.
        distributed.comm.get_address_host_port(address)
        client = distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        what = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise JobError(f"--scheduler {address}: cannot be reached: {what}") from error
    try:
        yield client
    finally:
        client.close()


def _collect(distributed: Any, client: Any, tasks: Sequence[Task], listener: Listener) -> list[FrameRecord]:
    """Send the tasks out and gather their records as they come.

    A future is let go as soon as its record is here: dask runs finished tasks again when a worker
    dies while somebody still holds them.
    """
    run = uuid.uuid4().hex[:12]  # the same job may be sent twice, with other options
    how = {"retries": _RETRIES, "pure": False}
    keys = {task.name: f"quilt-{run}-{task.name}" for task in tasks}
    waiting = {client.submit(render_task, task, key=keys[task.name], **how): task for task in tasks}
    records: list[FrameRecord] = []
    problems: list[Problem] = []
    with stop_between_frames() as request:
        try:
            for future in distributed.as_completed(list(waiting), loop=client.loop):
                name = waiting.pop(future).name
                drawn = _result(future, name, problems, listener.say)
                future.release()
                for record in drawn:
                    records.append(record)
                    listener.frame_done(record)
                request.check()
        except (Stopped, KeyboardInterrupt):
            client.cancel(list(waiting))
            raise
    raise_all(CheckFailedError, sorted(problems, key=lambda problem: problem.message))
    return sorted(records, key=lambda record: (record.frame, record.eye))


def _result(future: Any, name: str, problems: list[Problem], say: Callable[[str], None]) -> list[FrameRecord]:
    """The records of a finished task; a failure is told now and noted for the end."""
    try:
        records: list[FrameRecord] | None = future.result()
    except Exception as error:  # whatever befell the worker
        what = str(error) if isinstance(error, QuiltError) else f"{type(error).__name__}: {error}"
        problems.append(Problem(f"frame {name} failed: {' '.join(what.split())}"))
        say(problems[-1].message)
        return []
    if records is None:
        say(f"frame {name} is complete already")
    return records or []


def render_task(task: Task) -> list[FrameRecord] | None:
    """Draw and write the views of a task, on a worker; None when an earlier run of the task has done so.

    Raises:
        QuiltError: the job has changed, or a file cannot be written.
    """
    options = task.options
    with _loading:
        stage = _stage(task.job_file, task.job_sha)
    only = chosen_facets(stage, options.facets)
    out = outputs(stage, task.job_file.parent, task.job_sha, options.facets)
    if (
        not options.overwrite
        and only is None
        and all(view_is_complete(stage, out, view) for view in task.views)
    ):
        return None
    ready = Prepared(stage, out, task.views, only)
    return render_frames(ready, options.threads or default_threads(), Listener())


@lru_cache(maxsize=1)
def _stage(job_file: Path, job_sha: str) -> Stage:
    """What all frames of a job share, kept for the next frame on this worker."""
    job = load_job(job_file)
    if job_sha256(job) != job_sha:
        raise JobError(Problem("has changed, or a file it names, since its frames were sent", str(job_file)))
    return set_stage(job)
