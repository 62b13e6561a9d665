"""A worker process's side of the pool: what it is told, what it has at hand, and its life."""

from __future__ import annotations

import contextlib
import os
import signal
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.ending import SIGNALS
from quiltcli.geometry import BoolArray
from quiltcli.render.antialiasing import add_samples
from quiltcli.render.arena import (
    Arena,
    arena_of,
    fill_tables,
    moved_scene,
)
from quiltcli.render.batch import Drawn, draw_batch, ordered
from quiltcli.render.buffers import Buffers, clear_blocks
from quiltcli.render.crew import Places, develop, plan_of
from quiltcli.render.setup import Stage
from quiltcli.render.shared import AttachedArrays
from quiltcli.shading.sums import Sums
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, pairs_by_block
from quiltcli.visibility.shares import (
    BinPlan,
    Share,
    bin_share,
    see_vertices,
    sight_of,
)


@dataclass(frozen=True)
class Task:
    """What a worker is told of a frame before its work: the viewer, and the facets (F,) that are drawn."""

    viewer: Viewer
    lit: BoolArray


@dataclass(frozen=True)
class Moved:
    """A worker is told that the scene has moved: fields that are no arrays; the arrays follow."""

    plain: dict[str, Any]


@dataclass(frozen=True)
class Item:
    """A piece of work: a method of `Workplace`, and what it is given."""

    name: str
    given: tuple[Any, ...]


@dataclass(frozen=True)
class Fault:
    """What a worker answers when something in it failed."""

    traceback: str


class Workplace:
    """What a worker has at hand; its public methods are the work it can be given."""

    def __init__(
        self, stage: Stage, buffers: Sequence[Buffers], arena: Arena, sums: Sequence[Sums] = ()
    ) -> None:
        self._stage, self._buffers, self._arena, self._sums = stage, buffers, arena, sums
        self._arrays = AttachedArrays()
        self._plan: BinPlan | None = None
        self._frame: Frame | None = None

    def begin(self, task: Task) -> None:
        """Turn to another frame."""
        rays = self._stage.rays(task.lit, task.viewer)
        self._plan, self._frame = plan_of(self._stage, task.viewer, rays), None

    def move(self, moved: Moved, connection: Connection) -> None:
        """Take over a scene that has moved."""
        arrays = self._arrays.receive(connection)
        self._arena = arena_of(arrays)
        self._stage = replace(self._stage, scene=moved_scene(self._stage.scene, moved.plain, arrays))

    def tables(self, part: slice) -> None:
        """Work out the tables of some triangles of a scene that has moved."""
        fill_tables(self._stage.scene, part)

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

    def draw(self, batch: tuple[int, int], index: int, stale: BoolArray, exposed: bool) -> Drawn:
        """Draw a batch."""
        return draw_batch(self._stage, self.frame, batch, self._buffers[index], stale, exposed=exposed)

    def expose(self, batch: tuple[int, int], places: Places) -> None:
        """Add samples of a batch to the exposure under way."""
        for sums in self._sums:
            add_samples(self._stage, ordered(self._stage, self.frame), batch, sums, places)

    def develop(self, index: int, part: slice) -> None:
        """Write some pixels of the exposure."""
        for sums in self._sums:
            develop(self._stage, sums, self._buffers[index], part)

    @property
    def frame(self) -> Frame:
        """The frame under way, all of which is binned."""
        if self._frame is None:
            seen, plan, stage = self._arena.seen, self.plan, self._stage
            sight = sight_of(stage.scene, seen, culling=plan.culling)
            pairs = self._arena.frame_pairs()
            self._frame = Frame(plan.viewer, sight, plan.rays, stage.blocks, pairs, patches=stage.patches)
        return self._frame

    @property
    def plan(self) -> BinPlan:
        """How the frame is binned."""
        assert self._plan is not None, "no frame has begun"
        return self._plan


def serve(connection: Connection, place: Workplace, parent: int) -> None:
    """A worker's life: take frames and work, answer; end when the parent is gone."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # both may reach a whole group; the parent decides
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    with contextlib.suppress(EOFError, OSError):
        while True:
            while not connection.poll(1.0):
                if os.getppid() != parent:
                    os._exit(0)
            given = connection.recv()
            try:
                if isinstance(given, Task):
                    place.begin(given)
                elif isinstance(given, Moved):
                    place.move(given, connection)
                else:
                    connection.send(getattr(place, given.name)(*given.given))
            except Exception:
                connection.send(Fault(traceback.format_exc()))
