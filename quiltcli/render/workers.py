"""Worker processes that bin and draw a frame in shared memory.

Threads gain little here: much of numpy holds the interpreter's lock. So the workers are forked once,
with everything the frames share already in memory, and nothing of it is ever copied or sent. What
changes from frame to frame, moving scenes too, is written into shared arrays, and pixels go straight
into shared buffers: every pixel belongs to one batch, so nobody waits for anybody. Where processes
cannot fork, `frame.draw_frame` draws in threads instead.

    parent      begin ─ see ─┬─ bin ──┬─ clear ─┬─ draw ──┬─ …
    workers       └─ tables ─┴─ vertices, shares of triangles, blocks, batches: whoever is free takes the next
"""

from __future__ import annotations

import contextlib
import mmap
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.util import Finalize
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import exr_channels
from quiltcli.ending import SIGNALS
from quiltcli.errors import CheckFailedError, Problem
from quiltcli.geometry import BoolArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.arena import (
    Arena,
    arena_names,
    new_arena,
    share_scene,
)
from quiltcli.render.batch import Drawn
from quiltcli.render.buffers import Buffers
from quiltcli.render.crew import Places, Threads, plan_of, shares_of
from quiltcli.render.forking import wait_for_sleep
from quiltcli.render.setup import Stage
from quiltcli.render.shared import SharedArrays
from quiltcli.render.workplace import Fault, Item, Moved, Task, Workplace, serve
from quiltcli.scene.textures.tangents import tangents_of
from quiltcli.shading.lights import prepare_shadows
from quiltcli.shading.sums import Sums, new_sums, summed
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame
from quiltcli.visibility.shares import (
    Binned,
    bin_frame,
    join,
    sight_of,
)

_SHARES = 4  # of a worker in what can be cut at will, so that none waits long for the last
_MANY_PIXELS = 1 << 20
_MANY_TRIANGLES = 50_000


def can_fork() -> bool:
    """Whether processes can be forked here that share this one's memory.

    Daemonic processes may have no children, and a thread beside the main one is somebody else's
    program, which may hold locks that would stay locked in a fork.
    """
    if multiprocessing.current_process().daemon or threading.current_thread() is not threading.main_thread():
        return False
    return sys.platform.startswith("linux") and "fork" in multiprocessing.get_all_start_methods()


def worth_forking(stage: Stage) -> bool:
    """Whether a frame is likely to take longer than processes take to start and end."""
    return stage.owners.size >= _MANY_PIXELS or len(stage.scene.triangles) >= _MANY_TRIANGLES


def shared_array(length: int, dtype: Any) -> NDArray[Any]:
    """Zeros that forked processes write to together; freed with the last of them."""
    dtype = np.dtype(dtype)
    try:
        memory = mmap.mmap(-1, max(length * dtype.itemsize, 1))
    except OSError as error:
        raise MemoryError(str(error)) from error
    return np.frombuffer(memory, dtype=dtype, count=length)


def shared_buffers(stage: Stage) -> Buffers:
    """As `buffers.new_buffers`, in memory that workers share."""
    buffers = {}
    for name, (dtype, empty) in exr_channels(stage.job.output.channels).items():
        buffers[name] = shared_array(stage.owners.size, dtype)
        if empty:
            buffers[name].fill(empty)
    return buffers


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

    def hear(self, frame: int) -> Any:
        """The answer to a piece of work."""
        try:
            answer = self.connection.recv()
        except (EOFError, OSError):
            raise self._died(frame) from None
        if isinstance(answer, Fault):
            words = f"frame {frame}: a worker failed:\n{answer.traceback}"
            raise RuntimeError(words)  # noqa: TRY004 — the type is right; it is the news that is bad
        return answer

    def _died(self, frame: int) -> CheckFailedError:
        """The error of a worker that is gone."""
        self.process.join(1)
        code = self.process.exitcode
        how = f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with code {code}"
        advice = (
            " (out of memory? fewer threads or smaller pages need less)" if code == -signal.SIGKILL else ""
        )
        return CheckFailedError(Problem(f"frame {frame}: a worker process {how}{advice}"))


class Pool:
    """Forked workers of one stage; a context manager that ends them."""

    def __init__(self, stage: Stage, buffers: Sequence[Buffers], workers: int) -> None:
        self._stage = stage
        self._buffers = buffers
        self._arrays = SharedArrays()
        self._shares_of_triangles = _SHARES * workers
        self._arena = self._new_arena(stage)
        self._sums = _shared_sums(stage)
        self._frame = 0
        # Made once, before there are copies of the process.
        _ = stage.scene.planes, stage.scene.corner_normals, stage.scene.corner_colors
        tangents_of(stage.scene)
        if stage.job.render.backface_culling:
            _ = stage.scene.facing
        prepare_shadows(stage.scene)
        self._workers: list[_Worker] = []
        self._known: list[set[int]] = [set() for _ in range(workers)]
        # Python waits at its end for children that are left, and these are deaf to its signal to end.
        self._end = Finalize(self, _kill, args=(self._workers,), exitpriority=10)
        # A signal to the whole group must not find a child that has not yet learned to leave it to us.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            for _number in range(workers):
                self._workers.append(_forked(Workplace(stage, buffers, self._arena, self._sums)))
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        except BaseException:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            self.close()
            raise

    @property
    def workers(self) -> int:
        """How many they are."""
        return len(self._workers)

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers, whatever they are doing."""
        self._end()
        self._arrays.close()

    def begin(self, stage: Stage) -> None:
        """Turn to a stage that differs in its scene alone; nothing is done where that is still the same."""
        old, new = self._stage.scene, stage.scene
        self._stage = stage
        if new is old:
            return
        plain, names = share_scene(self._arrays, old, new)
        self._arena = self._new_arena(stage)
        handles = self._arrays.handles([*names, *arena_names()])
        for worker, known in zip(self._workers, self._known, strict=True):
            worker.tell(self._frame, Moved(plain))
            self._arrays.send(worker.connection, handles, known)
        self._share_out(Item("tables", (part,)) for part in self._shares(len(new.triangles)))

    def _new_arena(self, stage: Stage) -> Arena:
        return new_arena(self._arrays, stage.scene, self._shares_of_triangles, len(stage.blocks.facet))

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene.

        Raises:
            CheckFailedError: a worker died; by the other methods, too.
        """
        self._frame = viewer.frame
        for worker in self._workers:
            worker.tell(self._frame, Task(viewer, rays.lit))
        seen, arena = self._arena.seen, self._arena
        self._share_out(Item("see", (part,)) for part in self._shares(len(seen.vertices)))
        parts = self._shares(len(seen.cut))
        shares = self._share_out(Item("bin", (number, part)) for number, part in enumerate(parts))
        if None in shares:
            return bin_frame(plan_of(self._stage, viewer, rays))
        sight = sight_of(self._stage.scene, seen, culling=self._stage.job.render.backface_culling)
        return join(sight, shares, arena.frame_pairs())

    def clear(self, blocks: NDArray[np.int64], buffers: Buffers) -> None:
        """Empty the pixels of blocks in one of the pool's buffers."""
        index = self._index(buffers)
        parts = [part for part in np.array_split(blocks, _SHARES * self.workers) if part.size]
        self._share_out(Item("clear", (part, index)) for part in parts)

    def draw(
        self,
        frame: Frame,
        work: Sequence[tuple[int, int]],
        buffers: Buffers,
        stale: BoolArray,
        *,
        exposed: bool = False,
    ) -> list[Drawn]:
        """Draw batches into one of the pool's buffers, as `batch.draw_batch`."""
        if frame.pairs.memory is not self._arena.pairs.memory:
            return Threads(self._stage, self.workers).draw(frame, work, buffers, stale, exposed=exposed)
        index, tiles = self._index(buffers), self._stage.blocks.tiles
        dearest = _dearest_first(frame, work)
        items = (Item("draw", (work[i], index, stale[tiles(work[i])], exposed)) for i in dearest)
        done = self._share_out(items)
        return [one for _, one in sorted(zip(dearest, done, strict=True), key=itemgetter(0))]

    def expose(self, frame: Frame, work: Sequence[tuple[int, int]], places: Places) -> None:
        """Add samples of batches to the sums of the exposure under way."""
        if frame.pairs.memory is not self._arena.pairs.memory:
            Threads(self._stage, self.workers, self._sums).expose(frame, work, places)
            return
        self._share_out(Item("expose", (work[i], places)) for i in _dearest_first(frame, work))

    def develop(self, buffers: Buffers) -> None:
        """Write the exposure into one of the pool's buffers; the next begins."""
        index = self._index(buffers)
        for sums in self._sums:
            parts = shares_of(sums.size, _SHARES * self.workers)
            self._share_out(Item("develop", (index, part)) for part in parts)

    def _index(self, buffers: Buffers) -> int:
        return next(i for i, known in enumerate(self._buffers) if known is buffers)

    def _shares(self, count: int) -> list[slice]:
        """Ranges of `count` things to be handed out."""
        return shares_of(count, _SHARES * self.workers)

    def _share_out(self, items: Iterable[Item]) -> list[Any]:
        """Hand out work as workers become free; the answers in the order of the items."""
        waiting = list(items)[::-1]
        answers: list[Any] = [None] * len(waiting)
        busy: dict[Any, tuple[_Worker, int]] = {}

        def hand_out(worker: _Worker) -> None:
            if waiting:
                busy[worker.connection] = worker, len(answers) - len(waiting)
                worker.tell(self._frame, waiting.pop())

        for worker in self._workers:
            hand_out(worker)
        while busy:
            for connection in wait(list(busy)):
                worker, number = busy.pop(connection)
                answers[number] = worker.hear(self._frame)
                hand_out(worker)
        return answers


def _shared_sums(stage: Stage) -> list[Sums]:
    """Sums of exposures in memory that workers share, if there are exposures."""
    channels, size = summed(stage.job.output.channels), stage.owners.size
    if not stage.job.render.shutter or not channels:
        return []
    return [Sums(new_sums(channels, lambda dtype: shared_array(size, dtype)), channels)]


def _dearest_first(frame: Frame, work: Sequence[tuple[int, int]]) -> list[int]:
    """The batches by their numbers, those of most pairs first."""
    cost = [int(frame.pairs.per_block[first:last].sum()) for first, last in work]
    order: list[int] = np.argsort(cost, kind="stable")[::-1].tolist()
    return order


def _forked(place: Workplace) -> _Worker:
    """A new worker."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(theirs, place, os.getpid()), daemon=True)
    wait_for_sleep()
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _kill(workers: list[_Worker]) -> None:
    """End workers, whatever they are doing; there will be none in the list."""
    for worker in workers:
        with contextlib.suppress(OSError):
            worker.connection.close()
        worker.process.kill()
    while workers:
        workers.pop().process.join()
