"""Bring a layout and its display together: the same facets, in the same order."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import FloatArray, IntArray, dot, segments
from quiltcli.layout.layout import Layout, whole_pixel

_OFF_PLANE = 2e-4  # of a facet's size: twice what a face may be out of plane


def align(layout: Layout, facets: Facets) -> Layout:
    """The layout with one row for every facet of the display, in the display's order.

    From here on it is the layout that is asked which pixels there are and where they lie in the world.
    The rasters of the display are those it was to be packed with; where a layout has others, as one
    from texture coordinates has, the layout is right. Disabled facets get page −1 and the display's raster.

    Returns:
        the layout with `facet` = 1 … F.

    Raises:
        LayoutError: made for other geometry, an unknown facet, an enabled facet without a place, or
            a raster that does not lie on its facet; all that is found, together.
    """
    raise_all(LayoutError, _strangers(layout, facets))
    raise_all(LayoutError, misfits(layout, facets))
    raise_all(LayoutError, _sheared(layout, facets))
    raise_all(LayoutError, _renamed(layout, facets))
    row = np.full(facets.count, -1)
    row[layout.facet - 1] = np.arange(layout.facet.size)
    known = row >= 0

    def taken(ours: FloatArray, theirs: FloatArray) -> FloatArray:
        return np.asarray(np.where(known[:, None], ours[row], theirs))

    return replace(
        layout,
        facet=np.arange(1, facets.count + 1, dtype=np.int32),
        page=np.where(known & facets.enabled, layout.page[row], -1).astype(np.int32),
        size=np.where(known[:, None], layout.size[row], facets.size).astype(np.int32),
        quilt_from_facet=np.where(known[:, None, None], layout.quilt_from_facet[row], np.eye(2, 3)),
        origin=taken(layout.origin, facets.origin),
        du=taken(layout.du, facets.du),
        dv=taken(layout.dv, facets.dv),
        corner_start=facets.corner_start,
        polygon=_polygons(layout, facets, row),
        file_row=None if layout.file_row is None else np.where(known, layout.file_row[row], 0),
        surfaces=surface_names(facets),
        masks={
            number: chart.mask
            for number, chart in enumerate(facets.charts, 1)
            if chart is not None and chart.mask is not None
        },
    )


def surface_names(facets: Facets) -> dict[int, str]:
    """What curved facets are called in a layout, by id: their names, or else their kinds."""
    return {
        number: facets.names[number - 1] or str(json.loads(chart.record)["kind"])
        for number, chart in enumerate(facets.charts, 1)
        if chart is not None
    }


def _renamed(layout: Layout, facets: Facets) -> Iterator[Problem]:
    """Curved facets that the layout calls by another name than the display."""
    names = surface_names(facets)
    for row, facet in enumerate(layout.facet.tolist()):
        said, known = layout.surfaces.get(facet, ""), names.get(facet, "")
        if said and said != known:
            what = f"the surface {known!r}" if known else "flat"
            message = f"facet {facet} is the surface {said!r} here, and {what} in {facets.path}"
            yield layout.problem(message, row, "surface")


def _sheared(layout: Layout, facets: Facets) -> Iterator[Problem]:
    """Curved facets whose pixels are not the quilt's: theirs are what has places in the world."""
    if not facets.charts:
        return
    curved = facets.curved[layout.facet - 1] & (layout.page >= 0)
    for row in np.flatnonzero(curved & ~whole_pixel(layout)).tolist():
        message = f"facet {layout.facet[row]} is curved, and must move by whole pixels and quarter turns"
        yield layout.problem(message, row, "quilt_from_facet")


def _polygons(layout: Layout, facets: Facets, row: IntArray) -> FloatArray:
    """Corners in facet pixels: the layout's where it has the facet, the display's otherwise."""
    corners = corner_pixels(facets)
    for facet in np.flatnonzero(row >= 0):
        corners[facets.corner_start[facet] : facets.corner_start[facet + 1]] = layout.outline(row[facet])
    return corners


def _strangers(layout: Layout, facets: Facets) -> Iterator[Problem]:
    """What shows that the layout belongs to another display."""
    if layout.display_sha256 and layout.display_sha256 != facets.sha256:
        yield layout.problem(
            f"made for other geometry: found the hash {layout.display_sha256[:12]}…, but {facets.path}"
            f" has {facets.sha256[:12]}…; run quilt pack again",
            key="display_sha256",
        )
    known = np.zeros(facets.count, dtype=bool)
    for row, facet in enumerate(layout.facet):
        if not 1 <= facet <= facets.count:
            message = f"facet {facet} is not in {facets.path}, which has facets 1 to {facets.count}"
            yield layout.problem(message, row, "id")
        else:
            known[facet - 1] |= layout.page[row] >= 0
    for facet in np.flatnonzero(facets.enabled & ~known):
        name = f" ({facets.names[facet]})" if facets.names[facet] else ""
        message = f"facet {facet + 1}{name} of {facets.path} has no place; run quilt pack again, or"
        yield layout.problem(f"{message} disable it", key="facets")


def misfits(layout: Layout, facets: Facets) -> Iterator[Problem]:
    """Rasters and polygons that do not lie on the display's facets."""
    counts, expected = np.diff(layout.corner_start), np.diff(facets.corner_start)[layout.facet - 1]
    for at in np.flatnonzero(counts != expected):
        yield layout.problem(
            f"facet {layout.facet[at]} has {counts[at]} corners, but {expected[at]} in {facets.path}",
            int(at),
            "polygon",
        )
    if (counts != expected).any():
        return
    row, rank = segments(layout.corner_start)
    i, j = layout.polygon[:, :1], layout.polygon[:, 1:]
    here = layout.origin[row] + i * layout.du[row] + j * layout.dv[row]
    there = facets.corners[facets.corner_start[layout.facet - 1][row] + rank]
    away = np.sqrt(dot(here - there, here - there))
    extent = np.linalg.norm(layout.du, axis=1) * layout.size[:, 0]
    extent = np.maximum(extent, np.linalg.norm(layout.dv, axis=1) * layout.size[:, 1])
    bad = away > _OFF_PLANE * extent[row]
    for at in np.flatnonzero(bad):
        if not bad[layout.corner_start[row[at]] : at].any():
            yield layout.problem(
                f"facet {layout.facet[row[at]]}: corner {rank[at] + 1} lies {away[at]:.6g} m from where"
                f" {facets.path} has it; origin, du, dv and polygon must agree with the display",
                int(row[at]),
                "origin",
            )
