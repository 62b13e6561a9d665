"""Rays through the pixels of curved facets: what one eye sees of a chart, in pixels of its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.meet import meet
from quiltcli.charts.shapes import turned
from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.layout import Layout

NEAR = 0.05
"""Pixels from a pixel's centre to the places of which differences tell how its rays change."""


@dataclass(frozen=True, eq=False)
class ChartView:
    """A chart as one eye sees it, at its place in the quilt.

    Attributes:
        chart: the chart.
        eye: (3,) world metres.
        turn: (3, 3) world from the viewer's own axes, for a projection; None where it is not turned.
        facet_from_quilt: (2, 3) page pixels to facet pixels.
        page: quilt address of its page's first pixel, and the page's width.
        head: (3,) place of the head minus the eye, where each pixel's eye is somewhere beside it; else None.
        half: half the distance between such eyes, metres; negative for left ones.
    """

    chart: Chart
    eye: FloatArray
    turn: FloatArray | None
    facet_from_quilt: FloatArray
    page: tuple[int, int] = (0, 1)
    head: FloatArray | None = None
    half: float = 0.0

    def facet_pixels(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Facet pixels of page pixels that broadcast; what broadcasts stays small where it can."""
        (a, b, c), (d, e, f) = self.facet_from_quilt
        i = a * x + c if b == 0 else b * y + c if a == 0 else a * x + b * y + c
        j = e * y + f if d == 0 else d * x + f if e == 0 else d * x + e * y + f
        return np.asarray(i), np.asarray(j)

    def rays(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Rays (3, ...) from the eye through page pixels that broadcast, NaN where there are none."""
        points = self.chart.points(*self.facet_pixels(x, y))
        if not self.chart.stands:
            return points if self.turn is None else turned(self.turn, points)
        return points - self.eye.reshape(3, *[1] * (points.ndim - 1))

    def moved(self, address: IntArray, rays: FloatArray) -> FloatArray:
        """How far right and down (2, P), in page pixels, rays go through beside some pixels' centres.

        Args:
            address: (P,) quilt addresses of the pixels.
            rays: (3, P) from the eye, of any length.

        Returns:
            0 where a ray meets the chart nowhere near.
        """
        y, x = np.divmod(address - self.page[0], self.page[1])
        place = np.stack(self.facet_pixels(x + 0.5, y + 0.5))
        origin = self.eye
        if not self.chart.stands:
            origin = np.zeros(3)
            rays = rays if self.turn is None else turned(self.turn.T, rays)
        across, down = meet(self.chart, origin, rays, place) - place
        (a, b, _), (c, d, _) = self.facet_from_quilt
        return np.asarray(np.stack((d * across - b * down, a * down - c * across)) / (a * d - b * c))

    def origins(self, x: FloatArray, y: FloatArray) -> FloatArray | None:
        """Where rays of page pixels begin (3, ...), minus the eye; None where all begin there."""
        if self.head is None or self.chart.omni is None:
            return None
        beside = self.chart.omni.beside(self.chart.points(*self.facet_pixels(x, y)))
        if self.turn is not None:
            beside = turned(self.turn, beside)
        return self.head.reshape(3, *[1] * (beside.ndim - 1)) + self.half * beside

    def lit(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Which page pixels (...), given by their centres, show an image to the eye."""
        i, j = self.facet_pixels(x, y)
        return self.chart.lit(i, j, self.chart.points(i, j), self.eye)

    def matrices(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Matrices (P, 3, 3) from page pixels (x, y, 1) to rays, each right at its own pixel centre (P,).

        Beside the centre they go on straight, as fast as rays change there.
        """
        middle = self.rays(x, y)
        du = (self.rays(x + NEAR, y) - self.rays(x - NEAR, y)) / (2 * NEAR)
        dv = (self.rays(x, y + NEAR) - self.rays(x, y - NEAR)) / (2 * NEAR)
        # Where a neighbour has no ray, as at the rim of a fisheye, all are taken for the one in the middle.
        du, dv = (np.where(np.isfinite(step), step, 0.0) for step in (du, dv))
        return np.stack((du, dv, middle - du * x - dv * y), axis=-1).transpose(1, 0, 2)


Charts = Sequence[Chart | None]


def chart_views(
    charts: Charts,
    layout: Layout,
    eye: FloatArray,
    camera_from_world: FloatArray,
    head: FloatArray | None = None,
) -> tuple[ChartView | None, ...]:
    """What an eye sees of every curved facet; None for flat ones.

    Args:
        charts: of F facets; empty where all are flat.
        layout: the facets' places, one row a facet.
        eye: (3,) world metres.
        camera_from_world: (3, 3) rows right, up, and back of whoever looks.
        head: (3,) between their eyes, where they have two; world metres.
    """
    beside = 0.0 if head is None else float((eye - head) @ camera_from_world[0])
    views: list[ChartView | None] = []
    for row, chart in enumerate(charts):
        if chart is None:
            views.append(None)
            continue
        turn = camera_from_world.T if chart.follows == "view" else None
        page = max(int(layout.page[row]), 0)
        where = int(layout.page_offset[page]), int(layout.pages[page, 0])
        view = ChartView(chart, eye, turn, inverse_affine(layout.quilt_from_facet[row]), where)
        if chart.omni is not None and head is not None:
            view = replace(view, head=head - eye, half=beside)
        views.append(view)
    return tuple(views)


def inverse_affine(matrix: FloatArray) -> FloatArray:
    """The inverse (2, 3) of an affine map of the plane (2, 3), exact for whole-pixel moves."""
    (a, b, c), (d, e, f) = matrix.tolist()
    det = a * e - b * d
    p, q, r, s = e / det, -b / det, -d / det, a / det
    return np.array([[p, q, -(p * c + q * f)], [r, s, -(r * c + s * f)]]) + 0.0
