"""A gaze: whoever looks, and their rays through the quilt, in a frame and a frame later."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.projection.curved import ChartView
from quiltcli.projection.planar import QuiltRays, inverse_3x3
from quiltcli.viewer.viewer import Viewer


@dataclass(frozen=True)
class Gaze:
    """A viewer, and their rays.

    Attributes:
        viewer: the viewer.
        rays: rays from their eye through the quilt; None where every pixel has an eye of its own.
    """

    viewer: Viewer
    rays: QuiltRays | None

    @cached_property
    def later(self) -> QuiltRays:
        """Their rays a frame later, through the facets that are lit now."""
        assert self.rays is not None
        return self.rays if self.viewer.then is None else seen_from(self.rays, self.viewer.then)

    @property
    def turns(self) -> bool:
        """Whether their head is turned otherwise a frame later."""
        then = self.viewer.then_turn
        return then is not None and not np.array_equal(then, self.viewer.camera_from_world)

    @cached_property
    def later_views(self) -> tuple[ChartView | None, ...]:
        """What they see of curved facets a frame later; None for flat ones, empty where all are."""
        assert self.rays is not None
        eye = self.rays.eye if self.viewer.then is None else self.viewer.then
        turn = self.viewer.then_turn
        return tuple(
            None
            if view is None
            else replace(view, eye=eye, turn=view.turn if view.turn is None or turn is None else turn.T)
            for view in self.rays.views
        )


def seen_from(rays: QuiltRays, eye: FloatArray) -> QuiltRays:
    """Rays of another eye (3,) through the same facets: only where they begin has changed.

    A facet that is edge-on for it is seen nowhere: its `quilt_from_eye` is 0.
    """
    matrix = rays.eye_from_quilt.copy()
    matrix[:, :, 2] += rays.eye - eye
    inverse = np.zeros_like(matrix)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse[rays.lit] = inverse_3x3(matrix[rays.lit])
    inverse[~np.isfinite(inverse).all(axis=(1, 2))] = 0.0
    return QuiltRays(eye, rays.lit, matrix, inverse)
