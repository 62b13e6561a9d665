"""What a user should know of a render: once before it begins, and of frames that show little or nothing."""

from __future__ import annotations

from collections.abc import Iterator

from quiltcli.display import pitch_of
from quiltcli.geometry import BoolArray
from quiltcli.render.setup import Stage
from quiltcli.viewer.clip import behind_words
from quiltcli.viewer.view import viewers_of
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.rays.embree import has_embree


def frame_warnings(stage: Stage, viewer: Viewer, lit: BoolArray, pairs: int, visible: int) -> Iterator[str]:
    """What a user should know of a frame that shows little or nothing."""
    if not lit.any():
        yield "the eye is behind every facet: nothing is lit"
    elif not pairs:
        yield "no triangle of the scene shows on any facet"
    elif not visible:
        yield "no pixel shows the scene"
    if words := behind_words(stage.facets, [viewer]):
        yield words


def stage_warnings(stage: Stage) -> Iterator[str]:
    """What is worth a second look before rendering starts."""
    layout = stage.layout
    least, greatest = pitch_of(layout.du[layout.page >= 0], layout.dv[layout.page >= 0])
    if least < 0.1 or greatest > 100:
        yield (
            f"the pixel pitch is {least:.3g} to {greatest:.3g} mm, outside 0.1 to 100 mm:"
            " are the display's units and resolution right?"
        )
    if stage.job.render.bleed > stage.layout.padding:
        yield (
            f"the bleed of {stage.job.render.bleed} pixels is wider than the layout's padding of"
            f" {stage.layout.padding}: neighbours share what lies between them"
        )
    viewers = viewers_of(stage.job, stage.job.frames[:1])
    if stage.job.render.depth == "planar" and not all(viewer.aimed for viewer in viewers):
        yield (
            "the path does not say where the head looks, on which no picture for one eye depends; depth is"
            " measured along the line to the display's middle (render.depth: radial measures the distance)"
        )
    if not has_embree():
        yield "embreex is not installed: triangles are sorted to facets without it, which takes longer"
