"""Seams: depth must run on across every edge that two lit facets share.

From points of such an edge the nearest pixel of either facet is looked up. Where the five rays of both
name the same triangle, each pixel's depth is carried to the edge along that triangle's plane; the two
must meet there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from quiltcli.analysis.verify.pixels import Sighting, Trial, sight
from quiltcli.analysis.verify.tally import MOST_FAULTS, Fault
from quiltcli.analysis.verify.tolerances import depth_tolerance
from quiltcli.display import SharedEdges
from quiltcli.geometry import BoolArray, FloatArray, IntArray, dot, normalized, offsets, segments
from quiltcli.visibility.rays.embree import Target, measure_along

_ACROSS = 0.05  # depth gained along a unit ray

COUNTS: Mapping[str, str] = {
    "edges": "seams between lit facets",
    "edges_compared": "seams compared",
    "points": "points on seams",
    "points_compared": "points compared",
    "seam": "seam jumps",
}


@dataclass(frozen=True)
class Seams:
    """How depth runs across seams.

    Attributes:
        counts: by the keys of `COUNTS`.
        most: the greatest jump, metres.
        most_share: the greatest jump as a share of its tolerance.
        faults: the first of the jumps beyond tolerance.
    """

    counts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(COUNTS, 0))
    most: float = 0.0
    most_share: float = 0.0
    faults: tuple[Fault, ...] = ()

    @property
    def failures(self) -> int:
        """Number of jumps beyond tolerance."""
        return self.counts["seam"]

    def as_json(self) -> dict[str, Any]:
        """The seams for programs."""
        return {**self.counts, "jump": {"max": self.most, "max_share_of_tolerance": self.most_share}}


@dataclass(frozen=True)
class SeamPoints:
    """N points on seams, and the pixel of either facet that is nearest to each.

    Attributes:
        edges: number of seams between lit facets.
        edge: (N,) which of them.
        direction: (N, 3) point minus eye, metres.
        pixel: (2, N) flat quilt addresses, −1 where the facet has no pixel by the point.
    """

    edges: int
    edge: IntArray
    direction: FloatArray
    pixel: IntArray


def seam_points(trial: Trial, edges: SharedEdges, most: int) -> SeamPoints:
    """Points on the seams of lit facets, a pixel apart or `most` a seam."""
    lit = trial.rays.lit
    if trial.rays.views:
        lit = lit & np.array([view is None for view in trial.rays.views])
    both = np.flatnonzero(lit[edges.facet_a] & lit[edges.facet_b])
    start, end = edges.start[both] - trial.rays.eye, edges.end[both] - trial.rays.eye
    facets = np.stack((edges.facet_a[both], edges.facet_b[both]))
    ends = np.stack([_on_page(trial, facets[0], at) for at in (start, end)])
    with np.errstate(invalid="ignore"):
        length = np.hypot(*(ends[1] - ends[0]).T)
    counts = np.clip(np.ceil(np.nan_to_num(length)), 1, most).astype(np.int64)
    edge, rank = segments(offsets(counts))
    share = ((rank + 0.5) / counts[edge])[:, None]
    direction = start[edge] + share * (end - start)[edge]
    pixel = np.stack([_nearest_pixel(trial, side[edge].astype(np.int64), direction) for side in facets])
    return SeamPoints(both.size, edge, direction, pixel)


def _on_page(trial: Trial, facet: IntArray, point: FloatArray) -> FloatArray:
    """Page pixels (N, 2) of points (N, 3) minus eye on their facets' planes."""
    matrix = trial.rays.quilt_from_eye[facet]
    x, y, w = (dot(matrix[:, k], point) for k in range(3))
    return np.stack((x, y), axis=1) / w[:, None]


def _nearest_pixel(trial: Trial, facet: IntArray, point: FloatArray) -> IntArray:
    """Address (N,) of the pixel inside each facet whose centre is nearest, within 3 × 3; −1 for none."""
    at = _on_page(trial, facet, point)
    base = np.floor(at).astype(np.int64)
    page = trial.layout.page[facet]
    size = trial.layout.pages[page].astype(np.int64)
    best, least = np.full(facet.size, -1), np.full(facet.size, np.inf)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            x, y = base[:, 0] + dx, base[:, 1] + dy
            on_page = (x >= 0) & (y >= 0) & (x < size[:, 0]) & (y < size[:, 1])
            address = np.where(on_page, trial.layout.page_offset[page] + y * size[:, 0] + x, 0)
            distance = np.hypot(x + 0.5 - at[:, 0], y + 0.5 - at[:, 1])
            nearer = on_page & (trial.owners[address] == facet + 1) & (distance < least)
            best, least = np.where(nearer, address, best), np.where(nearer, distance, least)
    return best


def check_seams(trial: Trial, points: SeamPoints) -> Seams:
    """Carry depths from both sides of each point to it, and compare."""
    rows = np.flatnonzero((points.pixel >= 0).all(axis=0))
    # Points share pixels: rays are cast once for each.
    address, back = np.unique(points.pixel[:, rows], return_inverse=True)
    back = back.reshape(2, -1)
    seen = sight(trial, address)
    triangle = seen.named[0]
    # A pixel that shows another triangle than its rays is a fault of its own.
    usable = seen.agree & seen.covered & (seen.fits[0] if seen.known else True)
    good = usable[back].all(axis=0) & (triangle[back[0]] == triangle[back[1]])
    rows, back = rows[good], back[:, good]
    direction = normalized(points.direction[rows])
    a, b = (_carried(trial.target, seen, side, direction) for side in back)
    met: BoolArray = np.isfinite(a) & np.isfinite(b)
    rows, back, a, b = rows[met], back[:, met], a[met], b[met]
    jump, tolerance = np.abs(a - b), depth_tolerance(np.maximum(np.abs(a), np.abs(b)))
    over = np.flatnonzero(jump > tolerance)
    counts = {
        "edges": points.edges,
        "edges_compared": np.unique(points.edge[rows]).size,
        "points": points.edge.size,
        "points_compared": rows.size,
        "seam": over.size,
    }
    share = float((jump / tolerance).max(initial=0.0))
    faults = tuple(_fault(seen, back[:, k], a[k], b[k]) for k in over[:MOST_FAULTS])
    return Seams(counts, float(jump.max(initial=0.0)), share, faults)


def _carried(target: Target, seen: Sighting, rows: IntArray, direction: FloatArray) -> FloatArray:
    """Depth (N,) at rays `direction` of the planes through what the pixels in `rows` show, NaN for none.

    The plane has the slope of the triangle that is seen; where it lies is what the pixel says.
    """
    ray = normalized(
        seen.pixels.ray[rows, :, 0] * (seen.pixels.x[rows] + 0.5)[:, None]
        + seen.pixels.ray[rows, :, 1] * (seen.pixels.y[rows] + 0.5)[:, None]
        + seen.pixels.ray[rows, :, 2]
    )
    normal = target.plane[seen.named[0, rows], :3]
    # A ray across the look direction says next to nothing of where along it a point of some depth lies.
    gain, along = measure_along(target.viewer, ray), measure_along(target.viewer, direction)
    tells = (np.abs(gain) > _ACROSS) & (np.abs(along) > _ACROSS)
    shown = ray * (seen.z[rows] / np.where(tells, gain, 1.0))[:, None]
    slope = dot(normal, direction)
    distance = np.divide(dot(normal, shown), slope, out=np.full(slope.shape, np.nan), where=slope != 0)
    return np.where(tells & (distance > 0), distance * along, np.nan)


def _fault(seen: Sighting, rows: IntArray, a: float, b: float) -> Fault:
    """A jump, told at the pixel of the first facet."""
    at, k = seen.pixels, int(rows[0])
    triangle = int(seen.named[0, k]) + 1
    place = int(at.page[k]) + 1, int(at.x[k]), int(at.y[k]), int(at.facet[k]) + 1
    return Fault("seam", *place, triangle, triangle, float(b), float(a))
