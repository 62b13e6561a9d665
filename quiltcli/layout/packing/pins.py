"""Facets that stay where an existing layout or the display file has them, and the rooms that leaves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import IntArray, offsets, segments
from quiltcli.job.layout import PackSpec
from quiltcli.layout.align import misfits
from quiltcli.layout.check import check_layout
from quiltcli.layout.file import read_layout
from quiltcli.layout.layout import Layout, quilt_polygons
from quiltcli.layout.packing.model import PackResult, Room, quilt_from_facet
from quiltcli.layout.packing.rectangles.maxrects import without

_MOST_ROOMS = 64  # a page


def all_pins(facets: Facets, wishes: PackSpec) -> Layout | None:
    """Everything that is to stay: what the layout of the pins has, and what the display file gives a place.

    A facet that has both stays where the layout has it.

    Raises:
        LayoutError: they do not belong to the display, meet each other, or lie outside their pages.
    """
    given = pinned(read_layout(wishes.pins), facets) if wishes.pins is not None else None
    own = _placed_by_display(facets, given, wishes)
    if own is None:
        return given if given is not None and len(given.facet) else None
    both = own if given is None or not len(given.facet) else joined(given, own)
    check_layout(replace(both, place=own.place, file_row=both.facet.astype(np.int64)))
    return both


def _placed_by_display(facets: Facets, given: Layout | None, wishes: PackSpec) -> Layout | None:
    """The facets whose place the display file gives, as a layout; None when it gives none."""
    places = facets.places
    if places is None:
        return None
    row = places.facet - 1
    free = facets.enabled[row] & ~np.isin(places.facet, given.facet if given is not None else [])
    on = np.flatnonzero(free)
    if not on.size:
        return None
    size = wishes.size or (given.pages[-1] if given is not None and len(given.facet) else places.page_size)
    if size is None:
        message = "a facet with a place needs a page of a given size (--size, or size under layout:)"
        raise LayoutError(places.problem(("facets", int(places.facet[on[0]])), message))
    odd = on[(places.corner[on] % wishes.align > 0).any(axis=1)]
    raise_all(
        LayoutError,
        (
            places.problem(
                ("facets", int(places.facet[at])),
                f"pixel ({places.corner[at, 0]}, {places.corner[at, 1]}) is no multiple of the"
                f" alignment to {wishes.align}",
            )
            for at in odd
        ),
    )
    begun = [] if given is None or not len(given.facet) else given.pages.tolist()
    count = max(len(begun), int(places.page[on].max()) + 1)
    row = row[on]
    corner_row, _ = segments(facets.corner_start)
    result = PackResult(places.page[on], places.turn[on], places.mirror[on], places.corner[on])
    return Layout(
        facet=places.facet[on],
        page=places.page[on],
        size=facets.size[row],
        quilt_from_facet=quilt_from_facet(facets.size[row], result),
        origin=facets.origin[row],
        du=facets.du[row],
        dv=facets.dv[row],
        corner_start=offsets(np.diff(facets.corner_start)[row]),
        polygon=corner_pixels(facets)[np.isin(corner_row, row)],
        pages=np.array([*begun, *[size] * (count - len(begun))], dtype=np.int32),
        padding=wishes.padding,
        method=wishes.method,
        display=facets.path,
        display_sha256=facets.sha256,
        place=places,
        file_row=places.facet[on].astype(np.int64),
    )


def pinned(pins: Layout, facets: Facets) -> Layout:
    """The rows of an existing layout that are to stay: those of enabled facets.

    Raises:
        LayoutError: the layout has facets the display has not, or has them with another shape.
    """
    raise_all(LayoutError, _unknown(pins, facets))
    keep = (pins.page >= 0) & facets.enabled[pins.facet - 1]
    kept = pins.taken(np.flatnonzero(keep))
    raise_all(LayoutError, misfits(kept, facets))
    return kept


def _unknown(pins: Layout, facets: Facets) -> Iterator[Problem]:
    for row, facet in enumerate(pins.facet):
        if facet > facets.count:
            message = f"facet {facet} is not in {facets.path}, which has facets 1 to {facets.count}"
            yield pins.problem(message, row, "id")


def joined(pins: Layout, rest: Layout) -> Layout:
    """Pinned facets and the others in one layout; pages of the pins come first, as they are."""
    fresh = rest.pages[len(pins.pages) :]
    both = replace(
        rest,
        facet=np.concatenate((pins.facet, rest.facet)),
        page=np.concatenate((pins.page, rest.page)),
        size=np.concatenate((pins.size, rest.size)),
        quilt_from_facet=np.concatenate((pins.quilt_from_facet, rest.quilt_from_facet)),
        origin=np.concatenate((pins.origin, rest.origin)),
        du=np.concatenate((pins.du, rest.du)),
        dv=np.concatenate((pins.dv, rest.dv)),
        corner_start=np.concatenate((pins.corner_start, pins.corner_start[-1] + rest.corner_start[1:])),
        polygon=np.concatenate((pins.polygon, rest.polygon)),
        pages=np.concatenate((pins.pages, fresh)).astype(np.int32),
        place=None,
        file_row=None,
    )
    return both.taken(np.argsort(both.facet, kind="stable"))


def free_rooms(pins: Layout, padding: int, align: int, smallest: int) -> tuple[Room, ...]:
    """Rooms between pinned facets, the largest first on each page, with padding between them all.

    A pinned facet takes the box of whole pixels around its polygon.

    Args:
        pins: the pinned facets.
        padding: pixels to keep free around them and between rooms.
        align: rooms begin at multiples of this.
        smallest: pixels a room must have each way to be of use.
    """
    corners = quilt_polygons(pins)
    low = np.floor(np.minimum.reduceat(corners, pins.corner_start[:-1], axis=0) + 0.01).astype(np.int64)
    high = np.ceil(np.maximum.reduceat(corners, pins.corner_start[:-1], axis=0) - 0.01).astype(np.int64)
    boxes = np.concatenate((low - padding, high + padding), axis=1)
    rooms: list[Room] = []
    for page, (width, height) in enumerate(pins.pages.tolist()):
        free = np.array([[0, 0, width, height]])
        for box in boxes[pins.page == page]:
            free = without(free, *box.tolist())
        rooms += _largest_rooms(free, page, padding, align, smallest)
    return tuple(rooms)


def _largest_rooms(free: IntArray, page: int, padding: int, align: int, smallest: int) -> Iterator[Room]:
    """The largest free rectangle, then the largest of what it leaves, and so on."""
    for _ in range(_MOST_ROOMS):
        free = free.copy()
        free[:, :2] = -(-free[:, :2] // align) * align
        size = free[:, 2:] - free[:, :2]
        free = free[(size >= smallest).all(axis=1)]
        if not len(free):
            return
        area = (free[:, 2] - free[:, 0]) * (free[:, 3] - free[:, 1])
        left, top, right, bottom = free[np.lexsort((free[:, 0], free[:, 1], -area))[0]].tolist()
        yield Room(page, left, top, right - left, bottom - top)
        free = without(free, left - padding, top - padding, right + padding, bottom + padding)
