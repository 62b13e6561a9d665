"""Render methods: ways to fill the same buffers, to compare with; a row of a table each.

The first four differ only in what their depth buffers hold (`orders`) and are drawn by the same
rasterizer; the others have a module each. All share scene, shading, channels and output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from quiltcli.display import eyes_apart
from quiltcli.geometry import BoolArray
from quiltcli.render.buffers import Buffers
from quiltcli.render.corrections import Headroom, correct, corrects
from quiltcli.render.crew import Crew
from quiltcli.render.frame import Exposure, TooNearError
from quiltcli.render.frame import draw_frame as rasterize_frame
from quiltcli.render.methods.cubemap import draw_cubemap
from quiltcli.render.methods.raycast import cast_frame
from quiltcli.render.methods.tessellate import draw_tessellated
from quiltcli.render.methods.twopass import draw_twice
from quiltcli.render.methods.unsorted import draw_by_octree, draw_independently
from quiltcli.render.moments import Moment
from quiltcli.render.report import Clock, FrameRecord, together
from quiltcli.render.setup import Stage
from quiltcli.viewer.view import View
from quiltcli.viewer.viewer import Viewer

__all__ = ["OTHERS", "draw_frame", "draw_moment", "draw_view"]

OTHERS: dict[str, Callable[[Stage, Viewer, Buffers, int, BoolArray | None], FrameRecord]] = {
    "twopass": draw_twice,
    "raycast": cast_frame,
    "cubemap": draw_cubemap,
    "tessellate": draw_tessellated,
    "octree": draw_by_octree,
    "independent": draw_independently,
}
"""Methods that do not rasterize the quilt, and those that do without sorting triangles to facets."""


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
    """Draw what the viewer sees on every lit facet, by the job's method; see `frame.draw_frame`."""
    other = OTHERS.get(stage.job.render.method)
    if other is None and eyes_apart(stage.facets):
        other = cast_frame
    if other is not None:
        return other(stage, viewer, buffers, threads, only)
    try:
        return rasterize_frame(
            stage, viewer, buffers, threads, only, dirty=dirty, crew=crew, exposures=exposures
        )
    except TooNearError:
        if exposures is not None:
            raise
        if dirty is not None:
            dirty[:] = True
        return cast_frame(stage, viewer, buffers, threads, only)


def draw_view(
    stage: Stage, view: View, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a view as it is at once, the shutter closed: what each of its viewers sees on their facets."""
    return draw_moment(Moment(stage, view), buffers, threads, only)


def draw_moment(
    moment: Moment,
    buffers: Buffers,
    threads: int = 1,
    only: BoolArray | None = None,
    *,
    dirty: BoolArray | None = None,
    crew: Crew | None = None,
) -> FrameRecord:
    """Draw what each viewer sees on facets of their own. Arguments as for `draw_frame`."""
    stage, view = moment.stage, moment.view
    records = []
    for number, (viewer, theirs) in enumerate(facets_by_viewer(view, stage.facets.count, only)):
        open_for = moment.exposures(number)
        records.append(
            draw_frame(stage, viewer, buffers, threads, theirs, dirty=dirty, crew=crew, exposures=open_for)
        )
    record = corrected(stage, view, buffers, together(records), threads, only, dirty)
    return replace(record, eye=view.eye, warnings=(*record.warnings, *moment.warnings))


def corrected(
    stage: Stage,
    view: View,
    buffers: Buffers,
    record: FrameRecord,
    threads: int,
    only: BoolArray | None,
    dirty: BoolArray | None = None,
) -> FrameRecord:
    """Correct what was drawn for the panels, if the job wants that; the record with what it took."""
    response = corrects(stage)
    if response is None:
        return record
    clock = Clock()
    with clock.stage("correct"):
        parts = [
            correct(stage, viewer, buffers, threads, theirs)
            for viewer, theirs in facets_by_viewer(view, stage.facets.count, only)
        ]
    headroom = sum(parts, Headroom())
    if response.lifts and dirty is not None:
        dirty[:] = True  # what was black is not any more
    return replace(
        record,
        seconds={**record.seconds, **clock.seconds},
        warnings=(*record.warnings, *headroom.words(response)),
        corrections=headroom.as_json(response),
    )


def facets_by_viewer(
    view: View, count: int, only: BoolArray | None
) -> Iterator[tuple[Viewer, BoolArray | None]]:
    """Each viewer of a view with the facets (F,) to be drawn for them, None for all."""
    for viewer in view.viewers:
        theirs = only
        if viewer.facets is not None:
            theirs = np.isin(np.arange(1, count + 1), viewer.facets)
            theirs &= True if only is None else only
        yield viewer, theirs
