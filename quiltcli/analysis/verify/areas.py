"""Polygons against their triangles: rays meet triangles, so no ray can tell that they miss a polygon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from quiltcli.display import Facets, triangulate
from quiltcli.formats.mesh.coverage import NOTHING, Coverage, coverage
from quiltcli.formats.mesh.polygons import Triangles, plane_coordinates


@dataclass(frozen=True)
class Areas:
    """How the areas of polygons compare with those of their triangles.

    Attributes:
        display: the facets of the display.
        scene: the faces of the scene's files, compared when they were loaded.
    """

    display: Coverage = NOTHING
    scene: Coverage = NOTHING

    @property
    def failures(self) -> int:
        """Polygons whose triangles have another area, but for those that cross themselves."""
        return self.display.wrong + self.scene.wrong

    def as_json(self) -> dict[str, Any]:
        """The comparison for programs."""
        return {name: _entry(found) for name, found in (("display", self.display), ("scene", self.scene))}


def _entry(found: Coverage) -> dict[str, Any]:
    return {
        "polygons": found.faces,
        "area": found.area,
        "triangle_area": found.triangle_area,
        "wrong": found.wrong,
        "crossing": found.crossing,
        "worst": found.worst,
    }


def display_coverage(facets: Facets) -> Coverage:
    """Compare the facets of a display with the triangles that stand for them."""
    triangles, facet = triangulate(facets)
    points = plane_coordinates(facets.corners, facets.corner_start)
    return coverage(points, facets.corner_start, Triangles(triangles.astype("int64"), facet.astype("int64")))
