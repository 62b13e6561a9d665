"""The facets of a display as arrays, and what follows from them alone."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from quiltcli.charts.chart import EDGE_ON, Chart
from quiltcli.display.edges import SharedEdges, find_shared_edges
from quiltcli.display.response import Response
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.mesh import polygons
from quiltcli.formats.yaml.source import Source
from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    Int32Array,
    IntArray,
    dot,
    facet_from_world,
    offsets,
    segments,
)
from quiltcli.job.places import PlaceOnPage

_PLACES = 33


@dataclass(frozen=True, eq=False)
class Places:
    """Where n facets are to stay in the quilt.

    A facet's image is mirrored left to right if `mirror`, then turned clockwise by quarter turns, then
    put with its top-left pixel at `corner`.

    Attributes:
        facet: (n,) ids, ascending.
        page: (n,) 0-based page.
        turn: (n,) quarter turns, 0 to 3.
        mirror: (n,) whether the image is mirrored.
        corner: (n, 2) pixel x, y of the page.
        source: finds lines in the display file.
        keys: where in the file each facet's own entry stands.
        page_size: width and height of the pages that the places are on; None where the file does not say.
    """

    facet: Int32Array
    page: Int32Array
    turn: Int32Array
    mirror: BoolArray
    corner: Int32Array
    source: Source
    keys: Mapping[int, tuple[str | int, ...]]
    page_size: tuple[int, int] | None = None

    def problem(self, key: Sequence[str | int], message: str) -> Problem:
        """A problem with the place of a facet: the key begins with `facets` and its id."""
        facet = int(key[1])
        return self.source.problem((*self.keys[facet], "place"), message)


def places_of(given: Mapping[int, PlaceOnPage | None], source: Source, *, listed: str = "") -> Places | None:
    """The places in the quilt that a display file gives, by facet id in ascending order; None without any.

    Args:
        given: the places.
        source: finds lines in the display file.
        listed: key of the list in which the facets' entries stand one by one; they stand by id without.
    """
    known = {facet: place for facet, place in given.items() if place is not None}
    if not known:
        return None
    return Places(
        facet=np.array(list(known), dtype=np.int32),
        page=np.array([place.page - 1 for place in known.values()], dtype=np.int32),
        turn=np.array([int(place.rotate) // 90 for place in known.values()], dtype=np.int32),
        mirror=np.array([place.mirror for place in known.values()], dtype=np.bool_),
        corner=np.array([place.at for place in known.values()], dtype=np.int32),
        source=source,
        keys={facet: (listed, facet - 1) if listed else ("facets", facet) for facet in known},
    )


@dataclass(frozen=True)
class Facets:
    """The F facets of a display, in mesh face order (facet id = index + 1).

    A facet's raster is W × H pixels in its plane: the continuous facet pixel (i, j) lies at
    `origin + i·du + j·dv` in the world. Seen from the lit side `du` points right and `dv` down.

    Attributes:
        names: F names, empty where none was given.
        corner_start: (F+1,) offsets into `corners`.
        corners: (C, 3) world metres, in the winding of the mesh face.
        origin: (F, 3) world position of the raster's top-left corner, metres.
        du: (F, 3) world step to the next pixel right, metres.
        dv: (F, 3) world step to the next pixel down, metres.
        size: (F, 2) raster width and height, pixels.
        normal: (F, 3) unit normal on the lit side (of the winding's front when both sides are lit).
        both_sides: whether a facet is lit on both sides.
        enabled: (F,) facets that take part.
        mirrored: (F,) facets whose image is mirrored because the user asked for it.
        uv: (C, 2) texture coordinates of the mesh, v up, or None.
        path: the display file as the user named it, for messages.
        places: facets whose place in the quilt the display file gives; None when it gives none.
        charts: of F facets those of curved ones, None for flat ones; empty where all are flat. A curved
            facet's corners, origin and steps are those of a rectangle that stands for it.
        response: what the panels make of their images; None where they show them as they are.
    """

    names: tuple[str, ...]
    corner_start: IntArray
    corners: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    size: Int32Array
    normal: FloatArray
    both_sides: bool
    enabled: BoolArray
    mirrored: BoolArray
    uv: FloatArray | None
    path: str
    places: Places | None = None
    charts: tuple[Chart | None, ...] = ()
    response: Response | None = None

    @property
    def curved(self) -> BoolArray:
        """Which facets (F,) have a chart."""
        found = [chart is not None for chart in self.charts] or [False] * self.count
        return np.array(found, dtype=np.bool_)

    @property
    def count(self) -> int:
        """Number of facets, F."""
        return len(self.names)

    def polygon(self, facet: int) -> FloatArray:
        """Corners (n, 3) of the facet with this 0-based index, world metres."""
        return self.corners[self.corner_start[facet] : self.corner_start[facet + 1]]

    @property
    def sha256(self) -> str:
        """Hash of what a layout depends on: corners, rasters and lit sides, in hexadecimal.

        Numbers are rounded to a billionth of a metre first, so that the last bit of a processor's
        arithmetic does not make it another display.
        """
        digest = hashlib.sha256(b"quilt display 1")
        for whole in (self.corner_start, self.size, np.array([self.both_sides])):
            digest.update(np.ascontiguousarray(whole, dtype="<i8").tobytes())
        for exact in (self.corners, self.origin, self.du, self.dv, self.normal):
            # Adding zero turns −0 into 0.
            digest.update(np.ascontiguousarray(np.round(exact, 9) + 0.0, dtype="<f8").tobytes())
        for chart in self.charts:
            digest.update(b"-" if chart is None else chart.record.encode())
        return digest.hexdigest()


def demand_place(facets: Facets, what: str) -> None:
    """Raise a DisplayError where a display is a projection, for something that asks where a display is."""
    if any(chart is not None and not chart.stands for chart in facets.charts):
        words = f"{what} is for displays that stand in the world, and this projection goes along with the eye"
        raise DisplayError(Problem(words, facets.path))


def eyes_apart(facets: Facets) -> bool:
    """Whether pixels of a facet have eyes of their own, beside the head."""
    return any(chart is not None and chart.omni is not None for chart in facets.charts)


def display_points(facets: Facets) -> FloatArray:
    """Points (N, 3) all over a display: corners of flat facets, places on curved ones, world metres.

    Projections, which stand nowhere, count by the rectangles that stand for them.
    """
    if not facets.charts:
        return facets.corners
    row, _ = segments(facets.corner_start)
    standing = np.array([chart is not None and chart.stands for chart in facets.charts])
    found = [facets.corners[~standing[row]]]
    found += [chart_points(chart).T for chart in facets.charts if chart is not None and chart.stands]
    return np.concatenate(found)


def chart_points(chart: Chart) -> FloatArray:
    """Points (3, N), or directions, at places all over a chart that there are."""
    x, y = (np.clip(np.linspace(0, side, _PLACES), 0.5, side - 0.5) for side in chart.size)
    points = np.broadcast_to(chart.points(x, y[:, None]), (3, _PLACES, _PLACES)).reshape(3, -1)
    return points[:, np.isfinite(points.sum(axis=0))]


def scaled(facets: Facets, scale: Fraction) -> Facets:
    """The same facets with fewer pixels: rasters grow to whole pixels at the right and below.

    Places on a canvas, which are for whole images, are dropped.
    """
    top, bottom = scale.numerator, scale.denominator
    size = -(-facets.size.astype(np.int64) * top // bottom)
    size = np.maximum(size, 1)
    du, dv = facets.du * (bottom / top), facets.dv * (bottom / top)
    if facets.charts:
        # A surface has all of its raster: its pixels grow, and what stands for it as they do.
        ratio = np.where(facets.curved[:, None], facets.size / size, bottom / top)
        du, dv = facets.du * ratio[:, :1], facets.dv * ratio[:, 1:]
    pairs = zip(facets.charts, size.tolist(), strict=False)
    charts = tuple(None if chart is None else chart.scaled((wide, high)) for chart, (wide, high) in pairs)
    return replace(facets, size=size.astype(np.int32), du=du, dv=dv, places=None, charts=charts)


def lit_facets(facets: Facets, eye: FloatArray) -> BoolArray:
    """Which facets (F,) show an image to an eye (3,): enabled, and lit on the side it is on.

    An eye in a facet's plane, to a billionth of a metre, sees nothing of it. A curved facet may be lit in
    parts, which its pixels tell.
    """
    height = dot(eye - facets.origin, facets.normal)
    if facets.both_sides:
        height = np.abs(height)
    seen = height > EDGE_ON
    if facets.charts:
        seen |= facets.curved
    result: BoolArray = facets.enabled & seen
    return result


def corner_pixels(facets: Facets) -> FloatArray:
    """Facet pixel coordinates (C, 2) of all corners."""
    row, _ = segments(facets.corner_start)
    # Measured from the raster's own corner, so that no digits go into the display's place in the world.
    maps = facet_from_world(np.zeros_like(facets.origin), facets.du, facets.dv)[row]
    local = facets.corners - facets.origin[row]
    return np.stack((dot(local, maps[:, 0, :3]), dot(local, maps[:, 1, :3])), axis=1)


def triangulate(facets: Facets) -> tuple[Int32Array, Int32Array]:
    """Triangles that cover the facets exactly, concave ones too, in the winding of the mesh.

    Returns:
        triangles (T, 3) int32 indices into `corners`, and facet (T,) int32, 0-based, ascending.
    """
    start = facets.corner_start
    cut = polygons.triangulate(polygons.plane_coordinates(facets.corners, start), start)
    return cut.corners.astype(np.int32), cut.face.astype(np.int32)


def convex_parts(facets: Facets) -> tuple[Int32Array, IntArray, Int32Array]:
    """Convex polygons that cover the facets: a convex facet itself, else its triangles.

    Returns:
        part_facet (K,) int32 0-based facet, ascending; part_start (K+1,) offsets into part_corners;
        part_corners (M,) int32 indices into `facets.corners`, in the winding of the mesh.
    """
    start = facets.corner_start
    points = polygons.plane_coordinates(facets.corners, start)
    whole = polygons.convex(points, start)
    if whole.all():
        return np.arange(facets.count, dtype=np.int32), start, np.arange(start[-1], dtype=np.int32)
    triangles, owner = polygons.triangulate(points, start)
    cut = ~whole[owner]
    facet = np.concatenate((np.flatnonzero(whole), owner[cut]))
    order = np.argsort(facet, kind="stable")
    count = np.where(whole[facet], np.diff(start)[facet], 3)[order]
    part_start = offsets(count)
    pool = np.concatenate((np.arange(start[-1]), triangles[cut].reshape(-1)))
    begin = np.concatenate((start[:-1][whole], start[-1] + 3 * np.arange(cut.sum())))[order]
    part, rank = segments(part_start)
    return facet[order].astype(np.int32), part_start, pool[begin[part] + rank].astype(np.int32)


def shared_edges(facets: Facets) -> SharedEdges:
    """Edges, or pieces of edges, that two facets have in common."""
    return find_shared_edges(facets.corners, facets.corner_start)


def pitch_mm(facets: Facets) -> tuple[float, float]:
    """Least and greatest distance between neighbouring pixels of the enabled facets, millimetres."""
    return pitch_of(facets.du[facets.enabled], facets.dv[facets.enabled])


def pitch_of(du: FloatArray, dv: FloatArray) -> tuple[float, float]:
    """Least and greatest length of steps (F, 3) to the next pixel right and down, millimetres."""
    steps = np.concatenate((du, dv))
    if not len(steps):
        return 0.0, 0.0
    pitch = np.sqrt(dot(steps, steps)) * 1000
    return float(pitch.min()), float(pitch.max())
