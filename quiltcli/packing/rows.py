"""Bounding rectangles in linear order: the simple packing of Harish & Narayanan, §3.4."""

from __future__ import annotations

import numpy as np

from quiltcli.packing.model import PackInput, PackResult, placed_size


def pack_rows(wanted: PackInput) -> PackResult:
    """Facets by id, left to right, row under row, page after page; the layout people can read.

    A row is as high as its highest facet. Only a facet that is too wide or too high for the page
    as it stands is turned, clockwise once.
    """
    width, height = wanted.page
    count = len(wanted.size)
    turn = np.zeros(count, dtype=np.int32)
    turn[(wanted.size > np.array(wanted.page)).any(axis=1)] = 1
    page, corner = np.zeros(count, dtype=np.int32), np.zeros((count, 2), dtype=np.int32)
    x = y = row_height = current = 0
    for i, (w, h) in enumerate(placed_size(wanted.size, turn).tolist()):
        if x + w > width:
            x, y, row_height = 0, y + row_height + wanted.padding, 0
        # A facet higher than its row so far can still push the row over the page's end.
        if y + h > height:
            x = y = row_height = 0
            current += 1
        page[i], corner[i] = current, (x, y)
        x, row_height = x + w + wanted.padding, max(row_height, h)
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)
