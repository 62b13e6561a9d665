"""The display as a mesh to draw: corners with places in the quilt, triangles, edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets, triangulate
from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray, cross, dot
from quiltcli.layout import Layout, quilt_polygons


@dataclass(frozen=True)
class DisplayMesh:
    """F facets of C corners in all, cut into T triangles.

    Attributes:
        centre: (3,) what positions are measured from, world metres: the middle of the display.
        radius: metres from there to the farthest corner.
        position: (C, 3) corners from the centre, metres.
        quilt: (C, 2) the corners in pixels of their pages.
        start: (F+1,) offsets of facets into corners.
        triangles: (T, 3) corners, counter-clockwise as seen from the lit side.
        facet: (T,) 0-based facet of a triangle.
        page: (F,) 0-based page, −1 for a facet without images.
        normal: (F, 3) unit, out of the lit side.
        both_sides: whether the facets are lit on both.
    """

    centre: FloatArray
    radius: float
    position: Float32Array
    quilt: Float32Array
    start: IntArray
    triangles: Int32Array
    facet: Int32Array
    page: Int32Array
    normal: Float32Array
    both_sides: bool


def display_mesh(facets: Facets, layout: Layout) -> DisplayMesh:
    """The mesh of a display; positions are single precision, hence measured from its middle.

    Args:
        facets: the display.
        layout: its layout, one row a facet.
    """
    low, high = facets.corners.min(axis=0), facets.corners.max(axis=0)
    centre = (low + high) / 2
    local = facets.corners - centre
    triangles, facet = triangulate(facets)
    return DisplayMesh(
        centre=centre,
        radius=float(np.sqrt(dot(local, local)).max()),
        position=local.astype(np.float32),
        quilt=quilt_polygons(layout).astype(np.float32),
        start=facets.corner_start,
        triangles=_facing(facets, triangles, facet),
        facet=facet,
        page=np.where(facets.enabled, layout.page, -1).astype(np.int32),
        normal=facets.normal.astype(np.float32),
        both_sides=facets.both_sides,
    )


def _facing(facets: Facets, triangles: Int32Array, facet: Int32Array) -> Int32Array:
    """Triangles turned so that they are counter-clockwise as seen from the lit side.

    A display seen from inside is lit on the side its mesh faces show their back to.
    """
    a, b, c = (facets.corners[triangles[:, k]] for k in range(3))
    away = dot(cross(b - a, c - a), facets.normal[facet]) < 0
    return np.where(away[:, None], triangles[:, ::-1], triangles).astype(np.int32)
