"""One frame of the quilt: from a pose of the viewer to the pixels of all pages.

`draw_frame` is all that happens a frame, in the order of the paper's pipeline: bin, then, batch by batch,
prewarp, rasterize, shade.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from quiltcli.display import Facets, lit_facets
from quiltcli.geometry import BoolArray, IntArray, dot
from quiltcli.projection.planar import QuiltRays, quilt_rays
from quiltcli.render.batch import Drawn, draw_batch
from quiltcli.render.buffers import Buffers, clear, clear_blocks, has_background, mends_itself
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, batches
from quiltcli.visibility.shares import Binned, BinPlan, bin_frame, bin_plan


class Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time the block takes to the stage's."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


class Crew(Protocol):
    """Whoever does the work of a frame that can be divided."""

    @property
    def workers(self) -> int:
        """How many they are."""

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene."""

    def clear(self, blocks: IntArray, buffers: Buffers) -> None:
        """Empty the pixels of blocks."""

    def draw(
        self, frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers, stale: BoolArray
    ) -> list[Drawn]:
        """Draw batches, as `draw_batch`; `stale` are microtiles (M,) of all blocks."""


@dataclass(frozen=True)
class Threads:
    """A crew of threads of this process."""

    stage: Stage
    workers: int

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


def draw_frame(
    stage: Stage,
    viewer: Viewer,
    buffers: Buffers,
    threads: int = 1,
    only: BoolArray | None = None,
    *,
    dirty: BoolArray | None = None,
    crew: Crew | None = None,
) -> FrameRecord:
    """Draw what the viewer sees on every lit facet.

    Args:
        stage: what the job's frames share.
        viewer: the viewer.
        buffers: from `new_buffers`; overwritten where facets are drawn, emptied elsewhere.
        threads: batches drawn at a time; the pixels do not depend on it.
        only: (F,) facets to draw; the pixels of all others are left as they are.
        dirty: (M,) microtiles whose pixels may hold something, changed to those that do after this frame;
            all, where it is not known.
        crew: does the work instead of threads.

    Returns:
        The frame's record.
    """
    clock = Clock()
    crew = crew or Threads(stage, threads)
    lit = lit_facets(stage.facets, viewer.eye)
    if only is not None:
        lit &= only
    with clock.stage("bin"):
        rays = quilt_rays(stage.facets, stage.layout, lit, viewer.eye)
        binned = crew.bin(viewer, rays)
    frame = Frame(viewer, binned.sight, rays, stage.blocks, binned.pairs)
    written = frame.pairs.per_block > 0
    stale = np.zeros(stage.blocks.used.size, dtype=np.bool_)
    with clock.stage("clear"):
        if only is None and dirty is not None:
            mended = written & mends_itself(stage)
            stale = dirty & mended.repeat(np.diff(stage.blocks.tile_start))
            crew.clear(np.flatnonzero(stage.blocks.any_tile(dirty) & ~mended), buffers)
        else:
            clear(stage, buffers, only)
    with clock.stage("rasterize and shade"):
        if has_background(stage):
            written |= rays.lit[stage.blocks.facet]
        work = batches(frame, written, crew.workers)
        drawn = crew.draw(frame, work, buffers, stale)
        visible = sum(batch.visible for batch in drawn)
        if dirty is not None:
            if only is None:
                dirty[:] = False
            for batch, done in zip(work, drawn, strict=True):
                dirty[stage.blocks.tiles(batch)] |= done.tiles
    return FrameRecord(
        frame=viewer.frame,
        triangles=binned.triangles,
        reaching=binned.reaching,
        pairs=binned.facet_pairs,
        settled=binned.settled,
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds=clock.seconds,
        warnings=tuple(frame_warnings(stage, viewer, lit, binned.facet_pairs, visible)),
    )


def plan_of(stage: Stage, viewer: Viewer, rays: QuiltRays) -> BinPlan:
    """How a frame of the stage is binned."""
    culling = stage.job.render.backface_culling
    return bin_plan(stage.scene, stage.parts, stage.blocks, viewer, rays, culling=culling)


def frame_warnings(stage: Stage, viewer: Viewer, lit: BoolArray, pairs: int, visible: int) -> Iterator[str]:
    """What a user should know of a frame that shows little or nothing."""
    if not lit.any():
        yield "the eye is behind every facet: nothing is lit"
    elif not pairs:
        yield "no triangle of the scene shows on any facet"
    elif not visible:
        yield "no pixel shows the scene"
    if viewer.depth == "planar":
        behind = int(np.count_nonzero(lit & facets_behind(stage.facets, viewer)))
        if behind:
            yield (
                f"{behind} lit facets lie wholly behind the eye, where planar depth draws nothing"
                " (render.depth: radial draws all around)"
            )


def facets_behind(facets: Facets, viewer: Viewer) -> BoolArray:
    """Facets (F,) no corner of which lies ahead of the eye along the look direction."""
    ahead = dot(facets.corners - viewer.eye, viewer.look)
    result: BoolArray = np.maximum.reduceat(ahead, facets.corner_start[:-1]) <= 0
    return result


def default_threads() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
