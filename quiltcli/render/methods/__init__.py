"""Render methods: ways to fill the same buffers, to compare with; a row of a table each.

The first four differ only in what their depth buffers hold (`orders`) and are drawn by the same
rasterizer; the others have a module each. All share scene, shading, channels and output.
"""

from __future__ import annotations

from collections.abc import Callable

from quiltcli.geometry import BoolArray
from quiltcli.render.buffers import Buffers
from quiltcli.render.frame import Crew
from quiltcli.render.frame import draw_frame as rasterize_frame
from quiltcli.render.methods.raycast import cast_frame
from quiltcli.render.methods.twopass import draw_twice
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer

__all__ = ["OTHERS", "draw_frame"]

OTHERS: dict[str, Callable[[Stage, Viewer, Buffers, int, BoolArray | None], FrameRecord]] = {
    "twopass": draw_twice,
    "raycast": cast_frame,
}
"""Methods that do not rasterize the quilt."""


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
    """Draw what the viewer sees on every lit facet, by the job's method; see `draw.draw_frame`."""
    other = OTHERS.get(stage.job.render.method)
    if other is not None:
        return other(stage, viewer, buffers, threads, only)
    return rasterize_frame(stage, viewer, buffers, threads, only, dirty=dirty, crew=crew)
