"""Where quilt pixels are, and the rays through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, OwnerArray, normalized
from quiltcli.layout import Layout
from quiltcli.projection.curved import ChartView
from quiltcli.projection.planar import QuiltRays

NEIGHBOUR = 0.05
"""Pixels from a pixel's centre to the four rays that surround it."""

OFFSETS = ((0.0, 0.0), (NEIGHBOUR, 0.0), (-NEIGHBOUR, 0.0), (0.0, NEIGHBOUR), (0.0, -NEIGHBOUR))
"""The five rays of a pixel, in pixels from its centre; the centre comes first."""


@dataclass(frozen=True)
class Places:
    """P quilt pixels.

    Attributes:
        address: (P,) flat quilt address.
        facet: (P,) index of the facet the pixel belongs to.
        bleed: (P,) whether it lies in that facet's bleed.
        page: (P,) 0-based page.
        x: (P,) column.
        y: (P,) row.
        ray: (P, 3, 3) page pixel (x, y, 1) → direction from the eye; on a curved facet each pixel's own.
        origin: (P, 3) where rays begin, minus the eye, metres; None where all begin there.
    """

    address: IntArray
    facet: IntArray
    bleed: BoolArray
    page: IntArray
    x: IntArray
    y: IntArray
    ray: FloatArray
    origin: FloatArray | None = None

    def from_eye(self, row: IntArray) -> FloatArray | None:
        """Where rays of some pixels begin (N, 3), minus the eye; None where all begin there."""
        return None if self.origin is None else self.origin[row]

    def take(self, rows: IntArray) -> Places:
        """Some of the pixels."""
        return Places(
            address=self.address[rows],
            facet=self.facet[rows],
            bleed=self.bleed[rows],
            page=self.page[rows],
            x=self.x[rows],
            y=self.y[rows],
            ray=self.ray[rows],
            origin=self.from_eye(rows),
        )

    def directions(self, dx: float = 0.0, dy: float = 0.0) -> FloatArray:
        """Unit directions (P, 3) through the pixels, `dx`, `dy` pixels beside their centres."""
        return normalized(self.rays(dx, dy))

    def rays(self, dx: float = 0.0, dy: float = 0.0) -> FloatArray:
        """The same of the length that `ray` gives them."""
        x, y = self.x + (0.5 + dx), self.y + (0.5 + dy)
        ray = self.ray
        return np.asarray(ray[:, :, 0] * x[:, None] + ray[:, :, 1] * y[:, None] + ray[:, :, 2])


def places(
    address: IntArray,
    layout: Layout,
    owners: OwnerArray,
    rays: QuiltRays,
    beside: FloatArray | None = None,
) -> Places:
    """The pixels at flat quilt addresses (P,), each of which a facet or its bleed owns.

    Args:
        address: the addresses.
        layout: the facets' places.
        owners: whose every quilt pixel is.
        rays: rays through the quilt.
        beside: (F, 2) where in each facet's pixels rays go through, from the centre; None for there.
    """
    owner = owners[address].astype(np.int64)
    facet = np.abs(owner) - 1
    page = layout.page[facet].astype(np.int64)
    width = layout.pages[page, 0].astype(np.int64)
    local = address - layout.page_offset[page]
    x, y = local % width, local // width
    ray = rays.eye_from_quilt[facet]
    origin: FloatArray | None = None
    off = None if beside is None else beside[facet]
    for row, view in enumerate(rays.views):
        if view is not None:
            mine = np.flatnonzero(facet == row)
            if mine.size:
                at_x, at_y = x[mine] + 0.5, y[mine] + 0.5
                if beside is not None:
                    at_x, at_y = _with_rays(view, at_x, at_y, beside[row])
                ray[mine] = view.matrices(at_x, at_y)
                begin = view.origins(at_x, at_y)
                if begin is not None:
                    origin = np.zeros((address.size, 3)) if origin is None else origin
                    origin[mine] = begin.T
    if off is not None:
        # Read at their centres, the matrices give the rays beside these.
        ray[:, :, 2] += ray[:, :, 0] * off[:, :1] + ray[:, :, 1] * off[:, 1:]
    return Places(address, facet, owner < 0, page, x, y, ray, origin)


def _with_rays(
    view: ChartView, x: FloatArray, y: FloatArray, beside: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Places (P,) beside pixels' centres, and the centres where there is no ray, as past a fisheye's rim."""
    there_x, there_y = x + beside[0], y + beside[1]
    known = np.isfinite(view.rays(there_x, there_y).sum(axis=0))
    return np.where(known, there_x, x), np.where(known, there_y, y)


def lit_pixels(address: IntArray, layout: Layout, owners: OwnerArray, rays: QuiltRays) -> BoolArray:
    """Which pixels (P,) at flat quilt addresses show an image to the eye: all but those on a chart's back."""
    result = np.ones(address.size, dtype=np.bool_)
    if not any(view is not None for view in rays.views):
        return result
    facet = np.abs(owners[address].astype(np.int64)) - 1
    for row, view in enumerate(rays.views):
        mine = np.flatnonzero(facet == row)
        if view is None or not mine.size:
            continue
        page = int(layout.page[row])
        y, x = np.divmod(address[mine] - layout.page_offset[page], int(layout.pages[page, 0]))
        result[mine] = view.lit(x + 0.5, y + 0.5)
    return result
