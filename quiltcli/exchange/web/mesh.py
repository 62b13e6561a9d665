"""The display as a mesh to draw: corners with places in the quilt, triangles, edges; surfaces as nets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.charts import Chart
from quiltcli.charts.meet import CELLS, net
from quiltcli.charts.shapes import turned
from quiltcli.display import Facets, triangulate
from quiltcli.geometry import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    IntArray,
    cross,
    dot,
    next_in_row,
    segments,
)
from quiltcli.layout import Layout, quilt_polygons
from quiltcli.viewer.viewer import Viewer


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
        normal: (F, 3) unit, out of the lit side; of a curved facet in its middle.
        facing: (C, 3) the same at every corner.
        edges: (E, 2) corners of lines along the borders of facets.
        bent: (F,) facets that are curved, of which each place is lit or not by itself.
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
    facing: Float32Array
    edges: Int32Array
    bent: BoolArray
    both_sides: bool


@dataclass(frozen=True)
class _Piece:
    """Facets of a mesh: how many corners each has, those, and triangles and edges of them."""

    counts: IntArray
    position: FloatArray
    quilt: FloatArray
    facing: FloatArray
    triangles: Int32Array
    facet: Int32Array
    edges: IntArray


def display_mesh(facets: Facets, layout: Layout, viewer: Viewer | None = None) -> DisplayMesh:
    """The mesh of a display; positions are single precision, hence measured from its middle.

    Args:
        facets: the display; what is curved of it stands behind what is flat.
        layout: its layout, one row a facet.
        viewer: about whose eye a projection stands; other displays need none.
    """
    bent = facets.curved
    pieces = [_flat(facets, layout, int(np.count_nonzero(~bent)))]
    cells = max(16, round(CELLS / np.sqrt(max(bent.sum(), 1))))
    pieces += [_net(facets, layout, row, cells, viewer) for row in np.flatnonzero(bent).tolist()]
    first = np.cumsum([0, *(len(piece.position) for piece in pieces)])
    position = np.concatenate([piece.position for piece in pieces])
    low, high = position.min(axis=0), position.max(axis=0)
    centre = (low + high) / 2
    local = position - centre
    return DisplayMesh(
        centre=centre,
        radius=float(np.sqrt(dot(local, local)).max()),
        position=local.astype(np.float32),
        quilt=np.concatenate([piece.quilt for piece in pieces]).astype(np.float32),
        start=np.cumsum(np.concatenate([[0], *(piece.counts for piece in pieces)])),
        triangles=np.concatenate([p.triangles + k for p, k in zip(pieces, first, strict=False)]).astype(
            np.int32
        ),
        facet=np.concatenate([piece.facet for piece in pieces]),
        page=np.where(facets.enabled, layout.page, -1).astype(np.int32),
        normal=facets.normal.astype(np.float32),
        facing=np.concatenate([piece.facing for piece in pieces]).astype(np.float32),
        edges=np.concatenate([p.edges + k for p, k in zip(pieces, first, strict=False)]).astype(np.int32),
        bent=bent,
        both_sides=facets.both_sides,
    )


def _flat(facets: Facets, layout: Layout, count: int) -> _Piece:
    """The first facets of a display, all of them flat."""
    start = facets.corner_start[: count + 1]
    triangles, facet = triangulate(facets)
    triangles = _facing(facets, triangles, facet)[facet < count]
    row, _ = segments(start)
    return _Piece(
        counts=np.diff(start),
        position=facets.corners[: start[-1]],
        quilt=quilt_polygons(layout)[: start[-1]],
        facing=facets.normal[row],
        triangles=triangles,
        facet=facet[facet < count],
        edges=np.stack((np.arange(start[-1]), next_in_row(start)), axis=1),
    )


def _net(facets: Facets, layout: Layout, row: int, cells: int, viewer: Viewer | None) -> _Piece:
    """A curved facet: a fine net over its pixels."""
    chart = facets.charts[row]
    assert chart is not None
    points, pixels, triangles = net(chart, cells)
    used, corner = np.unique(triangles, return_inverse=True)
    points, pixels = points[used], pixels[used]
    normals = chart.normals(*np.clip(pixels.T, 0.5, np.array(chart.size)[:, None] - 0.5)).T
    if not chart.stands:
        assert viewer is not None
        # Its lit side is towards the eye.
        normals = -points / np.sqrt(dot(points, points))[:, None]
        if chart.follows == "view":
            points, normals = (turned(viewer.camera_from_world.T, each.T).T for each in (points, normals))
        points = points + viewer.eye
    sides: IntArray = corner.reshape(-1, 3).astype(np.int64)
    matrix = layout.quilt_from_facet[row]
    a, b, c = (points[sides[:, k]] for k in range(3))
    away = dot(cross(b - a, c - a), normals[sides].sum(axis=1)) < 0
    return _Piece(
        counts=np.array([len(points)]),
        position=points,
        quilt=pixels @ matrix[:, :2].T + matrix[:, 2],
        facing=normals,
        triangles=np.where(away[:, None], sides[:, ::-1], sides).astype(np.int32),
        facet=np.full(len(sides), row, dtype=np.int32),
        edges=_border(chart, pixels, sides),
    )


def _border(chart: Chart, pixels: FloatArray, triangles: IntArray) -> IntArray:
    """Sides (E, 2) of triangles that no other triangle has, but for those along a seam."""
    sides = np.sort(np.concatenate((triangles[:, :2], triangles[:, 1:], triangles[:, [2, 0]])), axis=1)
    found, count = np.unique(sides, axis=0, return_counts=True)
    border: IntArray = found[count == 1]
    if chart.wraps:
        x = pixels[border, 0]
        border = border[~((x == 0).all(axis=1) | (x == chart.size[0]).all(axis=1))]
    return border


def _facing(facets: Facets, triangles: Int32Array, facet: Int32Array) -> Int32Array:
    """Triangles turned so that they are counter-clockwise as seen from the lit side.

    A display seen from inside is lit on the side its mesh faces show their back to.
    """
    a, b, c = (facets.corners[triangles[:, k]] for k in range(3))
    away = dot(cross(b - a, c - a), facets.normal[facet]) < 0
    return np.where(away[:, None], triangles[:, ::-1], triangles).astype(np.int32)
