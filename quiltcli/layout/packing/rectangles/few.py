"""A few rectangles: every arrangement there is, so that nothing better is left to search for.

Murata, Fujiyoshi, Nakatake & Kajitani, VLSI Module Placement Based on Rectangle-Packing by the
Sequence-Pair (1996): two orders of the rectangles say of any two which lies beside which, or above
it. To each pair of orders belongs one tightest packing, and the smallest packing is one of those.

    first order    a b c     before in both: a lies left of b
    second order   c a b     before in the first, after in the second: a lies above c

The first order may be that of the places 0, 1, 2, …, if the second runs through all orders and the
rectangles, turned or not, through all ways to be dealt out to the places.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import permutations, product
from math import factorial

import numpy as np

from quiltcli.geometry import BoolArray, Int32Array, IntArray
from quiltcli.layout.packing.bounds import LARGEST_PAGE, LONGEST, MULTIPLE, height_of
from quiltcli.layout.packing.model import PackInput, PackResult, extents, page_count
from quiltcli.layout.packing.rectangles.maxrects import size_orders
from quiltcli.layout.packing.rectangles.skyline import pack_skyline

_MOST = 500_000
"""Arrangements that are gone through: five unlike rectangles have 460,800."""

_MOST_RECTANGLES = 7

Kind = tuple[int, int]
"""Shorter and longer side of a rectangle."""


def few_enough(wanted: PackInput) -> bool:
    """Whether all arrangements of the facets' rectangles can be gone through, on empty pages."""
    if wanted.begun or len(wanted.size) > _MOST_RECTANGLES:
        return False
    kinds = _kinds(wanted)
    return factorial(len(kinds)) * _deal_count(kinds) <= _MOST


def smallest_of_few(wanted: PackInput, aspect: Fraction | None) -> tuple[PackResult, tuple[int, int]] | None:
    """The smallest single page of a few rectangles, by the rules of `search.best_page`; None without one."""
    every = _arrangements(wanted, _kinds(wanted))
    width, height = (-(-every.size[axis] // MULTIPLE) * MULTIPLE for axis in (0, 1))
    if aspect is not None:
        width, height = _shaped(*every.size, aspect)
    ok = (width <= LARGEST_PAGE) & (height <= LARGEST_PAGE)
    if not ok.any():
        return None
    long, short = np.maximum(width, height), np.minimum(width, height)
    strip = (long > LONGEST * short) & (aspect is None)
    best = _least(ok, (strip, width.astype(np.int64) * height, long - short, every.turned, width))
    page = int(width[best]), int(height[best])
    usual = _as_usual(wanted, page, int(every.turned[best]))
    return usual or every.result(wanted, best), page


def fewest_of_few(wanted: PackInput) -> PackResult:
    """A few rectangles on the fewest pages of the wanted size, the last one filled least high."""
    count = len(wanted.size)
    subsets = [[at for at in range(count) if mask >> at & 1] for mask in range(1 << count)]
    alone = {mask: found for mask, rows in enumerate(subsets) if (found := _on_a_page(wanted, rows))}
    pages: dict[int, list[int]] = {0: []}
    for mask in range(1, 1 << count):
        # One of the pages has the first facet; which one it is, is tried.
        tried = [one for one in alone if one & mask == one and one & _lowest(mask)]
        pages[mask] = min(([*pages[mask ^ one], one] for one in tried), key=len)
    whole = len(subsets) - 1
    last = min(
        (one for one in alone if len(pages[whole ^ one]) == len(pages[whole]) - 1),
        key=lambda one: (alone[one][0], -_lowest(one), one),
    )
    order = [*sorted(pages[whole ^ last], key=_lowest), last]
    return _put_together(wanted, [(subsets[one], alone[one][1]) for one in order])


def _lowest(mask: int) -> int:
    """The first facet of a subset, as a mask."""
    return mask & -mask


def _on_a_page(wanted: PackInput, rows: Sequence[int]) -> tuple[int, PackResult] | None:
    """Least height of some of the rectangles on one page, and where they lie; None when they do not fit."""
    if not rows:
        return None
    some = replace(wanted, size=wanted.size[list(rows)])
    every = _arrangements(some, _kinds(some))
    ok = (every.size[0] <= wanted.page[0]) & (every.size[1] <= wanted.page[1])
    if not ok.any():
        return None
    best = _least(ok, (every.size[1], every.turned, every.size[0]))
    return int(every.size[1][best]), every.result(some, best)


def _put_together(wanted: PackInput, parts: Sequence[tuple[Sequence[int], PackResult]]) -> PackResult:
    """One result of results for some of the facets, each on its own page."""
    count = len(wanted.size)
    page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    corner = np.zeros((count, 2), dtype=np.int32)
    for number, (rows, result) in enumerate(parts):
        page[rows], turn[rows], corner[rows] = number, result.turn, result.corner
    return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _as_usual(wanted: PackInput, page: tuple[int, int], turned: int) -> PackResult | None:
    """The largest first, from the top left on, if that is as good: easier to read than most."""
    for order in size_orders(wanted):
        result = pack_skyline(replace(wanted, page=(page[0], LARGEST_PAGE)), order)
        fits = (extents(wanted, result) <= page).all() and page_count(result) == 1
        if fits and np.count_nonzero(result.turn) == turned:
            return result
    return None


def _shaped(width: Int32Array, height: Int32Array, aspect: Fraction) -> tuple[Int32Array, Int32Array]:
    """The smallest pages of an aspect that hold these sizes, which may be larger than any page may be."""
    sides = np.arange(MULTIPLE, LARGEST_PAGE + 2 * MULTIPLE, MULTIPLE, dtype=np.int32)
    high = np.array([height_of(side, aspect) for side in sides.tolist()], dtype=np.int32)
    at = np.maximum(np.searchsorted(sides, width), np.searchsorted(high, height))
    at = np.minimum(at, len(sides) - 1)
    return sides[at], high[at]


def _least(ok: BoolArray, costs: Sequence[np.ndarray]) -> int:
    """Index of the least entry that is ok, costs compared one after the other; the first among equals."""
    left = np.flatnonzero(ok)
    for cost in costs:
        each = cost.ravel()[left]
        left = left[each == each.min()]
    return int(left[0])


def _kinds(wanted: PackInput) -> tuple[Kind, ...]:
    """The kind of every rectangle."""
    return tuple((min(side), max(side)) for side in wanted.size.tolist())


def _deals(kinds: Sequence[Kind]) -> Iterator[tuple[tuple[Kind, ...], tuple[bool, ...]]]:
    """All ways to deal rectangles out to places: which kind to each, and whether it lies."""
    for deal in sorted(set(permutations(kinds))):
        yield from ((deal, lying) for lying in product(*((False, True)[: 1 + (a < b)] for a, b in deal)))


def _deal_count(kinds: Sequence[Kind]) -> int:
    count = factorial(len(kinds))
    for kind in set(kinds):
        count //= factorial(kinds.count(kind))
    return count << sum(a < b for a, b in kinds)


@dataclass(frozen=True)
class _Every:
    """Arrangements of n rectangles: P orders of the places times K deals, flat as P·K.

    Attributes:
        order: (P, n) rank of each place in the second order.
        deals: the K deals.
        size: width and height (P·K,) each, the padding of the last left out.
        turned: (P·K,) rectangles that lie where they stand on the display, or stand where they lie.
    """

    order: IntArray
    deals: Sequence[tuple[tuple[Kind, ...], tuple[bool, ...]]]
    size: tuple[Int32Array, Int32Array]
    turned: Int32Array

    def result(self, wanted: PackInput, index: int) -> PackResult:
        """Where the rectangles lie by one arrangement; among equal ones, ids run as people read."""
        rank, deal = divmod(index, len(self.deals))
        kinds, lying = self.deals[deal]
        _, grown = _sides(wanted, kinds, lying)
        x, y = (
            [int(place[0, 0]) for place in places]
            for places in _laid(self.order[rank : rank + 1], grown[None])
        )
        count = len(kinds)
        page, turn = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
        corner = np.zeros((count, 2), dtype=np.int32)
        waiting = {kind: [at for at, other in enumerate(_kinds(wanted)) if other == kind] for kind in kinds}
        lies = (wanted.size[:, 0] > wanted.size[:, 1]).tolist()
        for place in sorted(range(count), key=lambda place: (y[place], x[place])):
            facets = waiting[kinds[place]]
            # One that need not be turned, unless they have run out.
            facet = min(facets, key=lambda at: (lies[at] != lying[place], at))
            facets.remove(facet)
            turn[facet], corner[facet] = lies[facet] != lying[place], (x[place], y[place])
        return PackResult(page, turn, np.zeros(count, dtype=np.bool_), corner)


def _arrangements(wanted: PackInput, kinds: tuple[Kind, ...]) -> _Every:
    """All arrangements of rectangles of these kinds."""
    deals = list(_deals(kinds))
    own, grown = (np.stack(sides) for sides in zip(*(_sides(wanted, *deal) for deal in deals), strict=True))
    order = np.array(list(permutations(range(len(kinds)))))
    x, y = _laid(order, grown)
    size = []
    for axis, places in enumerate((x, y)):
        ends = [place + own[:, at, axis] for at, place in enumerate(places)]
        size.append(np.maximum.reduce(ends).ravel())
    turned = np.array([_turned(wanted, *deal) for deal in deals], dtype=np.int32)
    return _Every(order, deals, (size[0], size[1]), np.tile(turned, len(order)))


def _laid(order: IntArray, grown: Int32Array) -> tuple[list[Int32Array], list[Int32Array]]:
    """Left and top of the rectangle at each place, pushed as far to the left and up as they go.

    Args:
        order: (P, n) rank of each place in the second order.
        grown: (K, n, 2) width and height at each place, padding included.

    Returns:
        n times x (P, K), and n times y.
    """
    x: list[Int32Array] = []
    y: list[Int32Array] = []
    for place in range(order.shape[1]):
        left, top = (np.zeros((len(order), len(grown)), dtype=np.int32) for _ in range(2))
        for before in range(place):
            beside = (order[:, before] < order[:, place])[:, None]
            np.maximum(left, x[before] + grown[:, before, 0], out=left, where=beside)
            np.maximum(top, y[before] + grown[:, before, 1], out=top, where=~beside)
        x.append(left)
        y.append(top)
    return x, y


def _sides(wanted: PackInput, kinds: Sequence[Kind], lying: Sequence[bool]) -> tuple[Int32Array, Int32Array]:
    """Width and height (n, 2) at each place: of the rectangle, and with its padding as in `grown_size`."""
    own = np.array(
        [kind[::-1] if lies else kind for kind, lies in zip(kinds, lying, strict=True)], dtype=np.int32
    )
    steps = -(-(own + wanted.padding) // wanted.align)
    return own, (steps * wanted.align).astype(np.int32)


def _turned(wanted: PackInput, kinds: Sequence[Kind], lying: Sequence[bool]) -> int:
    """Rectangles that a deal turns at least, since more or fewer of a kind lie than on the display."""
    balance = dict.fromkeys(kinds, 0)
    for kind, lies in zip(kinds, lying, strict=True):
        balance[kind] += lies
    for width, height in wanted.size.tolist():
        balance[min(width, height), max(width, height)] -= width > height
    return sum(map(abs, balance.values()))
