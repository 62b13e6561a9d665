"""Bounding rectangles: several ways to pack them, turned by 90° where that is better."""

from __future__ import annotations

import math
from functools import partial

from quiltcli.packing.attempt import SLOW, Attempt, least_width
from quiltcli.packing.maxrects import pack_maxrects, place_maxrects, size_orders
from quiltcli.packing.model import PackInput, grown_size
from quiltcli.packing.rows import pack_rows
from quiltcli.packing.skyline import pack_skyline


def rows_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """Linear order, however long it takes."""
    return [Attempt(pack_rows, 3e-6 * SLOW * len(wanted.size), _area(wanted), "rows", least_width(wanted))]


def maxrects_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """Maximal rectangles in three orders, however long they take."""
    return [
        Attempt(
            pack_maxrects,
            3 * _maxrects_seconds(len(wanted.size)),
            _area(wanted),
            "maxrects",
            least_width(wanted),
        )
    ]


def rects_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """A skyline in three orders, which is quick, then maximal rectangles in the same orders."""
    count, area, narrowest = len(wanted.size), _area(wanted), least_width(wanted)
    orders = size_orders(wanted)
    quick = [
        Attempt(partial(pack_skyline, order=order), 35e-6 * SLOW * count, area, "boxes", narrowest)
        for order in orders
    ]
    thorough = [
        Attempt(partial(place_maxrects, order=order), _maxrects_seconds(count), area, "boxes", narrowest)
        for order in orders
    ]
    return quick[:1] + thorough + quick[1:]


def _maxrects_seconds(count: int) -> float:
    return 2.5e-6 * SLOW * count * math.sqrt(count)


def _area(wanted: PackInput) -> float:
    return float(grown_size(wanted).prod(axis=1).sum())
