"""Bounding rectangles on a skyline: quick for thousands of them.

Jylänki, A Thousand Ways to Pack the Bin (2010), §2.3.1, bottom-left rule, here upside down: a page
remembers only how far down each column is taken, as level pieces. A facet goes where it ends highest,
then leftmost, turned or not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import IntArray
from quiltcli.layout.packing.model import FAR, PackInput, PackResult, Room, grown_size
from quiltcli.layout.packing.rectangles.maxrects import allowed_turns


@dataclass
class _Skyline:
    """Level pieces of a room: where each begins, a far end last, and how far down it is taken."""

    room: Room
    x: IntArray
    y: IntArray

    def spot(self, size: tuple[int, int], grown: tuple[int, int]) -> tuple[int, int, int] | None:
        """End, left and top of the best place of a rectangle; None without room.

        Args:
            size: what must lie inside the room.
            grown: what must be free, the padding included; it may reach past the room's end.
        """
        right, bottom = self.room.left + self.room.width, self.room.top + self.room.height
        count = int(np.searchsorted(self.x, right - size[0], side="right"))
        if count == 0:
            return None
        left = self.x[:count]
        # Pieces under the rectangle: from the one it begins on to the last that begins before its end.
        under = np.empty(2 * count, dtype=np.int64)
        under[0::2] = np.arange(count)
        under[1::2] = np.searchsorted(self.x, left + grown[0])
        top = np.maximum.reduceat(np.append(self.y, 0), under)[0::2]
        best = int(np.argmin((top << 32) + left))
        if top[best] + size[1] > bottom:
            return None
        return int(top[best]) + grown[1], int(left[best]), int(top[best])

    def take(self, left: int, width: int, end: int) -> None:
        """Lay a level piece over what it covers, and join it with equal neighbours."""
        right = left + width
        first, last = np.searchsorted(self.x, (left, right))
        # What is left of the piece that the right side cuts.
        rest = self.x[last] > right
        x = np.concatenate((self.x[:first], [left], [right] if rest else [], self.x[last:])).astype(np.int64)
        y = np.concatenate((self.y[:first], [end], [self.y[last - 1]] if rest else [], self.y[last:]))
        new = np.concatenate(([True], np.diff(y) != 0))
        self.x, self.y = x[np.append(new, True)], y[new].astype(np.int64)


def pack_skyline(wanted: PackInput, order: IntArray, lock: IntArray | None = None) -> PackResult:
    """Place rectangles in this order, each in the first room that takes it; `lock` as in `allowed_turns`."""
    count = len(order)
    turns = allowed_turns(wanted, lock)
    page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    grown = grown_size(wanted)
    lines = [_skyline(room) for room in wanted.rooms]
    fresh = wanted.begun
    for i in order.tolist():
        w, h = wanted.size[i].tolist()
        a, b = grown[i].tolist()
        for at in range(len(lines) + 1):
            if at == len(lines):
                lines.append(_skyline(Room(fresh, 0, 0, *wanted.page)))
                fresh += 1
            line = lines[at]
            spots = [
                (line.spot((h, w), (b, a)) if turned else line.spot((w, h), (a, b)), turned)
                for turned in turns[i]
            ]
            found = [(spot, turned) for spot, turned in spots if spot is not None]
            if found:
                (end, left, top), turn[i] = min(found)
                lines[at].take(left, b if turn[i] else a, end)
                page[i], corner[i] = lines[at].room.page, (left, top)
                break
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _skyline(room: Room) -> _Skyline:
    """An empty room."""
    x = np.array([room.left, FAR], dtype=np.int64)
    return _Skyline(room, x, np.array([room.top], dtype=np.int64))
