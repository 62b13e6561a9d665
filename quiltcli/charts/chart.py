"""The chart of a curved facet: where in the world, or in which direction, each of its pixels is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.charts.omni import Omnistereo
from quiltcli.charts.shapes import Shape
from quiltcli.geometry import BoolArray, FloatArray

EDGE_ON = 1e-9
"""Metres above a pixel's plane from which an eye sees it."""


@dataclass(frozen=True, eq=False)
class Chart:
    """A curved facet's pixels.

    Attributes:
        shape: points in the world, or directions where the chart is a projection's.
        size: width and height of the raster, pixels.
        side: 1 where the surface is lit on the side from which s runs right and t down, −1 on the other.
        follows: empty for a surface, which stands in the world; what a projection goes along with,
            `position` or `view`.
        mask: (H, W) pixels that there are; None for all.
        wraps: whether the left and the right edge are the same line of the world.
        cuts: columns, and rows, at which the shape is broken.
        omni: eyes beside the head, for a projection in which each direction has its own; None for one eye.
        adds: whether its light adds to what other facets show at the same place, as a projector's does.
        record: the surface or the projection in words, JSON, for images and hashes.
    """

    shape: Shape
    size: tuple[int, int]
    side: int = 1
    follows: str = ""
    mask: BoolArray | None = None
    wraps: bool = False
    cuts: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())
    omni: Omnistereo | None = None
    adds: bool = False
    record: str = ""

    @property
    def stands(self) -> bool:
        """Whether it is a surface in the world, not a projection around the eye."""
        return not self.follows

    def scaled(self, size: tuple[int, int]) -> Chart:
        """The same surface or projection with another number of pixels."""
        mask = self.mask
        if mask is not None:
            y, x = (
                np.minimum((np.arange(new) + 0.5) * old // new, old - 1).astype(int)
                for new, old in zip(size[::-1], mask.shape, strict=True)
            )
            mask = mask[np.ix_(y, x)]
        ratio = size[0] / self.size[0], size[1] / self.size[1]
        columns, rows = (
            tuple(round(cut * r) for cut in cuts) for cuts, r in zip(self.cuts, ratio, strict=True)
        )
        return replace(self, size=size, mask=mask, cuts=(columns, rows))

    def points(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Points or directions (3, ...) of continuous facet pixels that broadcast.

        Across the edges of a surface that closes there, pixels of the other edge go on.
        """
        s, t = self._places(x, y)
        return self.shape.at(s, t)

    def normals(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Unit normals (3, ...) on the lit side; 0 where there is none, as at poles."""
        found = self.shape.normal(*self._places(x, y))
        length = np.sqrt(found[0] ** 2 + found[1] ** 2 + found[2] ** 2)
        return np.asarray(found * np.divide(self.side, length, out=np.zeros_like(length), where=length > 0))

    def _places(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        s = np.asarray(x, dtype=np.float64) / self.size[0]
        t = np.asarray(y, dtype=np.float64) / self.size[1]
        # A seam is no edge: what lies beyond is the other end, to the last bit.
        return (s - np.floor(s) if self.wraps else s), t

    def towards(self, x: FloatArray, y: FloatArray, points: FloatArray, eye: FloatArray) -> FloatArray:
        """How far (...) the eye is above the planes of pixels whose points (3, ...) these are, metres."""
        n = self.normals(x, y)
        return np.asarray(
            n[0] * (eye[0] - points[0]) + n[1] * (eye[1] - points[1]) + n[2] * (eye[2] - points[2])
        )

    def lit(self, x: FloatArray, y: FloatArray, points: FloatArray, eye: FloatArray) -> BoolArray:
        """Which pixels (...) show an image to an eye (3,): on their lit side, more than edge-on."""
        known = np.isfinite(points[0] + points[1] + points[2])
        if not self.stands:
            return np.asarray(known)
        return np.asarray(known & (self.towards(x, y, points, eye) > EDGE_ON))
