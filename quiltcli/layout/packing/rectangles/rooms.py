"""Rooms: the free rectangles of begun pages, then as many fresh pages as it takes."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.layout.packing.model import PackInput, Room


@dataclass
class Strip:
    """A room that is filled from its top; `top` moves down as shelves are put into it."""

    room: Room
    top: int

    @property
    def height(self) -> int:
        """Pixels left below the shelves."""
        return self.room.top + self.room.height - self.top


class Strips:
    """All rooms a packing may use, each filled shelf by shelf."""

    def __init__(self, wanted: PackInput) -> None:
        self._page = wanted.page
        self._fresh = wanted.begun
        self.open = [Strip(room, room.top) for room in wanted.rooms]

    def more(self) -> Strip:
        """A fresh page, open from now on."""
        strip = Strip(Room(self._fresh, 0, 0, *self._page), 0)
        self._fresh += 1
        self.open.append(strip)
        return strip
