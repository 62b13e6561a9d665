"""One frame of the quilt: from a pose of the viewer to the pixels of all pages.

`draw_frame` is all that happens a frame, in the order of the paper's pipeline: the homographies of the
facets, triangles sorted to facets, then, batch by batch, triangles warped, rasterized and shaded. Who
does the work is told in `crew` and `workers`, what a batch is in `batch`, what lies in buffers in `buffers`.
"""

from __future__ import annotations

import numpy as np

from quiltcli.display import lit_facets
from quiltcli.errors import ViewerError
from quiltcli.geometry import BoolArray
from quiltcli.render.buffers import Buffers, empty_before, note_drawn, written_blocks
from quiltcli.render.crew import Crew, Threads
from quiltcli.render.notices import frame_warnings
from quiltcli.render.report import Clock, FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, batches


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
    clock, crew = Clock(), crew or Threads(stage, threads)
    lit = lit_facets(stage.facets, viewer.eye)
    if only is not None:
        lit &= only
    with clock.stage("bin"):
        crew.begin(stage)
        rays = stage.rays(lit, viewer)
        if rays.patched is not None and rays.patched.near:
            raise TooNearError(f"frame {viewer.frame}: the eye is too near to a curved facet")
        binned = crew.bin(viewer, rays)
    frame = Frame(viewer, binned.sight, rays, stage.blocks, binned.pairs, patches=stage.patches)
    with clock.stage("clear"):
        stale = empty_before(stage, frame, buffers, only, dirty, crew.clear)
    with clock.stage("rasterize and shade"):
        work = batches(frame, written_blocks(stage, frame), crew.workers)
        drawn = crew.draw(frame, work, buffers, stale)
        visible = sum(batch.visible for batch in drawn)
        if dirty is not None:
            note_drawn(stage, zip(work, (batch.tiles for batch in drawn), strict=True), only, dirty)
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
