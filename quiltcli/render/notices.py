"""What a user should know of a render: once before it begins, and of frames that show little or nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.display import Facets, pitch_mm
from quiltcli.geometry import BoolArray, dot
from quiltcli.render.setup import Stage
from quiltcli.viewer.viewer import Viewer


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


def stage_warnings(stage: Stage) -> Iterator[str]:
    """What is worth a second look before rendering starts."""
    least, greatest = pitch_mm(stage.facets)
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
