"""One way to pack, with what it costs: what searches are made of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from quiltcli.layout.packing.model import PackInput, PackResult

SLOW = 8.0
"""Estimates are for a computer this much slower than the one they were measured on."""


@dataclass(frozen=True)
class Attempt:
    """A way to pack these facets on pages of any size.

    Attributes:
        run: packs; the input differs from the one the attempt was made for in its page and rooms only.
        seconds: estimated from counts, never measured, so that the same attempts are made everywhere.
        area: pixels the facets take at least by this way: their rectangles, or what they touch.
        family: attempts of one family do well on the same pages; the first of a family scouts.
        narrowest: least width of a page that holds each of the pieces.
        least: pixels that facets with their padding take in any packing that lists of its kind find; 0
            when that is not known.
    """

    run: Callable[[PackInput], PackResult]
    seconds: float
    area: float
    family: str
    narrowest: int
    least: float = 0.0


Method: TypeAlias = Callable[[PackInput, float], Sequence[Sequence[Attempt]]]
"""The attempts at packing an input, given the seconds for them: lists, each the best use of the time
first, and each with all of the seconds to itself. So a method that has the lists of others is never
worse than they are."""


def least_width(wanted: PackInput) -> int:
    """Width of the narrowest page on which every raster fits, turned or not."""
    return int(wanted.size.min(axis=1).max())
