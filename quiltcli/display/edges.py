"""Edges that two facets have in common, whole or in part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display.weld import tolerance, weld
from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    Int32Array,
    IntArray,
    dot,
    next_in_row,
    offsets,
    segments,
    shares,
)

_PAIRS_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class SharedEdges:
    """E pieces of edge, each lying on two facets.

    Attributes:
        facet_a: (E,) lower facet index, 0-based.
        facet_b: (E,) higher facet index, 0-based.
        start: (E, 3) world metres.
        end: (E, 3) world metres.
    """

    facet_a: Int32Array
    facet_b: Int32Array
    start: FloatArray
    end: FloatArray

    @property
    def count(self) -> int:
        """Number of pieces, E."""
        return len(self.facet_a)


def find_shared_edges(corners: FloatArray, start: IntArray) -> SharedEdges:
    """Find the edges polygons share within a millionth of the display's size.

    Where an edge of one facet meets several shorter ones (a T-junction), each common piece counts.
    Where more than two facets meet at a piece, every pair of them is listed.

    Args:
        corners: (C, 3) world metres.
        start: (F+1,) offsets.

    Returns:
        Pieces in the order of (facet_a, facet_b) and then of their points.
    """
    number = weld(corners)
    _, first = np.unique(number, return_index=True)
    points = corners[first]
    facet, _ = segments(start)
    ends = np.sort(np.stack((number, number[next_in_row(start)]), axis=1), axis=1)
    facet, ends = _split(points, facet, ends, tolerance(corners))
    order = np.lexsort((facet, ends[:, 1], ends[:, 0]))
    facet, ends = facet[order], ends[order]
    a, b = _pairs(facet, ends)
    order = np.lexsort((ends[a, 1], ends[a, 0], facet[b], facet[a]))
    a, b = a[order], b[order]
    return SharedEdges(
        facet_a=facet[a].astype(np.int32),
        facet_b=facet[b].astype(np.int32),
        start=points[ends[a, 0]],
        end=points[ends[a, 1]],
    )


def _pairs(facet: IntArray, ends: IntArray) -> tuple[IntArray, IntArray]:
    """Rows of `ends`, which are sorted, that are equal but belong to different facets."""
    a, b = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    gap = 1
    while gap < len(ends):
        same = np.flatnonzero((ends[gap:] == ends[:-gap]).all(axis=1))
        if not same.size:
            break
        other = facet[same] != facet[same + gap]
        a.append(same[other])
        b.append(same[other] + gap)
        gap += 1
    return np.concatenate(a), np.concatenate(b)


def _split(points: FloatArray, facet: IntArray, ends: IntArray, close: float) -> tuple[IntArray, IntArray]:
    """Cut edges that no other facet has whole at every point that lies on them.

    Returns:
        Facet (N,) and sorted end points (N, 2) of the pieces.
    """
    _, inverse, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    single = np.flatnonzero(count[inverse.reshape(-1)] == 1)
    edge, point = _points_on(points, ends[single], close)
    if not edge.size:
        return facet, ends
    edge = single[edge]
    from_start = points[point] - points[ends[edge, 0]]
    order = np.lexsort((dot(from_start, from_start), edge))
    edge, point = edge[order], point[order]
    cut, begin = np.unique(edge, return_index=True)
    pieces = [
        np.stack((np.r_[ends[e, 0], inner], np.r_[inner, ends[e, 1]]), axis=1)
        for e, inner in zip(cut, np.split(point, begin[1:]), strict=True)
    ]
    whole = np.delete(np.arange(len(ends)), cut)
    owners = np.repeat(facet[cut], [len(piece) for piece in pieces])
    everything = np.concatenate((ends[whole], *pieces))
    return np.concatenate((facet[whole], owners)), np.sort(everything, axis=1)


def _points_on(points: FloatArray, ends: IntArray, close: float) -> tuple[IntArray, IntArray]:
    """Pairs (edge, point) of every point within `close` of the inside of an edge.

    A sweep along the display's longest axis keeps the candidates few.
    """
    axis = int(np.argmax(np.ptp(points, axis=0)))
    order = np.argsort(points[:, axis], kind="stable")
    along = points[order, axis]
    low, high = np.sort(points[ends][..., axis], axis=1).T
    begin = np.searchsorted(along, low - close)
    count = np.searchsorted(along, high + close, side="right") - begin
    found = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    for part in shares(count, _PAIRS_AT_ONCE):
        edge, rank = segments(offsets(count[part]))
        edge = edge + part.start
        point = order[begin[edge] + rank]
        on = _inside(points[ends[edge, 0]], points[ends[edge, 1]], points[point], close)
        found.append((edge[on], point[on]))
    return np.concatenate([e for e, _ in found]), np.concatenate([p for _, p in found])


def _inside(a: FloatArray, b: FloatArray, point: FloatArray, close: float) -> BoolArray:
    edge, local = b - a, point - a
    length = np.sqrt(dot(edge, edge))
    along = dot(local, edge) / np.maximum(length, 1e-300)
    off = local - (along / np.maximum(length, 1e-300))[:, None] * edge
    return (along > close) & (along < length - close) & (dot(off, off) <= close * close)
