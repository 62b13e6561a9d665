"""Bounding rectangles by the maximal-rectangles method, bottom-left rule (upside down: top-left).

Jylänki, A Thousand Ways to Pack the Bin (2010), §2.4: a page's free space is kept as all maximal
free rectangles. Each facet goes where its lower edge ends highest, then leftmost.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import BoolArray, IntArray
from quiltcli.layout.packing.model import (
    FAR,
    PackInput,
    PackResult,
    Room,
    grown_size,
)


def size_orders(wanted: PackInput) -> list[IntArray]:
    """Three orders of the facets, largest first: by longer side, by shorter side, by area."""
    long, short = wanted.size.max(axis=1).astype(np.int64), wanted.size.min(axis=1).astype(np.int64)
    index = np.arange(long.size)
    keys = ((index, -short, -long), (index, -long, -short), (index, -long, -long * short))
    return [np.lexsort(key) for key in keys]


def allowed_turns(wanted: PackInput, lock: IntArray | None = None) -> list[tuple[int, ...]]:
    """Quarter turns each facet may have, of none and one.

    Args:
        wanted: what to place, and where.
        lock: (n,) the only turn a facet may have, −1 for either. One that no page takes is ignored.
    """
    if lock is None:
        return [(0, 1)] * len(wanted.size)
    size = np.where((lock == 1)[:, None], wanted.size[:, ::-1], wanted.size)
    free = (lock < 0) | (size > wanted.page).any(axis=1)
    return [(0, 1) if either else (turn,) for either, turn in zip(free.tolist(), lock.tolist(), strict=True)]


def place_maxrects(wanted: PackInput, order: IntArray, lock: IntArray | None = None) -> PackResult:
    """Place facets in this order, each in the first room that takes it.

    Args:
        wanted: what to place, and where.
        order: facets, the first to be placed first.
        lock: (n,) quarter turns as for `allowed_turns`.
    """
    count = len(order)
    turns = allowed_turns(wanted, lock)
    page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    grown = grown_size(wanted)
    rooms = list(wanted.rooms)
    free = [_whole(room) for room in rooms]
    for i in order.tolist():
        size, taken = tuple(wanted.size[i].tolist()), tuple(grown[i].tolist())
        for at in range(len(rooms) + 1):
            if at == len(rooms):
                fresh = rooms[-1].page + 1 if at > len(wanted.rooms) else wanted.begun
                rooms.append(Room(fresh, 0, 0, *wanted.page))
                free.append(_whole(rooms[at]))
            spot = _best_spot(free[at], rooms[at], size, taken, turns[i])
            if spot is not None:
                x, y, turn[i] = spot
                page[i], corner[i] = rooms[at].page, (x, y)
                w, h = taken[::-1] if turn[i] else taken
                free[at] = without(free[at], x, y, x + w, y + h)
                break
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _whole(room: Room) -> IntArray:
    """The one free rectangle of an empty room; padding may reach past its end."""
    return np.array([[room.left, room.top, FAR, FAR]])


def _best_spot(
    free: IntArray, room: Room, size: tuple[int, int], grown: tuple[int, int], turns: tuple[int, ...]
) -> tuple[int, int, int] | None:
    """Left, top and quarter turns where a rectangle ends highest, then leftmost; None without room."""
    best = None
    right, bottom = room.left + room.width, room.top + room.height
    for turn in turns:
        (w, h), (a, b) = (size[::-1], grown[::-1]) if turn else (size, grown)
        fits = (free[:, 2] - free[:, 0] >= a) & (free[:, 3] - free[:, 1] >= b)
        fits &= (free[:, 0] + w <= right) & (free[:, 1] + h <= bottom)
        if fits.any():
            x, y = free[fits, 0], free[fits, 1]
            at = int(np.argmin((y << 32) + x))
            spot = (int(y[at]) + b, int(x[at]), turn, int(y[at]))
            best = spot if best is None else min(best, spot)
    return None if best is None else (best[1], best[3], best[2])


def without(free: IntArray, x0: int, y0: int, x1: int, y1: int) -> IntArray:
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
