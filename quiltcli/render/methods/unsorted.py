"""Drawing without sorting triangles to facets: from an octree's leaves, or all of them on every facet.

What Harish & Narayanan time their method against (§4.2, figure 18). The pixels are those of `homography`,
byte by byte: only what is drawn in vain differs, and with it the time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from quiltcli.geometry import BoolArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.buffers import Buffers
from quiltcli.render.crew import Threads
from quiltcli.render.frame import draw_frame
from quiltcli.render.report import FrameRecord
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.cones import lit_cones
from quiltcli.visibility.shares import Binned
from quiltcli.visibility.unsorted import Sending, bin_unsorted, by_octree, to_all


def draw_by_octree(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame from an octree that is built for it; for the arguments see `frame.draw_frame`."""
    return _draw(stage, viewer, buffers, threads, only, by_octree)


def draw_independently(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int = 1, only: BoolArray | None = None
) -> FrameRecord:
    """Draw a frame with all triangles on every facet; for the arguments see `frame.draw_frame`."""
    return _draw(stage, viewer, buffers, threads, only, to_all)


@dataclass
class _Unsorting(Threads):
    """A crew that sends triangles to facets in another way."""

    send: Sending = to_all

    def bin(self, viewer: Viewer, rays: QuiltRays) -> Binned:
        """Bin the scene, in one thread."""
        stage, how = self.stage, self.stage.job.render
        return bin_unsorted(
            stage.scene,
            viewer,
            rays,
            stage.blocks,
            lit_cones(stage.parts, rays.lit, viewer.eye),
            self.send,
            single=stage.scene.one_sided if how.double_sided == "file" else None,
            culling=how.backface_culling,
            reach=0.5 if how.samples > 1 else 0.0,
        )


def _draw(
    stage: Stage, viewer: Viewer, buffers: Buffers, threads: int, only: BoolArray | None, send: Sending
) -> FrameRecord:
    render = stage.job.render.model_copy(update={"method": "homography"})
    exact = replace(stage, job=stage.job.model_copy(update={"render": render}))
    return draw_frame(exact, viewer, buffers, threads, only, crew=_Unsorting(exact, threads, send=send))
