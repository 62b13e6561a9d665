"""One frame of the quilt: from a pose of the viewer to the pixels of all pages.

`Stage` holds what the viewer cannot change and is set up once a job; `draw_frame` is all that happens
a frame, in the order of the paper's pipeline: bin, prewarp, rasterize, shade.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.binning import Pairs, Parts, bin_triangles, facet_parts
from quiltcli.channels import empty_buffers, exr_channels, fill, wanted_for
from quiltcli.display import Facets, lit_facets, load_display
from quiltcli.geometry import BoolArray, FloatArray, OwnerArray, dot
from quiltcli.homography import quilt_rays
from quiltcli.job import JobFile, PackSpec, load_display_file, load_scene_file
from quiltcli.layout import Layout, pixel_owners
from quiltcli.orders import DepthOrder, depth_order
from quiltcli.packing import layout_for
from quiltcli.raster import (
    Blocks,
    Frame,
    Hits,
    Sight,
    batches,
    block_window,
    cut_blocks,
    rasterize,
    split_pairs,
    triangles_in_range,
)
from quiltcli.report import FrameRecord
from quiltcli.scene import Scene, load_scene
from quiltcli.shading import MOST_HALF, shade, shading_wants
from quiltcli.viewer import Viewer

Buffers = dict[str, NDArray[Any]]
Runner: TypeAlias = Callable[[Frame, Sequence[tuple[int, int]], Buffers], int]
"""Draws batches of a frame into buffers; returns how many pixels of facets show the scene."""


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


def draw_frame(
    stage: Stage,
    viewer: Viewer,
    buffers: Buffers,
    threads: int = 1,
    only: BoolArray | None = None,
    *,
    dirty: BoolArray | None = None,
    run: Runner | None = None,
) -> FrameRecord:
    """Draw what the viewer sees on every lit facet.

    Args:
        stage: what the job's frames share.
        viewer: the viewer.
        buffers: from `new_buffers`; overwritten where facets are drawn, emptied elsewhere.
        threads: batches drawn at a time; the pixels do not depend on it.
        only: (F,) facets to draw; the pixels of all others are left as they are.
        dirty: (F,) facets whose pixels may hold something; all, where it is not known.
        run: draws the batches instead of threads.

    Returns:
        The frame's record.
    """
    clock = Clock()
    scene, job = stage.scene, stage.job
    lit = lit_facets(stage.facets, viewer.eye)
    if only is not None:
        lit &= only
    with clock.stage("bin"):
        rays = quilt_rays(stage.facets, stage.layout, lit, viewer.eye)
        vertices = scene.vertices - viewer.eye
        wanted, cut = triangles_in_range(vertices, scene.triangles, viewer)
        if job.render.backface_culling:
            wanted &= faces_eye(scene, viewer.eye)
        pairs = bin_triangles(vertices, scene.triangles, wanted, stage.parts, rays.lit, viewer.eye)
    with clock.stage("prewarp"):
        sight = Sight(vertices, scene.triangles, cut)
        block_pairs = split_pairs(pairs, sight, rays, stage.blocks)
        frame = Frame(viewer, sight, rays, stage.blocks, block_pairs, stage.owners)
    with clock.stage("clear"):
        clear(stage, buffers, only, dirty)
        lay_background(stage, rays.lit, buffers)
    with clock.stage("rasterize and shade"):
        visible = (run or in_threads(stage, threads))(frame, batches(frame), buffers)
    return FrameRecord(
        frame=viewer.frame,
        triangles=int(np.count_nonzero(wanted)),
        reaching=pairs.reaching,
        pairs=pairs.facet.size,
        settled=pairs.settled,
        lit_facets=int(np.count_nonzero(rays.lit)),
        visible_pixels=visible,
        fill=stage.fill,
        seconds=clock.seconds,
        warnings=tuple(frame_warnings(stage, viewer, lit, pairs, visible)),
    )


def faces_eye(scene: Scene, eye: FloatArray) -> BoolArray:
    """Triangles (T,) whose winding is counter-clockwise as seen from `eye` (3,)."""
    x, y, z, offset = scene.planes
    result: BoolArray = x * eye[0] + y * eye[1] + z * eye[2] > offset
    return result


def in_threads(stage: Stage, threads: int) -> Runner:
    """Draws batches in threads of this process."""

    def run(frame: Frame, work: Sequence[tuple[int, int]], buffers: Buffers) -> int:
        with ThreadPoolExecutor(threads) as pool:
            return sum(pool.map(lambda batch: draw_batch(stage, frame, batch, buffers), work))

    return run


def clear(stage: Stage, buffers: Buffers, only: BoolArray | None, dirty: BoolArray | None) -> None:
    """Empty the pixels of the facets in `only`, or of all that are `dirty`, or everything."""
    empty = {name: value for name, (_, value) in exr_channels(stage.job.output.channels).items()}
    if only is not None:
        mine = np.concatenate(([False], only))[np.abs(stage.owners)]
        for name, value in empty.items():
            buffers[name][mine] = value
    elif dirty is None:
        for name, value in empty.items():
            buffers[name].fill(value)
    else:
        for block in np.flatnonzero(dirty[stage.blocks.facet]).tolist():
            for name, value in empty.items():
                block_window(buffers[name], stage.blocks, block).fill(value)


def lay_background(stage: Stage, lit: BoolArray, buffers: Buffers) -> None:
    """Give the pixels of lit facets the background's colour."""
    color = stage.scene.background
    if "rgba" not in stage.job.output.channels or not color.any():
        return
    for block in np.flatnonzero(lit[stage.blocks.facet]).tolist():
        owner = block_window(stage.owners, stage.blocks, block)
        facet = int(stage.blocks.facet[block]) + 1
        mine = (owner == facet) | (owner == -facet)
        for name, value in zip("RGB", color, strict=True):
            pixels = block_window(buffers[name], stage.blocks, block)
            np.copyto(pixels, value, where=mine, casting="same_kind")


def draw_batch(stage: Stage, frame: Frame, batch: tuple[int, int], buffers: Buffers) -> int:
    """Draw one batch into the buffers; its pixels belong to no other batch.

    Returns:
        How many pixels of facets, bleed left out, show the scene.
    """
    frame = ordered(stage, frame)
    channels = stage.job.output.channels
    samples = stage.job.render.samples
    if samples > 1:
        draw_samples(stage, frame, batch, buffers, samples)
        channels = tuple(name for name in channels if name != "rgba")
    wanted = wanted_for(channels, stage.scene)
    if frame.order is not None:
        wanted = replace(wanted, position=True)
    visible = 0
    for hits in rasterize(frame, batch, wanted=wanted):
        fill(buffers, channels, stage.scene, frame.viewer, hits)
        if frame.order is not None:
            fill_stored(buffers, frame.order, hits)
        visible += hits.inside
    return visible


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
    for sample in sample_places(samples):
        for hits in rasterize(frame, batch, sample, shading_wants(stage.scene)):
            rgba = np.ones((4, hits.depth.size), dtype=np.float32)
            np.minimum(shade(stage.scene, frame.viewer.eye, hits).reshape(3, -1), MOST_HALF, out=rgba[:3])
            found.append((hits.pixel.ravel(), rgba))
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


def frame_warnings(stage: Stage, viewer: Viewer, lit: BoolArray, pairs: Pairs, visible: int) -> Iterator[str]:
    """What a user should know of a frame that shows little or nothing."""
    if not lit.any():
        yield "the eye is behind every facet: nothing is lit"
    elif not pairs.facet.size:
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
