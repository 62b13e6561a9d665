"""What a worker of a farm does: see that it has the same files, and draw a view.

A worker's process may be a daemon, which may have no children, and has threads that are not ours: so a
view is drawn in threads there. Its pixels are the same.
"""

from __future__ import annotations

import hashlib
import socket
import threading
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from quiltcli import __version__
from quiltcli.errors import JobError, Problem
from quiltcli.formats.noted import noting_inputs
from quiltcli.job import job_sha256, load_job
from quiltcli.render.crew import default_threads
from quiltcli.render.outputs import outputs
from quiltcli.render.report import FrameRecord
from quiltcli.render.resume import unfinished
from quiltcli.render.sequence import Listener, Prepared, RenderOptions, chosen_facets, render_frames
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.view import View

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


@dataclass(frozen=True)
class Inputs:
    """What a worker must find.

    Attributes:
        version: of this program.
        files: absolute paths with the SHA-256, hexadecimal, of what is in them.
    """

    version: str
    files: tuple[tuple[str, str], ...]


def inputs_fault(inputs: Inputs) -> str:
    """What this machine finds otherwise, and its name; empty when all is the same."""
    host = socket.gethostname()
    if inputs.version != __version__:
        return f"{host} has quilt {__version__}, expected {inputs.version}"
    for path, digest in inputs.files:
        try:
            with Path(path).open("rb") as file:
                same = hashlib.file_digest(file, "sha256").hexdigest() == digest
        except FileNotFoundError:
            return f"{host} has no file {path}"
        except OSError as error:
            return f"{host} cannot read {path}: {error.strerror}"
        if not same:
            return f"{host} has another file {path}"
    return ""


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
    if not options.overwrite and only is None and not unfinished(stage, out, task.views):
        return None
    ready = Prepared(stage, out, task.views, only)
    return render_frames(ready, options.threads or _threads(), Listener())


@lru_cache(maxsize=1)
def _stage(job_file: Path, job_sha: str) -> Stage:
    """What all frames of a job share, kept for the next frame on this worker."""
    with noting_inputs():
        job = load_job(job_file)
        stage = set_stage(job)
        if job_sha256(job) != job_sha:
            words = "has changed, or a file it names, since its frames were sent"
            raise JobError(Problem(words, str(job_file)))
    return stage


def _threads() -> int:
    """This task's share of the cores: a worker may draw as many views at a time as it has threads."""
    try:
        from distributed import get_worker

        return max(default_threads() // int(get_worker().state.nthreads), 1)
    except (ImportError, ValueError):  # this is no worker
        return default_threads()
