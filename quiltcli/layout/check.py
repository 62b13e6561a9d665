"""Strict checks of a layout by itself: every problem is found, not only the first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import FloatArray, Int32Array
from quiltcli.layout.layout import (
    PIXEL_TOLERANCE,
    Layout,
    facet_pixels_inside_page,
    quilt_polygons,
    whole_pixel,
)
from quiltcli.layout.spans import facet_spans, overlaps

_MOST_OVERLAPS = 20
_NUMBERS = ("quilt_from_facet", "origin", "du", "dv")


def check_layout(layout: Layout) -> None:
    """Raise one `LayoutError` that holds everything wrong with the layout."""
    raise_all(LayoutError, layout_problems(layout))


def layout_problems(layout: Layout) -> list[Problem]:
    """Everything wrong with the layout by itself, in the order of pages, facets, then overlaps.

    Places and overlaps are looked at only in a layout whose numbers make sense.
    """
    found = [*_bad_pages(layout), *_bad_ids(layout), *_bad_page_numbers(layout), *_bad_numbers(layout)]
    if not found:
        found = [*_outside_raster(layout), *_outside_page(layout)]
        found += _overlapping(layout)
    return found


def _bad_pages(layout: Layout) -> Iterator[Problem]:
    if layout.pages.shape[0] == 0:
        yield layout.problem("no pages; a layout needs at least one", key="pages")
    if layout.facet.size == 0:
        yield layout.problem("no facets; a layout needs at least one", key="facets")
    for page, (width, height) in enumerate(layout.pages, 1):
        if width < 1 or height < 1:
            yield layout.problem(f"page {page} is {width}×{height} pixels; both must be at least 1")


def _bad_ids(layout: Layout) -> Iterator[Problem]:
    for row, facet in enumerate(layout.facet):
        if facet < 1:
            yield layout.problem(f"facet id {facet}; ids count from 1", row, "id")
        elif row and facet == layout.facet[row - 1]:
            yield layout.problem(f"facet {facet} is placed twice; an id may occur once", row, "id")


def _bad_page_numbers(layout: Layout) -> Iterator[Problem]:
    count = layout.pages.shape[0]
    for row in np.flatnonzero(layout.page >= count).tolist():
        facet, page = layout.facet[row], layout.page[row] + 1
        yield layout.problem(f"facet {facet} is on page {page}, but there are only {count}", row, "page")


def _bad_numbers(layout: Layout) -> Iterator[Problem]:
    for row, facet in enumerate(layout.facet):
        width, height = layout.size[row]
        if width < 1 or height < 1:
            yield layout.problem(
                f"facet {facet} is {width}×{height} pixels; both must be at least 1", row, "size"
            )
        for key in _NUMBERS:
            if not np.isfinite(getattr(layout, key)[row]).all():
                yield layout.problem(f"facet {facet} has numbers in {key} that are not finite", row, key)
        corners = layout.polygon[layout.corner_start[row] : layout.corner_start[row + 1]]
        if len(corners) < 3:
            message = f"facet {facet} has {len(corners)} corners; a polygon has at least 3"
            yield layout.problem(message, row, "polygon")
        if not np.isfinite(corners).all():
            yield layout.problem(f"facet {facet} has corners that are not finite", row, "polygon")
        yield from _singular(layout, row)


def _singular(layout: Layout, row: int) -> Iterator[Problem]:
    linear = layout.quilt_from_facet[row, :, :2]
    area = abs(linear[0, 0] * linear[1, 1] - linear[0, 1] * linear[1, 0])
    if area <= 1e-12 * (linear * linear).sum():
        facet, key = layout.facet[row], "quilt_from_facet"
        message = f"facet {facet} is squeezed to a line; the determinant of {key} is {area:g}"
        yield layout.problem(message, row, key)
    raster = np.stack((layout.du[row], layout.dv[row]))
    area = float(np.linalg.norm(np.cross(raster[0], raster[1])))
    if area <= 1e-12 * (raster * raster).sum():
        yield layout.problem(
            f"facet {layout.facet[row]} has no area in the world: du and dv are parallel", row, "du"
        )


def _outside_raster(layout: Layout) -> Iterator[Problem]:
    """Corners of a polygon outside its own W × H raster."""
    for row, facet in enumerate(layout.facet):
        corners = layout.polygon[layout.corner_start[row] : layout.corner_start[row + 1]]
        outside = _first_outside(corners, layout.size[row])
        if outside >= 0:
            x, y = corners[outside]
            width, height = layout.size[row]
            yield layout.problem(
                f"facet {facet}: corner {outside + 1} at ({x:.6g}, {y:.6g}) lies outside"
                f" its raster of {width}×{height} pixels",
                row,
                "polygon",
            )


def _outside_page(layout: Layout) -> Iterator[Problem]:
    """Facets that reach over the edge of their page.

    A facet that is copied pixel by pixel must have its whole raster on the page, another only its polygon.
    """
    quilt = quilt_polygons(layout)
    copied = whole_pixel(layout) & ~facet_pixels_inside_page(layout)
    for row, facet in enumerate(layout.facet):
        if layout.page[row] < 0:
            continue
        page = int(layout.page[row])
        width, height = layout.pages[page]
        corners = quilt[layout.corner_start[row] : layout.corner_start[row + 1]]
        outside = _first_outside(corners, layout.pages[page])
        if outside >= 0:
            x, y = corners[outside]
            message = (
                f"facet {facet}: corner {outside + 1} at ({x:.6g}, {y:.6g}) lies outside page {page + 1}"
            )
        elif copied[row]:
            message = f"facet {facet}: its raster reaches outside page {page + 1}"
        else:
            continue
        yield layout.problem(f"{message} of {width}×{height} pixels", row, "quilt_from_facet")


def _first_outside(corners: FloatArray, size: Int32Array) -> int:
    outside = ((corners < -PIXEL_TOLERANCE) | (corners > size + PIXEL_TOLERANCE)).any(axis=1)
    return int(np.argmax(outside)) if outside.any() else -1


def _overlapping(layout: Layout) -> Iterator[Problem]:
    found = overlaps(facet_spans(layout))
    for overlap in found[:_MOST_OVERLAPS]:
        page = int(np.searchsorted(layout.page_offset, overlap.first, side="right")) - 1
        y, x = divmod(overlap.first - int(layout.page_offset[page]), int(layout.pages[page, 0]))
        a, b = layout.facet[overlap.row_a], layout.facet[overlap.row_b]
        pixels = "1 pixel" if overlap.pixels == 1 else f"{overlap.pixels} pixels"
        message = f"facets {a} and {b} overlap in {pixels}, the first at ({x}, {y}) of page {page + 1}"
        yield layout.problem(message, overlap.row_b, "quilt_from_facet")
    if len(found) > _MOST_OVERLAPS:
        yield layout.problem(f"{len(found) - _MOST_OVERLAPS} more pairs of facets overlap")
