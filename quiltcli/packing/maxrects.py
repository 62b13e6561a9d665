"""Bounding rectangles by the maximal-rectangles method, bottom-left rule (upside down: top-left).

Jylänki, A Thousand Ways to Pack the Bin (2010), §2.4: a page's free space is kept as all maximal
free rectangles. Each facet goes where its lower edge ends highest, then leftmost.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import BoolArray, Int32Array, IntArray
from quiltcli.packing.model import PackInput, PackResult, page_count, placed_size


def pack_maxrects(wanted: PackInput) -> PackResult:
    """The best of three orders of placing: by longer side, by shorter side, by area, largest first.

    Best is fewest pages, then least height on the last page; the first order among equals.
    """
    long, short = wanted.size.max(axis=1).astype(np.int64), wanted.size.min(axis=1).astype(np.int64)
    index = np.arange(long.size)
    orders = ((index, -short, -long), (index, -long, -short), (index, -long, -long * short))
    results = [_place_all(wanted, np.lexsort(keys)) for keys in orders]
    return min(results, key=lambda result: _cost(wanted, result))


def _cost(wanted: PackInput, result: PackResult) -> tuple[int, int]:
    bottom = result.corner[:, 1] + placed_size(wanted.size, result.turn)[:, 1]
    pages = page_count(result)
    return pages, int(bottom[result.page == pages - 1].max(initial=0))


def _place_all(wanted: PackInput, order: IntArray) -> PackResult:
    """Place facets in this order, each on the first page that has room for it."""
    count = len(order)
    page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    # Rectangles grow by the padding to the right and down, and so does the page.
    end = np.array(wanted.page, dtype=np.int64) + wanted.padding
    free: list[IntArray] = []
    for i in order:
        grown = wanted.size[i] + wanted.padding
        for at, rectangles in enumerate([*free, None]):
            if rectangles is None:
                rectangles = np.array([[0, 0, *end]])
                free.append(rectangles)
            spot = _best_spot(rectangles, grown)
            if spot is not None:
                x, y, turn[i] = spot
                page[i], corner[i] = at, (x, y)
                w, h = grown[::-1] if turn[i] else grown
                free[at] = _without(rectangles, x, y, x + int(w), y + int(h))
                break
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _best_spot(free: IntArray, size: Int32Array) -> tuple[int, int, int] | None:
    """Left, top and quarter turns where a rectangle ends highest, then leftmost; None without room."""
    best = None
    for turn, (w, h) in enumerate((size, size[::-1])[: 1 if size[0] == size[1] else 2]):
        room = (free[:, 2] - free[:, 0] >= w) & (free[:, 3] - free[:, 1] >= h)
        if room.any():
            x, y = free[room, 0], free[room, 1]
            at = int(np.argmin((y << 32) + x))
            spot = (int(y[at] + h), int(x[at]), turn, int(y[at]))
            best = spot if best is None else min(best, spot)
    return None if best is None else (best[1], best[3], best[2])


def _without(free: IntArray, x0: int, y0: int, x1: int, y1: int) -> IntArray:
    """Maximal free rectangles (n, 4: left, top, right, bottom) after this one is taken."""
    hit = (free[:, 0] < x1) & (free[:, 2] > x0) & (free[:, 1] < y1) & (free[:, 3] > y0)
    whole, cut = free[~hit], free[hit]
    left, above, right, below = (cut.copy() for _ in range(4))
    left[:, 2], above[:, 3], right[:, 0], below[:, 1] = x0, y0, x1, y1
    parts = np.concatenate((left, above, right, below))
    parts = np.unique(parts[(parts[:, 0] < parts[:, 2]) & (parts[:, 1] < parts[:, 3])], axis=0)
    # What was whole stays maximal: a part lies inside a former rectangle, which did not contain it.
    inside = _contained(parts, whole).any(axis=1) | (_contained(parts, parts).sum(axis=1) > 1)
    return np.concatenate((whole, parts[~inside]))


def _contained(inner: IntArray, outer: IntArray) -> BoolArray:
    """Which inner rectangles (n, 4) lie in which outer (m, 4): (n, m); each lies in itself."""
    a, b = inner[:, None], outer[None]
    low = (a[..., 0] >= b[..., 0]) & (a[..., 1] >= b[..., 1])
    result: BoolArray = low & (a[..., 2] <= b[..., 2]) & (a[..., 3] <= b[..., 3])
    return result
