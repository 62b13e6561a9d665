"""Strict checks of a layout by itself: every problem is found, not only the first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, cross, dot, segments
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
    before = np.concatenate(([0], layout.facet[:-1]))
    for row in np.flatnonzero((layout.facet < 1) | (layout.facet == before)).tolist():
        facet = layout.facet[row]
        if facet < 1:
            yield layout.problem(f"facet id {facet}; ids count from 1", row, "id")
        else:
            yield layout.problem(f"facet {facet} is placed twice; an id may occur once", row, "id")


def _bad_page_numbers(layout: Layout) -> Iterator[Problem]:
    count = layout.pages.shape[0]
    for row in np.flatnonzero(layout.page >= count).tolist():
        facet, page = layout.facet[row], layout.page[row] + 1
        yield layout.problem(f"facet {facet} is on page {page}, but there are only {count}", row, "page")


def _bad_numbers(layout: Layout) -> Iterator[Problem]:
    """Rows with numbers that make no sense; most layouts have none, so all rows are looked at at once."""
    if layout.facet.size == 0:
        return
    counts = np.diff(layout.corner_start)
    odd = (layout.size < 1).any(axis=1) | (counts < 3)
    for key in _NUMBERS:
        odd |= ~np.isfinite(getattr(layout, key)).reshape(len(odd), -1).all(axis=1)
    corner_row, _ = segments(layout.corner_start)
    odd[corner_row[~np.isfinite(layout.polygon).all(axis=1)]] = True
    with np.errstate(invalid="ignore", over="ignore"):  # of numbers that are not finite
        squeezed, area = _squeezed(layout)
        flat = _flat(layout)
    for row in np.flatnonzero(odd | squeezed | flat).tolist():
        yield from _bad_row(layout, row)
        facet, key = layout.facet[row], "quilt_from_facet"
        if squeezed[row]:
            message = f"facet {facet} is squeezed to a line; the determinant of {key} is {area[row]:g}"
            yield layout.problem(message, row, key)
        if flat[row]:
            yield layout.problem(f"facet {facet} has no area in the world: du and dv are parallel", row, "du")


def _bad_row(layout: Layout, row: int) -> Iterator[Problem]:
    facet, (width, height) = layout.facet[row], layout.size[row]
    if width < 1 or height < 1:
        yield layout.problem(
            f"facet {facet} is {width}×{height} pixels; both must be at least 1", row, "size"
        )
    for key in _NUMBERS:
        if not np.isfinite(getattr(layout, key)[row]).all():
            yield layout.problem(f"facet {facet} has numbers in {key} that are not finite", row, key)
    corners = layout.outline(row)
    if len(corners) < 3:
        message = f"facet {facet} has {len(corners)} corners; a polygon has at least 3"
        yield layout.problem(message, row, "polygon")
    if not np.isfinite(corners).all():
        yield layout.problem(f"facet {facet} has corners that are not finite", row, "polygon")


def _squeezed(layout: Layout) -> tuple[BoolArray, FloatArray]:
    """Facets (F,) whose map makes a line of them, and the area (F,) it makes of a pixel."""
    linear = layout.quilt_from_facet[:, :, :2]
    area = np.abs(linear[:, 0, 0] * linear[:, 1, 1] - linear[:, 0, 1] * linear[:, 1, 0])
    return area <= 1e-12 * (linear * linear).sum(axis=(1, 2)), area


def _flat(layout: Layout) -> BoolArray:
    """Facets (F,) without an area in the world."""
    normal = cross(layout.du, layout.dv)
    length2 = dot(layout.du, layout.du) + dot(layout.dv, layout.dv)
    return np.asarray(np.sqrt(dot(normal, normal)) <= 1e-12 * length2)


def _outside_raster(layout: Layout) -> Iterator[Problem]:
    """Corners of a polygon outside its own W × H raster."""
    row_of, _ = segments(layout.corner_start)
    for row, corner, (x, y) in _first_outside(layout, layout.polygon, layout.size[row_of]):
        width, height = layout.size[row]
        yield layout.problem(
            f"facet {layout.facet[row]}: corner {corner + 1} at ({x:.6g}, {y:.6g}) lies outside"
            f" its raster of {width}×{height} pixels",
            row,
            "polygon",
        )


def _outside_page(layout: Layout) -> Iterator[Problem]:
    """Facets that reach over the edge of their page.

    A facet that is copied pixel by pixel must have its whole raster on the page, another only its polygon.
    """
    row_of, _ = segments(layout.corner_start)
    on = layout.page >= 0
    sizes = np.where(on[row_of, None], layout.pages[layout.page[row_of]], np.iinfo(np.int32).max)
    quilt = np.where(on[row_of, None], quilt_polygons(layout), 0.0)
    outside = {row: (corner, at) for row, corner, at in _first_outside(layout, quilt, sizes)}
    copied = on & whole_pixel(layout) & ~facet_pixels_inside_page(layout)
    for row in sorted({*outside, *np.flatnonzero(copied).tolist()}):
        page = int(layout.page[row])
        width, height = layout.pages[page]
        message = f"facet {layout.facet[row]}: its raster reaches outside page {page + 1}"
        if row in outside:
            corner, (x, y) = outside[row]
            message = (
                f"facet {layout.facet[row]}: corner {corner + 1} at ({x:.6g}, {y:.6g}) lies outside"
                f" page {page + 1}"
            )
        yield layout.problem(f"{message} of {width}×{height} pixels", row, "quilt_from_facet")


def _first_outside(
    layout: Layout, corners: FloatArray, size: Int32Array
) -> Iterator[tuple[int, int, tuple[float, float]]]:
    """Rows with corners (C, 2) outside a size (C, 2): the row, its first such corner, and where that is."""
    row_of, rank = segments(layout.corner_start)
    outside = ((corners < -PIXEL_TOLERANCE) | (corners > size + PIXEL_TOLERANCE)).any(axis=1)
    at = np.flatnonzero(outside)
    for first in at[np.diff(row_of[at], prepend=-1) > 0].tolist():
        x, y = corners[first].tolist()
        yield int(row_of[first]), int(rank[first]), (x, y)


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
