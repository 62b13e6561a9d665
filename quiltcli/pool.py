"""Worker processes that draw the batches of a frame into shared memory.

Threads gain little here: much of numpy holds the interpreter's lock. So the workers are forked once,
with everything the frames share already in memory, and nothing of it is ever copied or sent. What
changes from frame to frame is written into a shared arena, and pixels go straight into shared
buffers: every pixel belongs to one batch, so nobody waits for anybody. Where processes cannot fork,
`draw.draw_frame` draws in threads instead.
"""

from __future__ import annotations

import contextlib
import mmap
import multiprocessing
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import exr_channels
from quiltcli.draw import Buffers, Stage, draw_batch, in_threads
from quiltcli.errors import CheckFailedError, Problem
from quiltcli.geometry import BoolArray
from quiltcli.homography import quilt_rays
from quiltcli.raster import BlockPairs, Frame, Sight
from quiltcli.viewer import Viewer

_ROOM = 64  # pairs a triangle there is room for; memory that is not touched costs nothing
_LEAST_ROOM = 1 << 26
_MANY_PIXELS = 1 << 20
_MANY_TRIANGLES = 50_000


def can_fork() -> bool:
    """Whether this system has processes that share their parent's memory."""
    return sys.platform.startswith("linux") and "fork" in multiprocessing.get_all_start_methods()


def worth_forking(stage: Stage) -> bool:
    """Whether a frame is likely to take longer than processes take to start and end."""
    return stage.owners.size >= _MANY_PIXELS or len(stage.scene.triangles) >= _MANY_TRIANGLES


def shared_array(length: int, dtype: Any) -> NDArray[Any]:
    """Zeros that forked processes write to together; freed with the last of them."""
    dtype = np.dtype(dtype)
    return np.frombuffer(mmap.mmap(-1, max(length * dtype.itemsize, 1)), dtype=dtype, count=length)


def shared_buffers(stage: Stage) -> Buffers:
    """As `draw.new_buffers`, in memory that workers share."""
    buffers = {}
    for name, (dtype, empty) in exr_channels(stage.job.output.channels).items():
        buffers[name] = shared_array(stage.owners.size, dtype)
        if empty:
            buffers[name].fill(empty)
    return buffers


@dataclass(frozen=True)
class _Arena:
    """Where the arrays of the frame under way lie.

    Attributes:
        vertices: (V, 3) world minus eye.
        cut: (T,) triangles cut by near or far.
        start: (B+1,) offsets of the blocks' pairs.
        triangle: (capacity,) their triangles.
    """

    vertices: NDArray[np.float64]
    cut: BoolArray
    start: NDArray[np.int64]
    triangle: NDArray[np.int32]


@dataclass(frozen=True)
class _Task:
    """What a worker is told of a frame.

    Attributes:
        viewer: the viewer.
        lit: (F,) facets that are drawn.
        pairs: number of block pairs.
        buffers: which of the buffers to draw into.
    """

    viewer: Viewer
    lit: BoolArray
    pairs: int
    buffers: int


@dataclass(frozen=True)
class _Worker:
    """A forked process and our end of the line to it."""

    process: Any
    connection: Any

    def tell(self, frame: int, message: object) -> None:
        """Send a message about a frame (CheckFailedError if the worker is gone)."""
        try:
            self.connection.send(message)
        except OSError:
            raise self._died(frame) from None

    def hear(self, frame: int) -> int | None:
        """The answer to a batch: its visible pixels, or None when there is no batch left to answer."""
        try:
            answer = self.connection.recv()
        except (EOFError, OSError):
            raise self._died(frame) from None
        if isinstance(answer, _Fault):
            words = f"frame {frame}: a worker failed:\n{answer.traceback}"
            raise RuntimeError(words)  # noqa: TRY004 — the type is right; it is the news that is bad
        return None if answer is None else int(answer)

    def _died(self, frame: int) -> CheckFailedError:
        """The error of a worker that is gone."""
        self.process.join(1)
        code = self.process.exitcode
        how = f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with code {code}"
        advice = (
            " (out of memory? fewer threads or smaller pages need less)" if code == -signal.SIGKILL else ""
        )
        return CheckFailedError(Problem(f"frame {frame}: a worker process {how}{advice}"))


@dataclass(frozen=True)
class _Fault:
    """What a worker answers when something in it failed."""

    traceback: str


class Pool:
    """Forked workers of one stage; a context manager that ends them."""

    def __init__(self, stage: Stage, buffers: Sequence[Buffers], workers: int) -> None:
        scene = stage.scene
        triangles = len(scene.triangles)
        self._stage = stage
        self._buffers = buffers
        self._arena = _Arena(
            shared_array(scene.vertices.size, np.float64).reshape(-1, 3),
            shared_array(triangles, np.bool_),
            shared_array(len(stage.blocks.facet) + 1, np.int64),
            shared_array(max(_ROOM * triangles, _LEAST_ROOM), np.int32),
        )
        _ = scene.corner_normals, scene.corner_colors  # made once, before there are copies of the process
        context = multiprocessing.get_context("fork")
        self._workers: list[_Worker] = []
        for _number in range(workers):
            ours, theirs = context.Pipe()
            arguments = (theirs, stage, buffers, self._arena, os.getpid())
            process = context.Process(target=_serve, args=arguments, daemon=True)
            process.start()
            theirs.close()
            self._workers.append(_Worker(process, ours))

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers, whatever they are doing."""
        for worker in self._workers:
            with contextlib.suppress(OSError):
                worker.connection.close()
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join()
        self._workers = []

    def draw(self, frame: Frame, batches: Sequence[tuple[int, int]], buffers: Buffers) -> int:
        """Draw batches into one of the pool's buffers.

        Returns:
            How many pixels of facets show the scene.

        Raises:
            CheckFailedError: a worker died.
        """
        pairs = frame.pairs
        if pairs.triangle.size > self._arena.triangle.size:
            return in_threads(self._stage, len(self._workers))(frame, batches, buffers)
        self._arena.vertices[:] = frame.sight.vertices
        self._arena.cut[:] = frame.sight.cut
        self._arena.start[:] = pairs.start
        self._arena.triangle[: pairs.triangle.size] = pairs.triangle
        index = next(i for i, known in enumerate(self._buffers) if known is buffers)
        task = _Task(frame.viewer, frame.rays.lit, pairs.triangle.size, index)
        cost = [int(pairs.start[last] - pairs.start[first]) for first, last in batches]
        waiting = [batches[i] for i in np.argsort(cost, kind="stable").tolist()]  # dearest last: popped first
        number, visible = frame.viewer.frame, 0
        busy: dict[Any, _Worker] = {worker.connection: worker for worker in self._workers}
        for worker in self._workers:
            worker.tell(number, task)
            worker.tell(number, waiting.pop() if waiting else None)
        while busy:
            for connection in wait(list(busy)):
                answer = busy[connection].hear(number)
                if answer is None:
                    del busy[connection]
                else:
                    visible += answer
                    busy[connection].tell(number, waiting.pop() if waiting else None)
        return visible


def _serve(
    connection: Connection, stage: Stage, buffers: Sequence[Buffers], arena: _Arena, parent: int
) -> None:
    """A worker's life: take frames, draw batches, answer; end when the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches everybody; the parent decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def hear() -> Any:
        while not connection.poll(1.0):
            if os.getppid() != parent:
                os._exit(0)
        return connection.recv()

    with contextlib.suppress(EOFError, OSError):
        while True:
            _draw_task(hear(), hear, connection, stage, buffers, arena)


def _draw_task(
    task: _Task,
    hear: Callable[[], Any],
    connection: Connection,
    stage: Stage,
    buffers: Sequence[Buffers],
    arena: _Arena,
) -> None:
    """Draw the batches of one frame that the parent hands out."""
    try:
        viewer = task.viewer
        frame = Frame(
            viewer,
            Sight(arena.vertices, stage.scene.triangles, arena.cut),
            quilt_rays(stage.facets, stage.layout, task.lit, viewer.eye),
            stage.blocks,
            BlockPairs(arena.start, arena.triangle[: task.pairs]),
            stage.owners,
        )
        while (batch := hear()) is not None:
            connection.send(draw_batch(stage, frame, batch, buffers[task.buffers]))
        connection.send(None)
    except Exception:
        connection.send(_Fault(traceback.format_exc()))
