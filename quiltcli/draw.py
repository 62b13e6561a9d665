"""One frame of the quilt: from a pose of the viewer to the pixels of all pages.

`Stage` holds what the viewer cannot change and is set up once a job; `draw_frame` is all that happens
a frame, in the order of the paper's pipeline: bin, then, batch by batch, prewarp, rasterize, shade.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quiltcli.binframe import Binned, BinPlan, bin_frame, bin_plan
from quiltcli.binning import Parts, facet_parts
from quiltcli.channels import empty_buffers, exr_channels, fill, wanted_for
from quiltcli.display import Facets, lit_facets, load_display
from quiltcli.geometry import BoolArray, IntArray, OwnerArray, dot
from quiltcli.homography import QuiltRays, quilt_rays
from quiltcli.job import JobFile, PackSpec, load_display_file, load_scene_file
from quiltcli.layout import Layout, pixel_owners
from quiltcli.orders import DepthOrder, depth_order
from quiltcli.packing import layout_for
from quiltcli.raster import (
    Blocks,
    Drawing,
    Frame,
    Hits,
    batches,
    block_window,
    cut_blocks,
    draw,
    rasterize,
)
from quiltcli.report import FrameRecord
from quiltcli.scene import Scene, load_scene
from quiltcli.shading import MOST_HALF, shading_wants
from quiltcli.tileshading import NodeShader, pixel_colors
from quiltcli.viewer import Viewer

Buffers = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Stage:
    """What the viewer cannot change: everything above the loop over frames.

    Attributes:
        job: the job.
        facets: the display, with the rasters the layout was made for.
        layout: the facets' places, one row a facet.
        scene: the scene.
        parts: convex pieces of the facets.
        blocks: the facets' rectangles, cut for the rasterizer.
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
        fill: share of the quilt's pixels that lie in facets.
    """

    job: JobFile
    facets: Facets
    layout: Layout
    scene: Scene
    parts: Parts
    blocks: Blocks
    owners: OwnerArray
    fill: float


def set_stage(job: JobFile) -> Stage:
    """Load everything a job names and prepare what all of its frames share.

    Raises:
        QuiltError: a file is wrong, or the layout does not belong to the display.
    """
    facets, layout = layout_for(job.layout or PackSpec(), load_display(load_display_file(job.display)))
    return stage_of(job, facets, layout, load_scene(load_scene_file(job.scene)), job.render.bleed)


def stage_of(job: JobFile, facets: Facets, layout: Layout, scene: Scene, bleed: int) -> Stage:
    """The stage of a display, its layout and a scene that are already there."""
    owners = pixel_owners(layout, bleed)
    return Stage(
        job=job,
        facets=facets,
        layout=layout,
        scene=scene,
        parts=facet_parts(facets, layout, bleed),
        blocks=cut_blocks(layout, bleed, owners),
        owners=owners,
        fill=np.count_nonzero(owners > 0) / owners.size,
    )


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


def new_buffers(stage: Stage) -> Buffers:
    """Flat buffers of every channel the job asks for, over all pages."""
    return empty_buffers(stage.job.output.channels, stage.owners.size)


class Crew(Protocol):
    """Whoever does the work of a frame that can be divided."""

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene."""

    def clear(self, blocks: IntArray, buffers: Buffers) -> None:
        """Empty the pixels of blocks."""

    def draw(
        self, frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers, stale: BoolArray
    ) -> list[Drawn]:
        """Draw batches, as `draw_batch`; `stale` are microtiles (M,) of all blocks."""


@dataclass(frozen=True)
class Drawn:
    """What has been drawn of a batch.

    Attributes:
        visible: how many pixels of facets, bleed left out, show the scene.
        tiles: (m,) microtiles of the batch's blocks that have pixels that do.
    """

    visible: int
    tiles: BoolArray


@dataclass(frozen=True)
class Threads:
    """A crew of threads of this process."""

    stage: Stage
    threads: int

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

        if self.threads == 1:
            return list(map(drawn, work))
        with ThreadPoolExecutor(self.threads) as pool:
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
        work = batches(frame, written)
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


def clear(stage: Stage, buffers: Buffers, only: BoolArray | None) -> None:
    """Empty the pixels of the facets in `only`, or everything."""
    mine = slice(None) if only is None else np.concatenate(([False], only))[np.abs(stage.owners)]
    for name, value in empty_values(stage).items():
        buffers[name][mine] = value


def clear_blocks(stage: Stage, blocks: IntArray, buffers: Buffers) -> None:
    """Empty the pixels of the blocks with these indices."""
    empty = empty_values(stage)
    for block in blocks.tolist():
        for name, value in empty.items():
            block_window(buffers[name], stage.blocks, block).fill(value)


def empty_values(stage: Stage) -> dict[str, float]:
    """What every buffer holds where nothing is seen."""
    return {name: value for name, (_, value) in exr_channels(stage.job.output.channels).items()}


def has_background(stage: Stage) -> bool:
    """Whether pixels that do not see the scene have a colour."""
    return "rgba" in stage.job.output.channels and bool(stage.scene.background.any())


def mends_itself(stage: Stage) -> bool:
    """Whether drawing a batch may empty what it does not fill, which is less to write.

    Not with a background, which lies under everything, nor with several samples a pixel, which see more.
    """
    return not has_background(stage) and stage.job.render.samples == 1


def lay_background(stage: Stage, blocks: IntArray, buffers: Buffers) -> None:
    """Give the pixels of these blocks that their facets own the background's colour, if there is one."""
    if not has_background(stage):
        return
    for block in blocks.tolist():
        owner = block_window(stage.owners, stage.blocks, block)
        facet = int(stage.blocks.facet[block]) + 1
        mine = (owner == facet) | (owner == -facet)
        for name, value in zip("RGB", stage.scene.background, strict=True):
            pixels = block_window(buffers[name], stage.blocks, block)
            np.copyto(pixels, value, where=mine, casting="same_kind")


def draw_batch(
    stage: Stage, frame: Frame, batch: tuple[int, int], buffers: Buffers, stale: BoolArray
) -> Drawn:
    """Draw one batch into the buffers; its pixels belong to no other batch.

    Args:
        stage: what the job's frames share.
        frame: the frame.
        batch: the range of blocks.
        buffers: written to.
        stale: (m,) microtiles of these blocks that still hold another frame and have to be emptied where
            nothing is seen.
    """
    frame = ordered(stage, frame)
    block = np.arange(*batch)
    lay_background(stage, block[frame.rays.lit[stage.blocks.facet[block]]], buffers)
    channels = stage.job.output.channels
    samples = stage.job.render.samples
    if samples > 1:
        draw_samples(stage, frame, batch, buffers, samples)
        channels = tuple(name for name in channels if name != "rgba")
    wanted = wanted_for(channels, stage.scene)
    if frame.order is not None:
        wanted = replace(wanted, position=True)
    visible, first = 0, stage.blocks.tiles(batch).start
    drawing = draw(frame, batch)
    if stale.any():
        empty_missed(stage, drawing, np.flatnonzero(stale) + first, buffers)
    shader = NodeShader(stage.scene, frame.viewer.eye) if "rgba" in channels else None
    for hits in drawing.hits(wanted, shader):
        fill(buffers, channels, stage.scene, frame.viewer, hits)
        if frame.order is not None:
            fill_stored(buffers, frame.order, hits)
        visible += hits.inside
    tiles = np.full(stale.size, not mends_itself(stage))
    tiles[drawing.drawn() - first] = True
    drawing.done()
    return Drawn(visible, tiles)


def empty_missed(stage: Stage, drawing: Drawing, tiles: IntArray, buffers: Buffers) -> None:
    """Empty the pixels of these microtiles at which the drawing shows nothing."""
    empty = {name: np.full(1, value, buffers[name].dtype) for name, value in empty_values(stage).items()}
    for places in drawing.missed(tiles):
        for name, value in empty.items():
            places.put(buffers[name], value)


def ordered(stage: Stage, frame: Frame) -> Frame:
    """The frame with the depth buffer the job asks for; as it is where depth is exact."""
    how = stage.job.render
    if how.method == "homography" and how.depth_bits is None:
        return frame
    return replace(
        frame, order=depth_order(how.method, how.depth_bits, frame.viewer, stage.facets, frame.rays)
    )


def fill_stored(buffers: Buffers, order: DepthOrder, hits: Hits) -> None:
    """Write into `zv` what the depth buffer holds, and into `Z` the depth that it is taken for."""
    wanted = [name for name in ("zv", "Z") if name in buffers]
    if wanted:
        assert hits.position is not None
        stored = dict(zip(("zv", "Z"), order.stored(hits.facet, hits.position), strict=True))
        for name in wanted:
            hits.put(buffers[name], stored[name])


def draw_samples(stage: Stage, frame: Frame, batch: tuple[int, int], buffers: Buffers, samples: int) -> None:
    """Average the colour of several samples a pixel; what misses the scene counts as background."""
    found = []
    scene, eye = stage.scene, frame.viewer.eye
    for sample in sample_places(samples):
        for hits in rasterize(frame, batch, sample, shading_wants(scene), NodeShader(scene, eye)):
            rgba = np.ones((4, hits.depth.size), dtype=np.float32)
            colors = pixel_colors(scene, eye, hits)
            for color, mine in zip(colors * (3 // len(colors)), rgba, strict=False):
                np.minimum(color, MOST_HALF, out=mine.reshape(hits.depth.shape))
            found.append((hits.pixel, np.stack([hits.drawn(c.reshape(hits.depth.shape)) for c in rgba])))
    if not found or "rgba" not in stage.job.output.channels:
        return
    pixel = np.concatenate([p for p, _ in found])
    order = np.argsort(pixel, kind="stable")
    pixel = pixel[order]
    first = np.flatnonzero(np.diff(pixel, prepend=-1))
    sums = np.add.reduceat(np.concatenate([v for _, v in found], axis=1)[:, order], first, axis=1)
    sums[:3] += (samples - sums[3]) * stage.scene.background[:, None]
    for name, values in zip("RGBA", sums / np.float32(samples), strict=True):
        buffers[name][pixel[first]] = np.minimum(values, MOST_HALF).astype(np.float16)


def sample_places(samples: int) -> list[tuple[float, float]]:
    """Places of the samples in a pixel, from its centre: Hammersley points, the same in every pixel."""
    places = []
    for i in range(samples):
        reverse, step, rest = 0.0, 0.5, i
        while rest:
            reverse += step * (rest & 1)
            step, rest = step / 2, rest >> 1
        places.append(((i + 0.5) / samples - 0.5, reverse + 0.5 / samples - 0.5))
    return places


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
