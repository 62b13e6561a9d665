"""Worker processes that bin and draw a frame in shared memory.

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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from multiprocessing.connection import Connection, wait
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import exr_channels
from quiltcli.errors import CheckFailedError, Problem
from quiltcli.geometry import BoolArray
from quiltcli.projection.planar import QuiltRays, quilt_rays
from quiltcli.render.batch import Drawn, draw_batch
from quiltcli.render.buffers import Buffers, clear_blocks
from quiltcli.render.crew import Threads, plan_of
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import BlockPairs, Frame, pairs_by_block
from quiltcli.visibility.shares import (
    Binned,
    BinPlan,
    Seen,
    Share,
    bin_frame,
    bin_share,
    join,
    see_vertices,
    sight_of,
)

_ROOM = 8  # pairs a triangle there is room for; memory that is not touched costs nothing
_LEAST_ROOM = 1 << 26
_SHARES = 4  # of a worker in what can be cut at will, so that none waits long for the last
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
    """As `blank.new_buffers`, in memory that workers share."""
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
        seen: what is known of vertices and triangles.
        pairs: block pairs; those of triangle t lie from t·C/T on in the C numbers of their memory.
    """

    seen: Seen
    pairs: BlockPairs

    def frame_pairs(self) -> BlockPairs:
        """The pairs of the frame under way; a record of its own, for it keeps what it has counted."""
        return replace(self.pairs)

    def begin(self, triangle: int) -> int:
        """Where the pairs of a share that begins with this triangle lie."""
        return triangle * (self.pairs.memory.size // max(len(self.seen.cut), 1))


def _new_arena(stage: Stage, workers: int) -> _Arena:
    vertices, triangles = len(stage.scene.vertices), len(stage.scene.triangles)
    room = max(_ROOM * triangles, _LEAST_ROOM)
    shares, blocks = _SHARES * workers, len(stage.blocks.facet)
    return _Arena(
        Seen(
            shared_array(3 * vertices, np.float64).reshape(-1, 3),
            shared_array(vertices, np.float64),
            shared_array(vertices, np.int32),
            shared_array(vertices, np.int32),
            shared_array(triangles, np.bool_),
        ),
        BlockPairs(
            shared_array(shares * blocks, np.int64).reshape(shares, blocks),
            shared_array(shares * blocks, np.int64).reshape(shares, blocks),
            shared_array(room, np.int32),
        ),
    )


@dataclass(frozen=True)
class _Task:
    """What a worker is told of a frame before its work: the viewer, and the facets (F,) that are drawn."""

    viewer: Viewer
    lit: BoolArray


@dataclass(frozen=True)
class _Item:
    """A piece of work: a method of `_Workplace`, and what it is given."""

    name: str
    given: tuple[Any, ...]


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
        if isinstance(answer, _Fault):
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


@dataclass(frozen=True)
class _Fault:
    """What a worker answers when something in it failed."""

    traceback: str


class Pool:
    """Forked workers of one stage; a context manager that ends them."""

    def __init__(self, stage: Stage, buffers: Sequence[Buffers], workers: int) -> None:
        self._stage = stage
        self._buffers = buffers
        self._arena = _new_arena(stage, workers)
        self._frame = 0
        # Made once, before there are copies of the process.
        _ = stage.scene.planes, stage.scene.corner_normals, stage.scene.corner_colors
        if stage.job.render.backface_culling:
            _ = stage.scene.facing
        context = multiprocessing.get_context("fork")
        self._workers: list[_Worker] = []
        for _number in range(workers):
            ours, theirs = context.Pipe()
            place = _Workplace(stage, buffers, self._arena)
            process = context.Process(target=_serve, args=(theirs, place, os.getpid()), daemon=True)
            process.start()
            theirs.close()
            self._workers.append(_Worker(process, ours))

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
        for worker in self._workers:
            with contextlib.suppress(OSError):
                worker.connection.close()
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join()
        self._workers = []

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene.

        Raises:
            CheckFailedError: a worker died; by the other methods, too.
        """
        self._frame = viewer.frame
        for worker in self._workers:
            worker.tell(self._frame, _Task(viewer, rays.lit))
        seen, arena = self._arena.seen, self._arena
        self._share_out(_Item("see", (part,)) for part in self._shares(len(seen.vertices)))
        parts = self._shares(len(seen.cut))
        shares = self._share_out(_Item("bin", (number, part)) for number, part in enumerate(parts))
        if None in shares:
            return bin_frame(plan_of(self._stage, viewer, rays))
        sight = sight_of(self._stage.scene, seen, culling=self._stage.job.render.backface_culling)
        return join(sight, shares, arena.frame_pairs())

    def clear(self, blocks: NDArray[np.int64], buffers: Buffers) -> None:
        """Empty the pixels of blocks in one of the pool's buffers."""
        index = self._index(buffers)
        parts = [part for part in np.array_split(blocks, _SHARES * self.workers) if part.size]
        self._share_out(_Item("clear", (part, index)) for part in parts)

    def draw(
        self, frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers, stale: BoolArray
    ) -> list[Drawn]:
        """Draw batches into one of the pool's buffers, as `batch.draw_batch`."""
        pairs = frame.pairs
        if pairs.memory is not self._arena.pairs.memory:
            return Threads(self._stage, self.workers).draw(frame, work, buffers, stale)
        index = self._index(buffers)
        cost = [int(pairs.per_block[first:last].sum()) for first, last in work]
        dearest = np.argsort(cost, kind="stable")[::-1].tolist()
        tiles = self._stage.blocks.tiles
        done = self._share_out(_Item("draw", (work[i], index, stale[tiles(work[i])])) for i in dearest)
        return [one for _, one in sorted(zip(dearest, done, strict=True), key=itemgetter(0))]

    def _index(self, buffers: Buffers) -> int:
        return next(i for i, known in enumerate(self._buffers) if known is buffers)

    def _shares(self, count: int) -> list[slice]:
        """Ranges of `count` things to be handed out."""
        ends = np.linspace(0, count, _SHARES * self.workers + 1).astype(np.int64).tolist()
        return [slice(first, last) for first, last in pairwise(ends)]

    def _share_out(self, items: Iterable[_Item]) -> list[Any]:
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


class _Workplace:
    """What a worker has at hand; its public methods are the work it can be given."""

    def __init__(self, stage: Stage, buffers: Sequence[Buffers], arena: _Arena) -> None:
        self._stage, self._buffers, self._arena = stage, buffers, arena
        self._plan: BinPlan | None = None
        self._frame: Frame | None = None

    def begin(self, task: _Task) -> None:
        """Turn to another frame."""
        rays = quilt_rays(self._stage.facets, self._stage.layout, task.lit, task.viewer.eye)
        self._plan, self._frame = plan_of(self._stage, task.viewer, rays), None

    def see(self, part: slice) -> None:
        """Find out about some of the vertices."""
        see_vertices(self.plan, part, self._arena.seen)

    def bin(self, number: int, part: slice) -> Share | None:
        """Bin some of the triangles.

        Returns:
            the share without its keys, whose pairs go into the arena; None if there is no room for so many.
        """
        share = bin_share(self.plan, part, self._arena.seen)
        first, end = self._arena.begin(part.start), self._arena.begin(part.stop)
        if share.keys.size > end - first:
            return None
        found, kept = pairs_by_block([share.keys], self._stage.blocks), self._arena.pairs
        kept.memory[first : first + share.keys.size] = found.memory
        kept.first[number] = first + found.first[0]
        kept.count[number] = found.count[0]
        return replace(share, keys=share.keys[:0])

    def clear(self, blocks: NDArray[np.int64], index: int) -> None:
        """Empty the pixels of some blocks."""
        clear_blocks(self._stage, blocks, self._buffers[index])

    def draw(self, batch: tuple[int, int], index: int, stale: BoolArray) -> Drawn:
        """Draw a batch."""
        if self._frame is None:
            seen, plan, stage = self._arena.seen, self.plan, self._stage
            sight = sight_of(stage.scene, seen, culling=plan.culling)
            pairs = self._arena.frame_pairs()
            self._frame = Frame(plan.viewer, sight, plan.rays, stage.blocks, pairs)
        return draw_batch(self._stage, self._frame, batch, self._buffers[index], stale)

    @property
    def plan(self) -> BinPlan:
        """How the frame is binned."""
        assert self._plan is not None, "no frame has begun"
        return self._plan


def _serve(connection: Connection, place: _Workplace, parent: int) -> None:
    """A worker's life: take frames and work, answer; end when the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches everybody; the parent decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with contextlib.suppress(EOFError, OSError):
        while True:
            while not connection.poll(1.0):
                if os.getppid() != parent:
                    os._exit(0)
            given = connection.recv()
            try:
                if isinstance(given, _Task):
                    place.begin(given)
                else:
                    connection.send(getattr(place, given.name)(*given.given))
            except Exception:
                connection.send(_Fault(traceback.format_exc()))
