"""What makes a polygon fit to be a facet: distinct corners, an area, a plane, a simple outline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from quiltcli.display.weld import weld
from quiltcli.errors import Problem
from quiltcli.formats.mesh.crossings import crossing_edges
from quiltcli.formats.mesh.polygons import area_vectors, convex, diameters, plane_coordinates
from quiltcli.geometry import FloatArray, IntArray, cross, dot, next_in_row, normalized, segments

PLANAR = 1e-4  # of the facet's size
_SAME_POINT = 1e-9  # of the facet's size
_ON_A_LINE = 1e-6  # of the facet's size
_NO_AREA = 1e-9  # of the facet's size squared


def check_polygons(
    corners: FloatArray, start: IntArray, names: Sequence[str], lines: IntArray, path: str
) -> list[Problem]:
    """Everything that keeps polygons from being facets, at most one problem a facet.

    Args:
        corners: (C, 3) world metres.
        start: (F+1,) offsets.
        names: F names for the messages.
        lines: (F,) lines of the mesh file.
        path: the mesh file.

    Returns:
        Problems in the order of the facets.
    """
    found: dict[int, str] = {}
    for check in (_distinct, _wide, _one_sided, _planar, _simple):
        for facet, message in check(corners, start):
            found.setdefault(facet, message)
    for facet, message in _doubled(corners, start):
        found.setdefault(facet, message)
    return [
        Problem(f"{called(facet, names)}: {found[facet]}", path, int(lines[facet])) for facet in sorted(found)
    ]


def called(facet: int, names: Sequence[str]) -> str:
    """`facet 3 (top)`, or `facet 3` without a name, for a 0-based facet."""
    return f"facet {facet + 1} ({names[facet]})" if names[facet] else f"facet {facet + 1}"


def _distinct(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    row, rank = segments(start)
    step = corners[next_in_row(start)] - corners
    near = np.sqrt(dot(step, step)) <= _SAME_POINT * diameters(corners, start)[row]
    for place in np.flatnonzero(near):
        facet, first = int(row[place]), int(rank[place]) + 1
        second = first % int(start[facet + 1] - start[facet]) + 1
        yield facet, f"corners {first} and {second} are the same point (expected distinct corners)"


def _wide(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    """A polygon whose corners are all near one line through its first corner."""
    row, _ = segments(start)
    local = corners - corners[start[:-1]][row]
    length = np.sqrt(dot(local, local))
    farthest = np.maximum.reduceat(length, start[:-1])
    # The first corner that is as far as any gives the line.
    place = np.where(length == farthest[row], np.arange(len(row)), len(row))
    direction = normalized(local[np.minimum.reduceat(place, start[:-1])])
    off = cross(local, direction[row])
    width = np.maximum.reduceat(np.sqrt(dot(off, off)), start[:-1])
    for facet in np.flatnonzero(width <= _ON_A_LINE * diameters(corners, start)):
        yield int(facet), "all its corners lie on one line (expected a face with an area)"


def _one_sided(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    """An outline whose loops cancel, as a bow-tie's do, has no side to be lit on."""
    vector = area_vectors(corners, start)
    area = np.sqrt(dot(vector, vector)) / 2
    for facet in np.flatnonzero(area <= _NO_AREA * diameters(corners, start) ** 2):
        yield int(facet), "its outline crosses itself and encloses no area (expected a simple polygon)"


def _planar(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    row, _ = segments(start)
    count = np.diff(start)[:, None]
    centre = np.add.reduceat(corners, start[:-1], axis=0) / count
    normal = normalized(area_vectors(corners, start))
    off = np.abs(dot(corners - centre[row], normal[row]))
    worst = np.maximum.reduceat(off, start[:-1])
    limit = PLANAR * diameters(corners, start)
    for facet in np.flatnonzero(worst > limit):
        yield (
            int(facet),
            f"not planar: its corners lie up to {worst[facet]:.3g} m off its plane "
            f"(expected at most {limit[facet]:.3g} m, {PLANAR:g} of its size)",
        )


def _simple(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    points = plane_coordinates(corners, start)
    for facet in np.flatnonzero(~convex(points, start)):
        edges = crossing_edges(points[start[facet] : start[facet + 1]])
        if edges is not None:
            yield (
                int(facet),
                f"edges {edges[0] + 1} and {edges[1] + 1} cross or touch (expected a simple polygon)",
            )


def _doubled(corners: FloatArray, start: IntArray) -> Iterator[tuple[int, str]]:
    points = weld(corners)
    first: dict[tuple[int, ...], int] = {}
    for facet in range(len(start) - 1):
        key = tuple(sorted(points[start[facet] : start[facet + 1]].tolist()))
        earlier = first.setdefault(key, facet)
        if earlier != facet:
            yield facet, f"has the same corners as facet {earlier + 1} (expected every face once)"
