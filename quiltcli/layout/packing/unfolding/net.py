"""Unfolding: neighbours on the display stay neighbours in the quilt.

The tree of Harish & Narayanan §3.4: from a facet outwards, breadth first, each facet is laid beside
the one it was reached from, across their common edge. A facet that would lie on another, or make its
island sparse or larger than a page, waits for an island of its own. Islands are then nested as wholes.
Facets so come to lie at any angle, and have no padding towards neighbours in the same island.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, next_in_row, segments
from quiltcli.layout.from_uv import QUARTER_TURNS
from quiltcli.layout.layout import Layout
from quiltcli.layout.packing.attempt import Attempt
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.nest import shape_attempts
from quiltcli.layout.packing.outlines.shapes import shapes_of_edges
from quiltcli.layout.packing.unfolding.island import Island, least_box
from quiltcli.layout.spans import facet_spans, overlaps

_SAME_LENGTH = 0.01  # pixels two sides of a hinge may differ: else their pixels are not of one size


def net_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """Unfold the display and nest the islands in every way facets can be nested."""
    islands = unfold(wanted)
    whole = _as_shapes(wanted, islands)
    row = np.repeat(np.arange(len(islands)), [len(island.corner) for island in islands])
    start = np.concatenate([island.position for island in islands])
    end = np.concatenate([island.following for island in islands])
    shapes = shapes_of_edges(whole.size, row, start, end)
    return [
        replace(attempt, run=partial(_run, attempt=attempt, islands=islands))
        for attempt in shape_attempts(whole, shapes, seconds)
    ]


def _as_shapes(wanted: PackInput, islands: Sequence[Island]) -> PackInput:
    size = np.array([island.size for island in islands], dtype=np.int32)
    return replace(wanted, size=size, mirror=False)


def _run(wanted: PackInput, attempt: Attempt, islands: Sequence[Island]) -> PackResult:
    """Pack the islands, then say where that puts every facet."""
    whole = _as_shapes(wanted, islands)
    result = attempt.run(whole)
    polygon = np.zeros_like(wanted.polygon)
    page_of_corner = np.zeros(len(polygon), dtype=np.int32)
    for at, island in enumerate(islands):
        turn = QUARTER_TURNS[result.turn[at]]
        low = np.minimum(turn * island.size, 0).sum(axis=1)
        polygon[island.corner] = island.position @ turn.T - low + result.corner[at]
        page_of_corner[island.corner] = result.page[at]
    first = wanted.corner_start[:-1]
    corner = np.floor(np.minimum.reduceat(polygon, first, axis=0)).astype(np.int32)
    count = len(first)
    return PackResult(
        page=page_of_corner[first],
        turn=np.zeros(count, dtype=np.int32),
        mirror=np.zeros(count, dtype=np.bool_),
        corner=corner,
        polygon=polygon,
    )


@dataclass(frozen=True)
class _Hinges:
    """Common edges: for the edge that starts at each corner (C,), the neighbour's corners at both ends.

    `here` is the neighbour's corner at the edge's start and `there` at its end, −1 without a neighbour.
    """

    here: IntArray
    there: IntArray


def hinges(wanted: PackInput) -> _Hinges:
    """Edges that exactly two facets share, whole, with pixels of one size."""
    following = next_in_row(wanted.corner_start)
    count = len(following)
    here, there = np.full(count, -1), np.full(count, -1)
    if wanted.vertex is None:
        return _Hinges(here, there)
    ends = np.sort(np.stack((wanted.vertex, wanted.vertex[following]), axis=1), axis=1)
    length = np.linalg.norm(wanted.polygon[following] - wanted.polygon, axis=1)
    _, inverse, times = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    twice = np.flatnonzero(times == 2)
    first = np.cumsum(times)[twice] - 2
    for a, b in ((order[first], order[first + 1]), (order[first + 1], order[first])):
        even = np.abs(length[a] - length[b]) <= _SAME_LENGTH
        a, b = a[even], b[even]
        same = wanted.vertex[a] == wanted.vertex[b]
        here[a], there[a] = np.where(same, b, following[b]), np.where(same, following[b], b)
    return _Hinges(here, there)


def unfold(wanted: PackInput) -> list[Island]:
    """Islands that hold every facet once, in the order of their lowest facet; none claims a pixel twice.

    A facet found to claim a pixel of another, by a sliver too thin to see in its outline, is kept from
    joining any island, and the display is unfolded again.
    """
    joints = hinges(wanted)
    barred = np.zeros(len(wanted.size), dtype=np.bool_)
    while True:
        waiting = np.ones(len(wanted.size), dtype=np.bool_)
        seeds = range(len(wanted.size))
        islands = [_grow(wanted, joints, waiting, barred, seed) for seed in seeds if waiting[seed]]
        doubled = _doubled(wanted, islands)
        if not doubled:
            return islands
        barred[doubled] = True


def _doubled(wanted: PackInput, islands: Sequence[Island]) -> list[int]:
    """Facets that claim a pixel of a facet before them."""
    position = np.concatenate([island.position for island in islands])
    facet = np.concatenate([island.facet for island in islands])
    island = np.repeat(np.arange(len(islands)), [len(island.corner) for island in islands])
    first = np.flatnonzero(np.diff(facet, prepend=-1))
    count = len(first)
    alone = Layout(
        facet=np.arange(1, count + 1, dtype=np.int32),
        page=island[first].astype(np.int32),
        size=np.ones((count, 2), dtype=np.int32),
        quilt_from_facet=np.tile(np.eye(2, 3), (count, 1, 1)),
        origin=np.zeros((count, 3)),
        du=np.zeros((count, 3)),
        dv=np.zeros((count, 3)),
        corner_start=np.append(first, len(facet)),
        polygon=position,
        pages=np.array([island.size for island in islands], dtype=np.int32),
        padding=wanted.padding,
        method="net",
        display="",
        display_sha256="",
    )
    return sorted({int(facet[first[overlap.row_b]]) for overlap in overlaps(facet_spans(alone))})


def _grow(wanted: PackInput, joints: _Hinges, waiting: BoolArray, barred: BoolArray, seed: int) -> Island:
    """One island from its first facet, which is laid as its raster is; marks what it takes."""
    facet_of, _ = segments(wanted.corner_start)
    island = _facet(wanted, seed)
    waiting[seed] = False
    queue = deque([] if barred[seed] else [seed])
    while queue:
        facet = queue.popleft()
        for corner in range(int(wanted.corner_start[facet]), int(wanted.corner_start[facet + 1])):
            there = int(joints.there[corner])
            if there < 0 or not waiting[facet_of[there]] or barred[facet_of[there]]:
                continue
            neighbour = int(facet_of[there])
            larger = _joined(wanted, island, corner, int(joints.here[corner]), there, neighbour)
            if larger is not None:
                island = larger
                waiting[neighbour] = False
                queue.append(neighbour)
    return least_box(island)


def _facet(wanted: PackInput, facet: int) -> Island:
    """A facet alone."""
    corners = np.arange(wanted.corner_start[facet], wanted.corner_start[facet + 1])
    return Island.of(wanted, corners, wanted.polygon[corners])


def _joined(
    wanted: PackInput, island: Island, corner: int, here: int, there: int, facet: int
) -> Island | None:
    """The island with one more facet across the edge that starts at `corner`; None if it must not be."""
    corners = np.arange(wanted.corner_start[facet], wanted.corner_start[facet + 1])
    start, end = island.edge(corner)
    polygon = wanted.polygon[corners]
    old = wanted.polygon[there] - wanted.polygon[here]
    turn = _rotation(old, end - start)
    laid = (polygon - wanted.polygon[here]) @ turn.T + start
    return island.plus(wanted, corners, island.welded(wanted, corners, laid))


def _rotation(old: FloatArray, new: FloatArray) -> FloatArray:
    """The rotation (2, 2) from one direction to another."""
    cos, sin = float(old @ new), float(old[0] * new[1] - old[1] * new[0])
    length = np.hypot(cos, sin)
    return np.asarray(np.array([[cos, -sin], [sin, cos]]) / length)
