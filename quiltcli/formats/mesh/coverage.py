"""Whether triangles cover their polygons: the area of each polygon against that of its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.formats.mesh.crossings import crossing_edges
from quiltcli.formats.mesh.polygons import Triangles, triangle_areas
from quiltcli.geometry import FloatArray, IntArray, next_in_row, segments

TOLERANCE = 1e-9
"""Of the square of a polygon's size: what may lie between its area and that of its triangles."""

# Polygons that differ are looked at one by one: beyond this many, all are taken to cross themselves.
_MOST_TESTED = 1000


@dataclass(frozen=True)
class Coverage:
    """What comparing areas has shown.

    Attributes:
        faces: polygons compared, those of more than three corners.
        area: their areas added up, in square units of the file.
        triangle_area: areas of their triangles added up, none of them counted as negative.
        wrong: simple polygons whose triangles have another area.
        crossing: polygons that cross themselves, whose triangles cannot but differ.
        worst: greatest difference, as a share of the square of the polygon's size.
        first: 0-based number of the first polygon that differs, -1 for none.
    """

    faces: int = 0
    area: float = 0.0
    triangle_area: float = 0.0
    wrong: int = 0
    crossing: int = 0
    worst: float = 0.0
    first: int = -1

    def __add__(self, other: Coverage) -> Coverage:
        """Both together; the first polygon is this one's if it has one."""
        return Coverage(
            self.faces + other.faces,
            self.area + other.area,
            self.triangle_area + other.triangle_area,
            self.wrong + other.wrong,
            self.crossing + other.crossing,
            max(self.worst, other.worst),
            self.first if self.first >= 0 else other.first,
        )


NOTHING = Coverage()
"""No polygon compared."""


def coverage(points: FloatArray, start: IntArray, triangles: Triangles) -> Coverage:
    """Compare the areas of polygons and of their triangles in the polygons' own planes.

    Triangles beyond an outline make up for themselves by others that turn the wrong way, so areas are
    added without their signs: the sums agree only where nothing is covered twice or from outside.

    Args:
        points: (C, 2) plane coordinates.
        start: (F+1,) offsets.
        triangles: what covers them.
    """
    counts = np.diff(start)
    row, _ = segments(start)
    following = points[next_in_row(start)]
    twice = points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]
    area = np.bincount(row, twice, len(counts)) / 2
    signed = triangle_areas(points, triangles.corners)
    covered = np.bincount(triangles.face, np.abs(signed), len(counts))
    size = np.zeros(len(counts))
    np.maximum.at(size, row, np.abs(points).max(axis=1))
    compared = (counts > 3) & np.isfinite(area) & (size > 0)
    share = np.abs(covered - area)[compared] / size[compared] ** 2
    differing = np.flatnonzero(compared)[share > TOLERANCE]
    tested = differing[:_MOST_TESTED].tolist()
    simple = sum(not _crosses(points[start[face] : start[face + 1]]) for face in tested)
    return Coverage(
        faces=int(np.count_nonzero(compared)),
        area=float(area[compared].sum()),
        triangle_area=float(covered[compared].sum()),
        wrong=simple,
        crossing=len(differing) - simple,
        worst=float(share.max(initial=0.0)),
        first=int(differing[0]) if len(differing) else -1,
    )


def _crosses(points: FloatArray) -> bool:
    return crossing_edges(points) is not None
