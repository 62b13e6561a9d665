"""What is worth a second look in a display that is not wrong: its size, its pixels, its lit sides."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.charts.measure import pitch_ratio, seam_gap
from quiltcli.display.check import called
from quiltcli.display.facets import Facets, pitch_mm, shared_edges
from quiltcli.geometry import BoolArray, FloatArray, IntArray, dot, next_in_row, offsets, segments

_WIDEST = 200.0  # metres; the largest screens are half as wide
_MOST_PAIRS = 5
_CROWDED = 20.0  # times as dense as elsewhere


def display_notices(facets: Facets) -> Iterator[str]:
    """Sentences for the user, the gravest first."""
    if not facets.both_sides:
        pairs = disagreeing(facets)
        for a, b in pairs[:_MOST_PAIRS]:
            names = f"{called(a, facets.names)} and {called(b, facets.names).removeprefix('facet ')}"
            yield (
                f"{facets.path}: facets {names.removeprefix('facet ')} disagree on their lit side:"
                " seen from where one is lit the other shows its back (turn the winding of one over)"
            )
        if len(pairs) > _MOST_PAIRS:
            yield f"{facets.path}: {len(pairs) - _MOST_PAIRS} more pairs of facets disagree on their lit side"
    least, greatest = pitch_mm(facets)
    projected = any(chart is not None and not chart.stands for chart in facets.charts)
    if facets.enabled.any() and not projected and (least < 0.1 or greatest > 100):
        low, high = f"{least:.3g}", f"{greatest:.3g}"
        yield (
            f"the pixel pitch is {low if low == high else f'{low} to {high}'} mm, outside 0.1 to 100 mm:"
            " are the display's units and resolution right?"
        )
    extent = float(np.ptp(facets.corners, axis=0).max())
    if extent > _WIDEST:
        unit = likely_unit(extent)
        yield f"the display is {extent:.4g} m large: is its mesh in another unit (units: {unit}?)"


def surface_notices(facets: Facets) -> Iterator[str]:
    """Sentences about surfaces: pixels that crowd, as at poles, and edges that nearly meet."""
    for facet, chart in enumerate(facets.charts):
        if chart is None or not chart.stands:
            continue
        name = f"{facets.path}: {called(facet, facets.names)}"
        ratio = pitch_ratio(chart)
        if ratio > _CROWDED:
            yield (
                f"{name}: pixels are up to {ratio:,.0f} times closer together in some places than in others,"
                " as at a pole: pixels per metre say little there"
            )
        gap = seam_gap(chart)
        if gap is not None and not chart.wraps:
            yield (
                f"{name}: the left and the right edge are {gap:.2g} pixels apart but do not meet:"
                " what is looked up between pixels does not go on across them"
            )


def likely_unit(metres: float) -> str:
    """The unit a mesh was probably made in that has this extent when taken for metres."""
    return "mm" if metres > 1000 else "cm"


def disagreeing(facets: Facets) -> list[tuple[int, int]]:
    """Pairs (a, b) of 0-based facets whose windings run the same way along an edge they share.

    Two facets of one surface run along their common edge in opposite directions. Edges at which more
    than two facets meet tell nothing, and neither do facets that are not rendered.
    """
    edges = shared_edges(facets)
    if not edges.count:
        return []
    places = np.concatenate((edges.start, edges.end), axis=1)
    _, which, times = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    alone = times[which.reshape(-1)] == 1
    step = edges.end - edges.start
    way_a = _ways(facets, edges.facet_a.astype(np.int64), edges.start, edges.end, step)
    way_b = _ways(facets, edges.facet_b.astype(np.int64), edges.start, edges.end, step)
    shown = facets.enabled[edges.facet_a] & facets.enabled[edges.facet_b]
    same: BoolArray = alone & shown & (way_a == way_b)
    found = zip(edges.facet_a[same].tolist(), edges.facet_b[same].tolist(), strict=True)
    return list(dict.fromkeys(found))


def _ways(facets: Facets, facet: IntArray, start: FloatArray, end: FloatArray, step: FloatArray) -> BoolArray:
    """Whether each facet's outline runs along a piece (E,) of its edges from its start to its end."""
    first = facets.corner_start[facet]
    row, rank = segments(offsets(facets.corner_start[facet + 1] - first))
    a = first[row] + rank
    b = next_in_row(facets.corner_start)[a]
    edge = facets.corners[b] - facets.corners[a]
    # The edge that the piece lies on is the one whose line both its ends are nearest to.
    along = dot(edge, edge)
    away = np.zeros(len(row))
    for point in (start, end):
        local = point[row] - facets.corners[a]
        share = np.clip(dot(local, edge) / np.where(along > 0, along, 1), 0, 1)
        off = local - share[:, None] * edge
        away += dot(off, off)
    begins = np.flatnonzero(rank == 0)
    least = np.minimum.reduceat(away, begins)
    place = np.where(away == least[row], np.arange(len(row)), len(row))
    chosen = np.minimum.reduceat(place, begins)
    result: BoolArray = dot(edge[chosen], step) > 0
    return result
