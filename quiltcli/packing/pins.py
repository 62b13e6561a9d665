"""Facets that stay where an existing layout has them, and the rooms that leaves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import IntArray
from quiltcli.layout.align import misfits
from quiltcli.layout.record import Layout, quilt_polygons
from quiltcli.packing.maxrects import without
from quiltcli.packing.model import Room

_MOST_ROOMS = 64  # a page


def pinned(pins: Layout, facets: Facets) -> Layout:
    """The rows of an existing layout that are to stay: those of enabled facets.

    Raises:
        LayoutError: the layout has facets the display has not, or has them with another shape.
    """
    raise_all(LayoutError, _unknown(pins, facets))
    keep = (pins.page >= 0) & facets.enabled[pins.facet - 1]
    kept = rows_of(pins, np.flatnonzero(keep))
    raise_all(LayoutError, misfits(kept, facets))
    return kept


def _unknown(pins: Layout, facets: Facets) -> Iterator[Problem]:
    for row, facet in enumerate(pins.facet):
        if facet > facets.count:
            message = f"facet {facet} is not in {facets.path}, which has facets 1 to {facets.count}"
            yield pins.problem(message, row, "id")


def rows_of(layout: Layout, rows: IntArray) -> Layout:
    """A layout of some rows of another, in this order, on the same pages."""
    counts = np.diff(layout.corner_start)[rows]
    corners = [np.arange(layout.corner_start[row], layout.corner_start[row + 1]) for row in rows]
    corner = np.concatenate([np.zeros(0, dtype=np.int64), *corners])
    return replace(
        layout,
        facet=layout.facet[rows],
        page=layout.page[rows],
        size=layout.size[rows],
        quilt_from_facet=layout.quilt_from_facet[rows],
        origin=layout.origin[rows],
        du=layout.du[rows],
        dv=layout.dv[rows],
        corner_start=np.concatenate(([0], np.cumsum(counts))),
        polygon=layout.polygon[corner],
        file_row=None if layout.file_row is None else layout.file_row[rows],
    )


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
    )
    return rows_of(both, np.argsort(both.facet, kind="stable"))


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
