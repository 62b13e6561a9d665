"""Bounding rectangles: several ways to pack them, turned by 90° where that is better."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from quiltcli.geometry import IntArray
from quiltcli.layout.packing.attempt import SLOW, Attempt, least_width
from quiltcli.layout.packing.dice import Dice
from quiltcli.layout.packing.model import PackInput, PackResult, cost, grown_size, placed_size
from quiltcli.layout.packing.rectangles.maxrects import place_maxrects, size_orders
from quiltcli.layout.packing.rectangles.rows import pack_rows
from quiltcli.layout.packing.rectangles.skyline import pack_skyline

_IMPROVED = 400
"""Rectangles up to which trying other orders pays."""

_SPLITS = 20
"""Most places at which an order is split into rectangles that stand and such that lie."""

_IMPROVING = 0.3  # of the time, for improving an order on one page width


def rows_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """Linear order, however long it takes."""
    area = _area(wanted)
    return [Attempt(pack_rows, 3e-6 * SLOW * len(wanted.size), area, "rows", least_width(wanted), area)]


def rects_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """A skyline, which is quick, then maximal rectangles in three orders.

    Once all rectangles stand and once all lie, since of equal panels the last row that is lower so is
    no reason to turn those of all other rows. Few are then tried in many other orders.
    """
    count, area, narrowest = len(wanted.size), _area(wanted), least_width(wanted)
    orders = size_orders(wanted)
    once, longer = _skyline_seconds(count), _maxrects_seconds(count)
    quick = Attempt(partial(pack_skyline, order=orders[0]), once, area, "boxes", narrowest, area)
    alike = [
        Attempt(partial(pack_skyline, order=orders[0], lock=lock), once, area, stance, narrowest, area)
        for stance, lock in zip(("standing", "lying"), _stances(wanted), strict=True)
    ]
    thorough = [
        Attempt(partial(place_maxrects, order=order), longer, area, "boxes", narrowest, area)
        for order in orders
    ]
    better = []
    if count <= _IMPROVED:
        steps = int(_IMPROVING * seconds / once)
        starts = 9 + 2 * _SPLITS
        better = [Attempt(Reordered(steps).run, (steps + starts) * once, area, "boxes", narrowest, area)]
    return [quick, *alike, *thorough, *better]


@dataclass(frozen=True)
class Reordered:
    """Rectangles on a skyline in many orders: changes are kept when nothing gets worse.

    Attributes:
        steps: changes to try.
    """

    steps: int

    def run(self, wanted: PackInput) -> PackResult:
        """The best of all that were tried."""
        results = [
            (cost(wanted, result), number, order, lock, result)
            for number, (order, lock, result) in enumerate(_starts(wanted))
        ]
        least, _, order, lock, best = min(results, key=lambda entry: entry[:2])
        dice = Dice()
        for _ in range(self.steps):
            new_order, new_lock = _changed(order, lock, dice)
            result = pack_skyline(wanted, new_order, new_lock)
            now = cost(wanted, result)
            if now <= least:
                best, least, order, lock = result, now, new_order, new_lock
        return best


def _starts(wanted: PackInput) -> Iterator[tuple[IntArray, IntArray, PackResult]]:
    """Orders and turns to begin from: all free, all standing, all lying, and the first of them otherwise.

    Of equal panels, rows that stand and rows that lie are of unlike height and hold unlike numbers, and a
    page is often filled best by some of each.
    """
    standing, lying = _stances(wanted)
    for order in size_orders(wanted):
        for lock in (np.full(len(order), -1), standing, lying):
            yield order, lock, pack_skyline(wanted, order, lock)
    order = size_orders(wanted)[0]
    for one, other in ((standing, lying), (lying, standing)):
        across = int(_placed(wanted, one)[:, 0].mean()) + wanted.padding
        row = max((wanted.page[0] + wanted.padding) // across, -(-len(order) // _SPLITS))
        for first in range(row, len(order), row):
            lock = other.copy()
            lock[order[:first]] = one[order[:first]]
            yield order, lock, pack_skyline(wanted, order, lock)


def _stances(wanted: PackInput) -> tuple[IntArray, IntArray]:
    """Quarter turns by which all rectangles stand, and by which all lie."""
    wide = wanted.size[:, 0] >= wanted.size[:, 1]
    return np.where(wide, 1, 0), np.where(wide, 0, 1)


def _placed(wanted: PackInput, lock: IntArray) -> IntArray:
    return placed_size(wanted.size, lock.astype(np.int32)).astype(np.int64)


def _changed(order: IntArray, lock: IntArray, dice: Dice) -> tuple[IntArray, IntArray]:
    """One or two changes: two rectangles trade places in the order, or one is bound to a turn."""
    order, lock = order.copy(), lock.copy()
    for _ in range(1 + dice.below(2)):
        i, j = dice.below(len(order)), dice.below(len(order))
        if dice.below(2):
            order[[i, j]] = order[[j, i]]
        else:
            lock[i] = dice.below(3) - 1
    return order, lock


def _skyline_seconds(count: int) -> float:
    return 35e-6 * SLOW * count


def _maxrects_seconds(count: int) -> float:
    return 2.5e-6 * SLOW * count * math.sqrt(count)


def _area(wanted: PackInput) -> float:
    return float(grown_size(wanted).prod(axis=1).sum())
