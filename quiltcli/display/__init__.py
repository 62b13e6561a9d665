"""The display: planar facets in world space, each with its own pixel raster."""

from __future__ import annotations

from quiltcli.display.build import build_facets, load_display
from quiltcli.display.edges import SharedEdges
from quiltcli.display.facets import (
    Facets,
    Places,
    chart_points,
    convex_parts,
    corner_pixels,
    demand_place,
    display_points,
    eyes_apart,
    lit_facets,
    pitch_mm,
    pitch_of,
    scaled,
    shared_edges,
    triangulate,
)

__all__ = [
    "Facets",
    "Places",
    "SharedEdges",
    "build_facets",
    "chart_points",
    "convex_parts",
    "corner_pixels",
    "demand_place",
    "display_points",
    "eyes_apart",
    "lit_facets",
    "load_display",
    "pitch_mm",
    "pitch_of",
    "scaled",
    "shared_edges",
    "triangulate",
]
