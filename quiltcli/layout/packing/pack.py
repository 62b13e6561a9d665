"""From a display to a layout: choose the page, make the attempts, write down the transforms."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.display.weld import weld
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import Int32Array, IntArray, offsets, segments
from quiltcli.job.layout import PACKING_METHODS, PackSpec
from quiltcli.layout.align import surface_names
from quiltcli.layout.from_uv import layout_from_polygons
from quiltcli.layout.layout import Layout
from quiltcli.layout.packing.methods import METHODS, has_all_arrangements
from quiltcli.layout.packing.model import PackInput, PackResult, page_count, quilt_from_facet
from quiltcli.layout.packing.pins import all_pins, free_rooms, joined
from quiltcli.layout.packing.rectangles.few import fewest_of_few, smallest_of_few
from quiltcli.layout.packing.search import best_page, best_pages, largest_page
from quiltcli.layout.packing.shortage import shortage

_MOST_PROBLEMS = 10


def pack(facets: Facets, wishes: PackSpec | None = None) -> Layout:
    """Lay out the display's enabled facets on pages of a quilt; only `net` takes new rasters for them.

    Facets of the layout that `pins` names stay where they are there, and those whose place the display
    file gives where it has them; the others are packed around them.

    Args:
        facets: the display; a facet's raster is placed as it is, or turned by quarter turns.
        wishes: what the layout is to be like; the defaults when None.

    Raises:
        JobError, LayoutError: the layout of the pins cannot be read, does not belong to the display, or
            meets the places of the display file.
        LayoutError: a facet is larger than the page, or there are more pages than allowed; the message
            says what would do.
    """
    layout = _packed_layout(facets, wishes or PackSpec())
    return replace(layout, surfaces=surface_names(facets)) if facets.charts else layout


def _packed_layout(facets: Facets, wishes: PackSpec) -> Layout:
    """The layout but for names; see `pack`."""
    raise_all(LayoutError, _bad_arguments(facets, wishes))
    pins = all_pins(facets, wishes)
    waiting = facets.enabled.copy()
    if pins is not None:
        waiting[pins.facet - 1] = False
        last = (int(pins.pages[-1, 0]), int(pins.pages[-1, 1]))
        wishes = wishes.model_copy(update={"size": wishes.size or last})
    rows = np.flatnonzero(waiting)
    raise_all(LayoutError, _too_large(facets, rows, wishes))
    if pins is not None and not rows.size:
        return replace(
            pins,
            display=facets.path,
            display_sha256=facets.sha256,
            packed=None,
            path="",
            place=None,
            file_row=None,
        )
    groups = list(_groups(facets, rows, wishes))
    if len(groups) > 1:
        return _stacked(facets, groups, wishes)
    wanted = _pack_input(facets, rows, wishes)
    if pins is not None:
        smallest = int(wanted.size.min())
        rooms = free_rooms(pins, wishes.padding, wishes.align, smallest)
        wanted = replace(wanted, rooms=rooms, begun=len(pins.pages))
    result, size = _packed(wanted, wishes)
    needed = max(page_count(result), wanted.begun)
    if wishes.max_pages is not None and needed > wishes.max_pages:
        raise LayoutError(Problem(shortage(wanted, result, wishes, size), file=facets.path))
    layout = _layout(facets, rows, wanted, result, size, wishes.method)
    return layout if pins is None else joined(pins, layout)


def _packed(wanted: PackInput, wishes: PackSpec) -> tuple[PackResult, tuple[int, int]]:
    """Places and page size."""
    method = PACKING_METHODS[wishes.method]
    if has_all_arrangements(method, wanted):
        if wishes.size is not None:
            return fewest_of_few(wanted), wishes.size
        found = smallest_of_few(wanted, wishes.aspect)
        if found is not None:
            return found
    searches = METHODS[method](wanted, wishes.seconds)
    if wishes.size is not None:
        return best_pages(searches, wanted, wishes.seconds), wishes.size
    return best_page(searches, wanted, wishes.seconds, wishes.aspect)


def _groups(facets: Facets, rows: IntArray, wishes: PackSpec) -> Iterator[IntArray]:
    """Facets of consecutive ids that keep the limits of a page together; all of them without limits."""
    if wishes.page_facets is None and wishes.page_pixels is None:
        yield rows
        return
    pixels = facets.size[rows].astype(np.int64).prod(axis=1)
    start = 0
    while start < len(rows):
        end = start + (wishes.page_facets or len(rows))
        if wishes.page_pixels is not None:
            total = np.cumsum(pixels[start:])
            end = min(end, start + int(np.searchsorted(total, wishes.page_pixels, side="right")))
        yield rows[start:end]
        start = end


def _stacked(facets: Facets, groups: Sequence[IntArray], wishes: PackSpec) -> Layout:
    """A layout whose groups each begin a page."""
    alone = wishes.model_copy(update={"page_facets": None, "page_pixels": None, "max_pages": None})
    whole: Layout | None = None
    for group in groups:
        enabled = np.zeros(facets.count, dtype=np.bool_)
        enabled[group] = True
        layout = pack(replace(facets, enabled=enabled), alone)
        if whole is not None:
            before = np.zeros_like(whole.pages)
            layout = replace(
                layout,
                page=layout.page + len(whole.pages),
                pages=np.concatenate((before, layout.pages)),
            )
            layout = joined(whole, layout)
        whole = layout
    assert whole is not None
    needed = len(whole.pages)
    if wishes.max_pages is not None and needed > wishes.max_pages:
        width, height = whole.pages[0]
        raise LayoutError(
            Problem(
                f"{len(whole.facet)} facets take {needed} pages of {width}×{height} pixels within the limits"
                f" of a page, but at most {wishes.max_pages} may be used",
                file=facets.path,
            )
        )
    return whole


def _bad_arguments(facets: Facets, wishes: PackSpec) -> Iterator[Problem]:
    if not facets.enabled.any():
        yield Problem("no facet is enabled, so there is nothing to pack", file=facets.path)
    limited = wishes.page_facets is not None or wishes.page_pixels is not None
    if limited and facets.places is not None:
        facet = int(facets.places.facet[0])
        message = "a facet with a place and limits of a page cannot be combined"
        yield facets.places.problem(("facets", facet), message)
    if wishes.page_pixels is not None:
        pixels = facets.size.astype(np.int64).prod(axis=1)
        for row in np.flatnonzero(facets.enabled & (pixels > wishes.page_pixels))[:_MOST_PROBLEMS]:
            yield Problem(
                f"{_facet(facets, int(row))} has {pixels[row]} pixels,"
                f" more than the {wishes.page_pixels} of a page",
                file=facets.path,
            )


def _facet(facets: Facets, row: int) -> str:
    return f"facet {row + 1}" + (f" ({facets.names[row]})" if facets.names[row] else "")


def _too_large(facets: Facets, rows: IntArray, wishes: PackSpec) -> Iterator[Problem]:
    """Facets that no turn makes fit, with the page or density that would hold them."""
    width, height = wishes.size or largest_page(wishes.aspect)
    limit = sorted((width, height))
    sides = np.sort(facets.size[rows], axis=1)
    large = np.flatnonzero((sides > limit).any(axis=1))
    for at in large[:_MOST_PROBLEMS]:
        row = int(rows[at])
        w, h = facets.size[row]
        density = 100 * min(limit[0] / sides[at, 0], limit[1] / sides[at, 1])
        yield Problem(
            f"{_facet(facets, row)} is {w}×{h} pixels, more than a {width}×{height} page holds turned or not;"
            f" a page of {sides[:, 1].max()}×{sides[:, 0].max()} would, or a density of at most"
            f" {math.floor(density * 10) / 10:g} % of the present one",
            file=facets.path,
        )
    if large.size > _MOST_PROBLEMS:
        yield Problem(f"{large.size - _MOST_PROBLEMS} more facets are larger than the page", file=facets.path)


def _pack_input(facets: Facets, rows: IntArray, wishes: PackSpec) -> PackInput:
    corner_row, _ = segments(facets.corner_start)
    mine = np.zeros(facets.count, dtype=np.bool_)
    mine[rows] = True
    return PackInput(
        size=facets.size[rows],
        corner_start=offsets(np.diff(facets.corner_start)[rows]),
        polygon=corner_pixels(facets)[mine[corner_row]],
        page=wishes.size or largest_page(wishes.aspect),
        padding=wishes.padding,
        align=wishes.align,
        mirror=wishes.mirror,
        vertex=weld(facets.corners)[mine[corner_row]] if wishes.method == "net" else None,
    )


def _layout(
    facets: Facets,
    rows: IntArray,
    wanted: PackInput,
    result: PackResult,
    size: tuple[int, int],
    method: str,
) -> Layout:
    pages = np.array([size] * max(page_count(result), wanted.begun), dtype=np.int32)
    if result.polygon is not None:
        return _layout_of_polygons(facets, rows, wanted, result, pages, method)
    return Layout(
        facet=(rows + 1).astype(np.int32),
        page=result.page.astype(np.int32),
        size=facets.size[rows],
        quilt_from_facet=quilt_from_facet(wanted.size, result),
        origin=facets.origin[rows],
        du=facets.du[rows],
        dv=facets.dv[rows],
        corner_start=wanted.corner_start,
        polygon=wanted.polygon,
        pages=pages,
        padding=wanted.padding,
        method=method,
        display=facets.path,
        display_sha256=facets.sha256,
    )


def _layout_of_polygons(
    facets: Facets, rows: IntArray, wanted: PackInput, result: PackResult, pages: Int32Array, method: str
) -> Layout:
    """Rasters taken from the quilt, where facets lie at any angle."""
    assert result.polygon is not None
    corner_row, _ = segments(facets.corner_start)
    page = np.full(facets.count, -1, dtype=np.int32)
    page[rows] = result.page
    quilt = np.zeros((len(corner_row), 2))
    quilt[page[corner_row] >= 0] = result.polygon
    return layout_from_polygons(facets, quilt, page, pages, padding=wanted.padding, method=method)
