"""A line across a seam: what every method says of depth along it (the paper's figure 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import SharedEdges, shared_edges
from quiltcli.geometry import FloatArray, IntArray, cross, dot, normalized
from quiltcli.projection.planar import QuiltRays
from quiltcli.render.buffers import Buffers
from quiltcli.render.setup import Stage

SAMPLES = 96
_PLACES = (0.5, 0.35, 0.65, 0.2, 0.8)
_REACH = 0.35  # of the seam's length, to either side


@dataclass(frozen=True)
class Profile:
    """Points along a line that crosses a seam at a right angle.

    Attributes:
        facets: ids of the facets on either side.
        along: (N,) metres from the seam on the facets, negative on the first.
        pixel: (N,) flat quilt address under each point, −1 where the facet has no pixel there.
    """

    facets: tuple[int, int]
    along: FloatArray
    pixel: IntArray

    def depths(self, buffers: Buffers) -> FloatArray:
        """Z (N,) along the line, not a number where nothing shows."""
        z = buffers["Z"][np.maximum(self.pixel, 0)].astype(np.float64)
        return np.where((self.pixel >= 0) & np.isfinite(z), z, np.nan)


def best_profile(stage: Stage, rays: QuiltRays, truth: Buffers) -> Profile | None:
    """The line that stays longest on one object around its seam, None where no seam shows one."""
    edges = shared_edges(stage.facets)
    flat = rays.lit & ~stage.facets.curved
    best: tuple[int, Profile | None] = (0, None)
    for edge in np.flatnonzero(flat[edges.facet_a] & flat[edges.facet_b]).tolist():
        for place in _PLACES:
            line = _line(stage, rays, edges, edge, place)
            score = _run(stage, truth, line)
            if score > best[0]:
                best = score, line
    return best[1]


def _line(stage: Stage, rays: QuiltRays, edges: SharedEdges, edge: int, place: float) -> Profile:
    """The line through a place of a seam."""
    start, end = edges.start[edge], edges.end[edge]
    way = normalized((end - start)[None])[0]
    middle = start + place * (end - start)
    length = float(np.sqrt(dot(end - start, end - start)))
    step = (np.arange(SAMPLES) + 0.5) / SAMPLES * _REACH * length
    pixel = []
    for facet in (int(edges.facet_a[edge]), int(edges.facet_b[edge])):
        inward = cross(stage.facets.normal[facet], way)
        if dot(stage.facets.polygon(facet).mean(axis=0) - middle, inward) < 0:
            inward = -inward
        pixel.append(_pixels(stage, rays, facet, middle + step[:, None] * inward))
    return Profile(
        (int(edges.facet_a[edge]) + 1, int(edges.facet_b[edge]) + 1),
        np.concatenate((-step[::-1], step)),
        np.concatenate((pixel[0][::-1], pixel[1])),
    )


def _pixels(stage: Stage, rays: QuiltRays, facet: int, points: FloatArray) -> IntArray:
    """Addresses (N,) of the pixels of a facet under points (N, 3) of its plane, −1 outside it."""
    x, y, w = rays.quilt_from_eye[facet] @ (points - rays.eye).T
    page = int(stage.layout.page[facet])
    width, height = stage.layout.pages[page].tolist()
    column, row = np.floor(x / w).astype(np.int64), np.floor(y / w).astype(np.int64)
    on = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    address = np.where(on, stage.layout.page_offset[page] + row * width + column, 0)
    return np.where(on & (stage.owners[address] == facet + 1), address, -1)


def _run(stage: Stage, truth: Buffers, line: Profile) -> int:
    """Points of the line around its seam that show one object without a gap."""
    triangle = truth["triangle"][np.maximum(line.pixel, 0)].astype(np.int64) - 1
    shown = (line.pixel >= 0) & (triangle >= 0)
    thing = np.where(shown, stage.scene.object[np.maximum(triangle, 0)], -1)
    first, second = thing[SAMPLES - 1 :: -1], thing[SAMPLES:]
    if first[0] < 0 or first[0] != second[0]:
        return 0
    runs = [int(np.argmax(np.append(side != first[0], True))) for side in (first, second)]
    return min(runs) * 2
