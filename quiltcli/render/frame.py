"""One frame of the quilt: from a pose of the viewer to the pixels of all pages.

`draw_frame` is all that happens a frame, in the order of the paper's pipeline: the homographies of the
facets, triangles sorted to facets, then, batch by batch, triangles warped, rasterized and shaded. Who
does the work is told in `crew` and `workers`, what a batch is in `batch`, what lies in buffers in `buffers`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from quiltcli.display import lit_facets
from quiltcli.errors import ViewerError
from quiltcli.geometry import BoolArray
from quiltcli.render.buffers import Buffers, empty_before, note_drawn, written_blocks
from quiltcli.render.crew import Crew, Places, Threads
from quiltcli.render.notices import frame_warnings
from quiltcli.render.report import Clock, FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, batches
from quiltcli.visibility.shares import Binned


@dataclass(frozen=True)
class Exposure:
    """One of the times at which an open shutter looks.

    Attributes:
        stage: with the scene of that time.
        viewer: where they are then.
        places: of the samples that look then, in a pixel, from its centre.
    """

    stage: Stage
    viewer: Viewer
    places: Places


class TooNearError(ViewerError):
    """The eye is so near to a curved facet that no plane lies across all rays of a patch."""


def draw_frame(
    stage: Stage,
    viewer: Viewer,
    buffers: Buffers,
    threads: int = 1,
    only: BoolArray | None = None,
    *,
    dirty: BoolArray | None = None,
    crew: Crew | None = None,
    exposures: Iterable[Exposure] | None = None,
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
        exposures: what is made of samples is made of these, one after another, and not now; None for now.

    Returns:
        The frame's record.
    """
    clock, crew = Clock(), crew or Threads(stage, threads)
    with clock.stage("bin"):
        lit, binned, frame = _binned(stage, viewer, only, crew)
    rays = frame.rays
    with clock.stage("clear"):
        stale = empty_before(stage, frame, buffers, only, dirty, crew.clear)
    with clock.stage("rasterize and shade"):
        work = batches(frame, written_blocks(stage, frame), crew.workers)
        drawn = crew.draw(frame, work, buffers, stale, exposed=exposures is not None)
        visible = sum(batch.visible for batch in drawn)
        if dirty is not None:
            note_drawn(stage, zip(work, (batch.tiles for batch in drawn), strict=True), only, dirty)
    if exposures is not None:
        with clock.stage("expose"):
            written = _expose(exposures, buffers, only, crew)
        if dirty is not None:
            dirty |= written.repeat(np.diff(stage.blocks.tile_start))
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


def _binned(
    stage: Stage, viewer: Viewer, only: BoolArray | None, crew: Crew
) -> tuple[BoolArray, Binned, Frame]:
    """The facets (F,) that are lit, the triangles sorted to them, and the frame."""
    lit = lit_facets(stage.facets, viewer.eye)
    if only is not None:
        lit &= only
    crew.begin(stage)
    rays = stage.rays(lit, viewer)
    if rays.patched is not None and rays.patched.near:
        raise TooNearError(f"frame {viewer.frame}: the eye is too near to a curved facet")
    binned = crew.bin(viewer, rays)
    frame = Frame(viewer, binned.sight, rays, stage.blocks, binned.pairs, patches=stage.patches)
    return lit, binned, frame


def _expose(exposures: Iterable[Exposure], buffers: Buffers, only: BoolArray | None, crew: Crew) -> BoolArray:
    """Draw what is seen while the shutter is open; the blocks (B,) that show something then."""
    written: BoolArray = np.zeros(1, dtype=np.bool_)
    for one in exposures:
        _, binned, frame = _binned(one.stage, one.viewer, only, crew)
        crew.expose(frame, batches(frame, workers=crew.workers), one.places)
        written = written | (binned.pairs.per_block > 0)
    crew.develop(buffers)
    return written
