"""From a display to a layout: choose the page, make the attempts, write down the transforms."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.display.weld import weld
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import Int32Array, IntArray, segments
from quiltcli.layout.from_uv import layout_from_polygons
from quiltcli.layout.layout import Layout
from quiltcli.layout.packing.methods import DEFAULT_METHOD, METHODS
from quiltcli.layout.packing.model import PackInput, PackResult, page_count, quilt_from_facet
from quiltcli.layout.packing.pins import all_pins, free_rooms, joined
from quiltcli.layout.packing.search import best_page, best_pages, largest_page
from quiltcli.layout.packing.shortage import shortage
from quiltcli.layout.packing.wishes import DEFAULT_SECONDS, Target, bad_target

_MOST_PROBLEMS = 10


def pack(
    facets: Facets,
    method: str = DEFAULT_METHOD,
    size: tuple[int, int] | None = None,
    padding: int = 2,
    max_pages: int | None = None,
    *,
    aspect: Fraction | None = None,
    align: int = 1,
    mirror: bool = False,
    page_facets: int | None = None,
    page_pixels: int | None = None,
    pins: Layout | None = None,
    seconds: float = DEFAULT_SECONDS,
) -> Layout:
    """Lay out the display's enabled facets on pages of a quilt; only `net` takes new rasters for them.

    Args:
        facets: the display; a facet's raster is placed as it is, or turned by quarter turns.
        method: a name of `METHODS`.
        size: page width and height in pixels; None chooses one page that holds everything.
        padding: pixels to keep free between facets.
        max_pages: most pages to take; None takes as many as are needed.
        aspect: width / height of the page that is chosen; None for any.
        align: top-left pixels of placed rasters lie at multiples of this.
        mirror: whether `nest` and `auto` may mirror rasters.
        page_facets: most facets on a page.
        page_pixels: most raster pixels on a page, what a sending card or port takes.
        pins: a layout whose facets stay where they are; the others are packed around them, and around
            those whose place the display file gives.
        seconds: effort, in seconds on a slow computer; the result depends on it, but on no clock.

    Raises:
        LayoutError: an argument makes no sense, a facet is larger than the page, or there are more
            pages than allowed; the message says what would do.
    """
    target = Target(
        method, size, padding, max_pages, aspect, align, mirror, page_facets, page_pixels, pins, seconds
    )
    return pack_target(facets, target)


def pack_target(facets: Facets, target: Target) -> Layout:
    """As `pack`, of a target."""
    raise_all(LayoutError, _bad_arguments(facets, target))
    pins = all_pins(facets, target)
    waiting = facets.enabled.copy()
    if pins is not None:
        waiting[pins.facet - 1] = False
        target = replace(target, size=target.size or (int(pins.pages[-1, 0]), int(pins.pages[-1, 1])))
    rows = np.flatnonzero(waiting)
    raise_all(LayoutError, _too_large(facets, rows, target))
    if pins is not None and not rows.size:
        return replace(
            pins, display=facets.path, display_sha256=facets.sha256, path="", place=None, file_row=None
        )
    groups = list(_groups(facets, rows, target))
    if len(groups) > 1:
        return _stacked(facets, groups, target)
    wanted = _pack_input(facets, rows, target)
    if pins is not None:
        smallest = int(wanted.size.min())
        rooms = free_rooms(pins, target.padding, target.align, smallest)
        wanted = replace(wanted, rooms=rooms, begun=len(pins.pages))
    result, size = _packed(wanted, target)
    needed = max(page_count(result), wanted.begun)
    if target.max_pages is not None and needed > target.max_pages:
        raise LayoutError(Problem(shortage(wanted, result, target, size), file=facets.path))
    layout = _layout(facets, rows, wanted, result, size, target.method)
    return layout if pins is None else joined(pins, layout)


def _packed(wanted: PackInput, target: Target) -> tuple[PackResult, tuple[int, int]]:
    """Places and page size."""
    searches = METHODS[target.method](wanted, target.seconds)
    if target.size is not None:
        return best_pages(searches, wanted, target.seconds), target.size
    return best_page(searches, wanted, target.seconds, target.aspect)


def _groups(facets: Facets, rows: IntArray, target: Target) -> Iterator[IntArray]:
    """Facets of consecutive ids that keep the limits of a page together; all of them without limits."""
    if target.page_facets is None and target.page_pixels is None:
        yield rows
        return
    pixels = facets.size[rows].astype(np.int64).prod(axis=1)
    start = 0
    while start < len(rows):
        end = start + (target.page_facets or len(rows))
        if target.page_pixels is not None:
            total = np.cumsum(pixels[start:])
            end = min(end, start + int(np.searchsorted(total, target.page_pixels, side="right")))
        yield rows[start:end]
        start = end


def _stacked(facets: Facets, groups: Sequence[IntArray], target: Target) -> Layout:
    """A layout whose groups each begin a page."""
    alone = replace(target, page_facets=None, page_pixels=None, max_pages=None)
    whole: Layout | None = None
    for group in groups:
        enabled = np.zeros(facets.count, dtype=np.bool_)
        enabled[group] = True
        layout = pack_target(replace(facets, enabled=enabled), alone)
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
    if target.max_pages is not None and needed > target.max_pages:
        width, height = whole.pages[0]
        raise LayoutError(
            Problem(
                f"{len(whole.facet)} facets take {needed} pages of {width}×{height} pixels within the limits"
                f" of a page, but at most {target.max_pages} may be used",
                file=facets.path,
            )
        )
    return whole


def _bad_arguments(facets: Facets, target: Target) -> Iterator[Problem]:
    yield from bad_target(target)
    if not facets.enabled.any():
        yield Problem("no facet is enabled, so there is nothing to pack", file=facets.path)
    limited = target.page_facets is not None or target.page_pixels is not None
    if limited and facets.places is not None:
        facet = int(facets.places.facet[0])
        message = "a facet with a place and limits of a page cannot be combined"
        yield facets.places.problem(("facets", facet), message)
    if target.page_pixels is not None and target.page_pixels >= 1:
        pixels = facets.size.astype(np.int64).prod(axis=1)
        for row in np.flatnonzero(facets.enabled & (pixels > target.page_pixels))[:_MOST_PROBLEMS]:
            yield Problem(
                f"{_facet(facets, int(row))} has {pixels[row]} pixels,"
                f" more than the {target.page_pixels} of a page",
                file=facets.path,
            )


def _facet(facets: Facets, row: int) -> str:
    return f"facet {row + 1}" + (f" ({facets.names[row]})" if facets.names[row] else "")


def _too_large(facets: Facets, rows: IntArray, target: Target) -> Iterator[Problem]:
    """Facets that no turn makes fit, with the page or density that would hold them."""
    width, height = target.size or largest_page(target.aspect)
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


def _pack_input(facets: Facets, rows: IntArray, target: Target) -> PackInput:
    corner_row, _ = segments(facets.corner_start)
    mine = np.zeros(facets.count, dtype=np.bool_)
    mine[rows] = True
    return PackInput(
        size=facets.size[rows],
        corner_start=np.concatenate(([0], np.cumsum(np.diff(facets.corner_start)[rows]))),
        polygon=corner_pixels(facets)[mine[corner_row]],
        page=target.size or largest_page(target.aspect),
        padding=target.padding,
        align=target.align,
        mirror=target.mirror,
        vertex=weld(facets.corners)[mine[corner_row]] if target.method == "net" else None,
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
