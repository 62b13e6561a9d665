"""Who does the work of a frame: threads of this process here, processes in `workers`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.batch import Drawn, draw_batch
from quiltcli.render.buffers import Buffers, clear_blocks
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame
from quiltcli.visibility.shares import Binned, BinPlan, bin_frame, bin_plan


class Crew(Protocol):
    """Whoever does the work of a frame that can be divided."""

    @property
    def workers(self) -> int:
        """How many they are."""

    def begin(self, stage: Stage) -> None:
        """Turn to a stage that differs in its scene alone, which may have moved."""

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene."""

    def clear(self, blocks: IntArray, buffers: Buffers) -> None:
        """Empty the pixels of blocks."""

    def draw(
        self, frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers, stale: BoolArray
    ) -> list[Drawn]:
        """Draw batches, as `draw_batch`; `stale` are microtiles (M,) of all blocks."""


@dataclass
class Threads:
    """A crew of threads of this process."""

    stage: Stage
    workers: int

    def begin(self, stage: Stage) -> None:
        """Turn to a stage that differs in its scene alone."""
        self.stage = stage

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene, in one thread."""
        return bin_frame(plan_of(self.stage, viewer, rays))

    def clear(self, blocks: IntArray, buffers: Buffers) -> None:
        """Empty the pixels of blocks."""
        clear_blocks(self.stage, blocks, buffers)

    def draw(
        self, frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers, stale: BoolArray
    ) -> list[Drawn]:
        """Draw batches, each in a thread."""

        def drawn(batch: tuple[int, int]) -> Drawn:
            return draw_batch(self.stage, frame, batch, buffers, stale[self.stage.blocks.tiles(batch)])

        if self.workers == 1:
            return list(map(drawn, work))
        with ThreadPoolExecutor(self.workers) as pool:
            return list(pool.map(drawn, work))


def plan_of(stage: Stage, viewer: Viewer, rays: QuiltRays) -> BinPlan:
    """How a frame of the stage is binned."""
    how = stage.job.render
    return bin_plan(
        stage.scene,
        stage.parts,
        stage.blocks,
        viewer,
        rays,
        culling=how.backface_culling,
        reach=0.5 if how.samples > 1 else 0.0,
    )


def default_threads() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
