"""Frames handed to a dask scheduler, one task each.

The machines share the file system. A task is told where the resolved job lies and which view to draw,
and nothing is sent back but the view's record. Tasks may run twice, because a worker died or a result
was lost: a view that is whole is skipped, and files appear whole or not at all.

    client      prepare ─ write layout and job ─┬─ check ─┬─ view, view, … ─┬─ report
    workers                                     └─ same? ─┴─ load once, draw ─┘
"""

from __future__ import annotations

import hashlib
import logging
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from quiltcli import __version__
from quiltcli.errors import CheckFailedError, JobError, Problem, QuiltError, missing_extra, raise_all
from quiltcli.job import JobFile
from quiltcli.render.farm_task import Inputs, Task, inputs_fault, render_task
from quiltcli.render.farm_watch import Watch
from quiltcli.render.interrupt import stop_between_frames
from quiltcli.render.outputs import write_settings
from quiltcli.render.report import FrameRecord, write_report
from quiltcli.render.resume import clear_away
from quiltcli.render.sequence import Listener, Prepared, RenderOptions, failing_run, prepare, say_notices
from quiltcli.viewer.view import by_file

_RETRIES = 2
_SECONDS_TO_CONNECT = 10
_SECONDS_TO_PART = 5
_SECONDS_BETWEEN_REPORTS = 5.0


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
        QuiltError: bad input, found before a view is drawn: of the job, of an address where no scheduler
            can be reached, or of a worker that has other files.
        CheckFailedError: frames that failed, each named, after all others are finished; or the
            scheduler is gone.
        Stopped: a signal came; what was waiting is cancelled, what workers have begun they finish.
    """
    distributed = _distributed()
    listener = listener or Listener()
    folder = (options.folder or job.output.directory).absolute()
    options = replace(options, folder=folder)
    ready = prepare(job, options)
    say_notices(ready, options, listener)
    listener.begin(len(ready.views))
    if options.dry_run:
        return []
    clear_away(ready.stage, ready.out)
    if not ready.views:
        return []
    with _connected(distributed, address) as client, stop_between_frames("") as request:
        with failing_run(of_the_disk=True):
            write_settings(ready.stage, ready.out)
        watch = Watch(client, address, request, listener.say)
        _check_workers(client, watch, address, ready)
        groups = by_file(ready.views)
        tasks = [Task(folder / "job.yaml", ready.out.job_sha, views, options) for views in groups]
        records = _collect(client, watch, tasks, listener)
    clear_away(ready.stage, ready.out)  # what workers that died have left
    return records


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise missing_extra("--scheduler", "dask.distributed", "dist") from None
    return distributed


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    """A client of the scheduler, closed at the end."""
    with _quiet():
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
            _briefly(client.close)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence dask's own log: what it tells of dead workers and schedulers is told here, once."""
    log = logging.getLogger("distributed")
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    before = {logger: logger.disabled for logger in (log, *map(logging.getLogger, names))}
    for logger in before:
        logger.disabled = True
    try:
        yield
    finally:
        for logger, disabled in before.items():
            logger.disabled = disabled


def _briefly(part: Callable[[], object]) -> None:
    """Do what a scheduler may never answer to, and wait a few seconds at most."""
    worker = threading.Thread(target=part, daemon=True)
    worker.start()
    worker.join(_SECONDS_TO_PART)


def _check_workers(client: Any, watch: Watch, address: str, ready: Prepared) -> None:
    """See that a worker on every host finds the files that were read here.

    Raises:
        JobError: one does not.
        CheckFailedError, Stopped: as for `Watch`.
    """
    own = [ready.out.folder / name for name in ("job.yaml", "layout.yaml")]
    files = {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in own}
    inputs = Inputs(__version__, tuple((dict(ready.inputs) | files).items()))
    hosts = {worker.rpartition(":")[0]: worker for worker in watch.await_workers(len(ready.views))}
    run = uuid.uuid4().hex[:12]
    how = {"retries": _RETRIES, "pure": False, "allow_other_workers": True}
    futures = [
        client.submit(inputs_fault, inputs, key=f"quilt-{run}-check-{host}", workers=[worker], **how)
        for host, worker in hosts.items()
    ]
    for future in watch.finished(futures, len(ready.views)):
        try:
            fault = future.result()
        except Exception as error:  # no quilt there, or another
            fault = f"a worker cannot begin: {_words(error)}"
        future.release()
        if fault:
            words = f"{fault} (all machines need the same quilt, and the same files at the same paths)"
            raise JobError(f"--scheduler {address}: {words}")


def _collect(client: Any, watch: Watch, tasks: Sequence[Task], listener: Listener) -> list[FrameRecord]:
    """Send the tasks out and gather their records as they come.

    A future is let go as soon as its record is here: dask runs finished tasks again when a worker
    dies while somebody still holds them.
    """
    run = uuid.uuid4().hex[:12]  # the same job may be sent twice, with other options
    how = {"retries": _RETRIES, "pure": False}
    keys = {task.name: f"quilt-{run}-{task.name}" for task in tasks}
    waiting = {client.submit(render_task, task, key=keys[task.name], **how): task for task in tasks}
    records = _Records(tasks[0])
    problems: list[Problem] = []
    try:
        for future in watch.finished(list(waiting)):
            name = waiting.pop(future).name
            drawn = _result(future, name, problems, listener.say)
            future.release()
            for record in drawn:
                records.add(record)
                listener.frame_done(record)
    finally:
        if waiting:
            _briefly(lambda: client.cancel(list(waiting)))
        with failing_run():
            records.write()
    raise_all(CheckFailedError, sorted(problems, key=lambda problem: problem.message))
    return sorted(records.all, key=lambda record: (record.frame, record.eye))


class _Records:
    """Records that have come, and those of them that the report lacks.

    Workers write theirs into the report themselves, but on a file system without locks some get lost.
    """

    def __init__(self, task: Task) -> None:
        self.all: list[FrameRecord] = []
        self._unwritten: list[FrameRecord] = []
        self._written = time.monotonic()
        self._path, self._job_sha = task.job_file.with_name("report.json"), task.job_sha

    def add(self, record: FrameRecord) -> None:
        """Take a record; write those that have come now and then."""
        self.all.append(record)
        self._unwritten.append(record)
        if time.monotonic() - self._written > _SECONDS_BETWEEN_REPORTS:
            with failing_run():
                self.write()

    def write(self) -> None:
        """Write what is not written yet (OutputError)."""
        if self._unwritten:
            write_report(self._path, self._job_sha, __version__, self._unwritten)
        self._unwritten, self._written = [], time.monotonic()


def _result(future: Any, name: str, problems: list[Problem], say: Callable[[str], None]) -> list[FrameRecord]:
    """The records of a finished task; a failure is told now and noted for the end.

    Raises:
        QuiltError: of the input, as a worker finds it: no other frame would fare better.
    """
    try:
        records: list[FrameRecord] | None = future.result()
    except Exception as error:  # whatever befell the worker
        if isinstance(error, QuiltError) and error.exit_code != CheckFailedError.exit_code:
            raise
        problems.append(Problem(f"frame {name} failed: {_words(error)}"))
        say(problems[-1].message)
        return []
    if records is None:
        say(f"frame {name} is complete already")
    return records or []


def _words(error: Exception) -> str:
    """An error in one line."""
    return " ".join(
        (str(error) if isinstance(error, QuiltError) else f"{type(error).__name__}: {error}").split()
    )
