"""Who does the work of a frame: threads of this process here, processes in `workers`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any, Protocol, TypeAlias

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.antialiasing import add_samples
from quiltcli.render.batch import Drawn, draw_batch, ordered
from quiltcli.render.buffers import Buffers, clear_blocks
from quiltcli.render.setup import Stage
from quiltcli.shading.sums import Background, Sums, new_sums, summed
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
        self,
        frame: Frame,
        work: Sequence[tuple[int, int]],
        buffers: Buffers,
        stale: BoolArray,
        *,
        exposed: bool = False,
    ) -> list[Drawn]:
        """Draw batches, as `draw_batch`; `stale` are microtiles (M,) of all blocks."""

    def expose(self, frame: Frame, work: Sequence[tuple[int, int]], places: Places) -> None:
        """Add samples of batches to the sums of the exposure under way."""

    def develop(self, buffers: Buffers) -> None:
        """Write the exposure into buffers; the next begins."""


Places: TypeAlias = Sequence[tuple[float, float]]


@dataclass
class Threads:
    """A crew of threads of this process."""

    stage: Stage
    workers: int
    _sums: list[Sums] = field(default_factory=list)

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
        self,
        frame: Frame,
        work: Sequence[tuple[int, int]],
        buffers: Buffers,
        stale: BoolArray,
        *,
        exposed: bool = False,
    ) -> list[Drawn]:
        """Draw batches, each in a thread."""

        def drawn(batch: tuple[int, int]) -> Drawn:
            tiles = self.stage.blocks.tiles(batch)
            return draw_batch(self.stage, frame, batch, buffers, stale[tiles], exposed=exposed)

        return self._all(drawn, work)

    def expose(self, frame: Frame, work: Sequence[tuple[int, int]], places: Places) -> None:
        """Add samples of batches to the sums of the exposure under way."""
        if not self._sums and (channels := summed(self.stage.job.output.channels)):
            size = self.stage.owners.size
            self._sums.append(Sums(new_sums(channels, lambda dtype: np.zeros(size, dtype)), channels))
        ready = ordered(self.stage, frame)
        for sums in self._sums:
            self._all(partial(_expose, self.stage, ready, sums, places), work)

    def develop(self, buffers: Buffers) -> None:
        """Write the exposure into buffers; the next begins."""
        for sums in self._sums:
            parts = shares_of(sums.size, self.workers)
            self._all(partial(develop, self.stage, sums, buffers), parts)

    def _all(self, work: Callable[[Any], Any], items: Iterable[Any]) -> list[Any]:
        if self.workers == 1:
            return list(map(work, items))
        with ThreadPoolExecutor(self.workers) as pool:
            return list(pool.map(work, items))


def _expose(stage: Stage, frame: Frame, sums: Sums, places: Places, batch: tuple[int, int]) -> None:
    add_samples(stage, frame, batch, sums, places)


def develop(stage: Stage, sums: Sums, buffers: Buffers, part: slice) -> None:
    """Write some of an exposure's pixels into buffers, and make their sums 0."""
    background: Background = stage.scene.background
    if stage.scene.sky is not None:
        # It lies there since the shutter opened.
        background = partial(_there, buffers)
    sums.store(buffers, stage.job.render.samples, background, part)
    sums.clear(part)


def _there(buffers: Buffers, address: IntArray) -> Float32Array:
    return np.stack([buffers[name][address].astype(np.float32) for name in "RGB"])


def shares_of(count: int, parts: int) -> list[slice]:
    """Ranges of `count` things, so many parts of about the same size."""
    ends = np.linspace(0, count, parts + 1).astype(np.int64).tolist()
    return [slice(first, last) for first, last in pairwise(ends)]


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
        one_sided=how.double_sided == "file",
    )


def default_threads() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
