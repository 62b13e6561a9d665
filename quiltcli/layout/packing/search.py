"""The best of many attempts: on pages of a given size, or on the smallest page that can be found.

What is tried depends on counts and on the seconds asked for, never on a clock: the same input is
packed the same way on every computer, and a slow one takes longer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.layout.packing.attempt import Attempt
from quiltcli.layout.packing.bounds import (
    LARGEST_PAGE,
    LONGEST,
    MULTIPLE,
    fewest_pages,
    height_of,
    smallest_page,
    whole_blocks,
)
from quiltcli.layout.packing.model import PackInput, PackResult, extents, page_count, used_height

_WIDTHS = 24
_SCOUTING = 0.4  # of the time is for finding good widths
_FOLLOWED = 6  # widths on which the other attempts follow


def best_pages(searches: Sequence[Sequence[Attempt]], wanted: PackInput, seconds: float) -> PackResult:
    """Pack on pages of the wanted size: fewest pages, then least height on the last one.

    Stops at once when no fewer pages are possible. The first attempt of each list is always made.
    """
    best: tuple[tuple[int, int], PackResult] | None = None
    least = min(fewest_pages(wanted, attempts[0].least) for attempts in searches)
    for attempts in searches:
        spent = 0.0
        for number, attempt in enumerate(attempts):
            # Stopping, not skipping: more seconds then never lead to fewer attempts.
            if number and spent + attempt.seconds > seconds:
                break
            spent += attempt.seconds
            result = attempt.run(wanted)
            cost = (page_count(result), used_height(wanted, result))
            if best is None or cost < best[0]:
                best = (cost, result)
            if not wanted.begun and cost[0] <= least:
                return best[1]
    assert best is not None
    return best[1]


def best_page(
    searches: Sequence[Sequence[Attempt]], wanted: PackInput, seconds: float, aspect: Fraction | None = None
) -> tuple[PackResult, tuple[int, int]]:
    """The smallest single page, of a chosen aspect (width / height) or of any.

    In each list of attempts, the first of each family is made on a range of widths, the others on the
    widths that were best for it. Ties go to the squarest, then the one with fewest turned facets, then
    the narrowest. A page more than three times as long as wide is taken only when there is no other, or
    when that is the aspect. Pages are at most 16384 pixels wide and high; a display too large for one is
    packed on several of that size.

    A list whose facets need a page that is no smaller and no squarer than the best so far is left out,
    and so is the rest of one whose best page cannot be better.
    """
    best: _Best | None = None
    # The list that may find the smaller page goes first: it may make the other unnecessary.
    for attempts in sorted(searches, key=lambda attempts: attempts[0].least):
        bound = smallest_page(wanted, attempts[0].least, attempts[0].narrowest, aspect)
        if best is None or bound < best[0][:3]:
            found = _best_page(attempts, wanted, seconds, aspect, bound)
            best = min((each for each in (best, found) if each is not None), key=_cost, default=None)
    if best is not None:
        return best[1], best[2]
    largest = largest_page(aspect)
    return best_pages(searches, replace(wanted, page=largest), seconds), largest


def _best_page(
    attempts: Sequence[Attempt], wanted: PackInput, seconds: float, aspect: Fraction | None, bound: _Bound
) -> _Best | None:
    """What one list of attempts comes to; None when nothing fits a page."""
    tries = _Tries(wanted, aspect, bound)
    scouts: dict[str, int] = {}
    for number, attempt in enumerate(attempts):
        scouts.setdefault(attempt.family, number)
    for number in scouts.values():
        attempt = attempts[number]
        share = _SCOUTING * seconds / len(scouts) / max(attempt.seconds, 1e-9)
        # Thousands of facets fill one width as well as another.
        fewest = 3 if 3 * attempt.seconds <= seconds else 1
        tries.scout(number, attempt, int(min(max(share, fewest), _WIDTHS)))
    for number, attempt in enumerate(attempts):
        if number not in scouts.values():
            tries.follow(number, attempt, scouts[attempt.family], seconds)
    return tries.best


def largest_page(aspect: Fraction | None) -> tuple[int, int]:
    """The largest page of this shape that is at most 16384 pixels wide and high."""
    if aspect is None:
        return LARGEST_PAGE, LARGEST_PAGE
    width = LARGEST_PAGE
    while height_of(width, aspect) > LARGEST_PAGE:
        width -= MULTIPLE
    return width, height_of(width, aspect)


_Bound: TypeAlias = tuple[bool, int, int]
_Cost: TypeAlias = tuple[bool, int, int, int, int, int]
_Best: TypeAlias = tuple[_Cost, PackResult, tuple[int, int]]


def _cost(best: _Best) -> _Cost:
    return best[0]


@dataclass
class _Tries:
    """Everything tried on the way to one small page, the best of it, and what it should have cost."""

    wanted: PackInput
    aspect: Fraction | None
    bound: _Bound
    spent: float = 0.0
    costs: dict[tuple[int, int], _Cost] = field(default_factory=dict)
    best: _Best | None = None

    def scout(self, number: int, attempt: Attempt, count: int) -> None:
        """Make an attempt on this many widths: spread out, or closing in on the least of the aspect."""
        if self.aspect is None:
            sides = (math.sqrt(attempt.area) * (0.8 + 0.6 * spread(count))).tolist()
            if count > 1:  # a column of facets may be best
                sides.append(int(self.wanted.size[:, 0].max()))
            whole = {whole_blocks(max(int(side), attempt.narrowest)) for side in sides}
            for width in sorted(width for width in whole if width <= LARGEST_PAGE) or [LARGEST_PAGE]:
                self._at(number, attempt, width)
            return
        low = self._lowest(attempt)
        width = whole_blocks(max(int(low * 1.05), attempt.narrowest))
        while width <= LARGEST_PAGE and not self._at(number, attempt, width):
            low, width = width, whole_blocks(math.ceil(width * 1.1))
        self._close_in(number, attempt, low, width, count)

    def follow(self, number: int, attempt: Attempt, scout: int, seconds: float) -> None:
        """Make an attempt where the family's scout did best, as long as there is time."""
        if self.aspect is not None:
            if self.best is not None:
                count = int((seconds - self.spent) / max(attempt.seconds, 1e-9))
                self._close_in(number, attempt, self._lowest(attempt), self.best[2][0], min(count, 5))
            return
        good = sorted((cost, width) for (made, width), cost in self.costs.items() if made == scout)
        for _, width in good[:_FOLLOWED]:
            if self.spent + attempt.seconds <= seconds:
                self._at(number, attempt, width)

    @property
    def _unbeaten(self) -> bool:
        """Whether nothing can be better than the best so far: smaller or squarer, or with fewer turned."""
        return self.best is not None and self.best[0][:4] <= (*self.bound, 0)

    def _lowest(self, attempt: Attempt) -> int:
        """A width at which a page of the aspect is certainly too small."""
        assert self.aspect is not None
        return int(math.sqrt(0.9 * attempt.area * self.aspect)) // MULTIPLE * MULTIPLE

    def _close_in(self, number: int, attempt: Attempt, low: int, high: int, count: int) -> None:
        """Halve the range between a width that is too small and one that is enough, count times."""
        for _ in range(count):
            width = whole_blocks((low + high) // 2)
            if width >= high:
                return
            low, high = (low, width) if self._at(number, attempt, width) else (width, high)

    def _at(self, number: int, attempt: Attempt, width: int) -> bool:
        """Make an attempt on pages of this width; whether one page was enough."""
        if width < attempt.narrowest or self._unbeaten:
            return False
        self.spent += attempt.seconds
        wanted = replace(self.wanted, page=(width, LARGEST_PAGE))
        result = attempt.run(wanted)
        used = extents(wanted, result).max(axis=0)
        w, h = (min(whole_blocks(int(side)), LARGEST_PAGE) for side in used)
        if self.aspect is not None:
            w, h = width, height_of(width, self.aspect)
        if page_count(result) > 1 or used[1] > h:
            return False
        strip = self.aspect is None and max(w, h) > LONGEST * min(w, h)
        turned = int(np.count_nonzero(result.turn))
        cost = (strip, w * h, abs(w - h), turned, w, number)
        self.costs[number, width] = cost
        if self.best is None or cost < self.best[0]:
            self.best = (cost, result, (w, h))
        return True


def spread(count: int) -> FloatArray:
    """Numbers between 0 and 1, evenly spread, that include those of every lesser count (van der Corput)."""
    return np.array([int(f"{n:b}"[::-1], 2) / (1 << n.bit_length()) for n in range(1, count + 1)])
