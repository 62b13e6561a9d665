"""Bounding rectangles in linear order: the simple packing of Harish & Narayanan, §3.4."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.layout.packing.model import PackInput, PackResult, Room, grown_size


def pack_rows(wanted: PackInput) -> PackResult:
    """Facets by id, left to right, row under row, page after page; the layout people can read.

    A row is as high as its highest facet. Only a facet that is too wide or too high for the page
    as it stands is turned, clockwise once.
    """
    count = len(wanted.size)
    page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    turn[(wanted.size > np.array(wanted.page)).any(axis=1)] = 1
    sizes, steps = wanted.size.tolist(), grown_size(wanted).tolist()
    rooms = _rooms(wanted)
    room = next(rooms)
    x = y = row_height = 0
    for i in range(count):
        (w, h), (across, down) = (pair[::-1] if turn[i] else pair for pair in (sizes[i], steps[i]))
        if x + w > room.width:
            x, y, row_height = 0, y + row_height, 0
        # A facet higher than its row so far can still push the row over the room's end.
        while x + w > room.width or y + h > room.height:
            x = y = row_height = 0
            room = next(rooms)
        page[i], corner[i] = room.page, (room.left + x, room.top + y)
        x, row_height = x + across, max(row_height, down)
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _rooms(wanted: PackInput) -> Iterator[Room]:
    """The rooms of begun pages, then fresh pages."""
    yield from wanted.rooms
    page = wanted.begun
    while True:
        yield Room(page, 0, 0, *wanted.page)
        page += 1
