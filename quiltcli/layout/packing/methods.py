"""The table of packing methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from quiltcli.layout.packing.attempt import Attempt, Method
from quiltcli.layout.packing.model import PackInput
from quiltcli.layout.packing.outlines.nest import nest_attempts
from quiltcli.layout.packing.outlines.shapes import all_rectangles
from quiltcli.layout.packing.rectangles.few import few_enough
from quiltcli.layout.packing.rectangles.rects import rects_attempts, rows_attempts
from quiltcli.layout.packing.unfolding.net import net_attempts

_SPARSE = 0.7  # of its rectangles a display must fill for rectangles to have a chance


def _auto(wanted: PackInput, seconds: float) -> list[list[Attempt]]:
    """All that `rects` and `nest` do; rectangles only for facets that nearly fill theirs."""
    rects, nest = rects_attempts(wanted, seconds), nest_attempts(wanted, seconds)
    return [nest] if nest[0].area <= _SPARSE * rects[0].area else [rects, nest]


def _alone(attempts: Callable[[PackInput, float], list[Attempt]]) -> Method:
    """A method of one list."""
    return lambda wanted, seconds: [attempts(wanted, seconds)]


def has_all_arrangements(method: str, wanted: PackInput) -> bool:
    """Whether a method can do no better than the best arrangement of rectangles, and those are few."""
    if method not in ("auto", "rects", "nest") or not few_enough(wanted):
        return False
    return method == "rects" or all_rectangles(wanted)


METHODS: Mapping[str, Method] = {
    "auto": _auto,
    "rows": _alone(rows_attempts),
    "rects": _alone(rects_attempts),
    "nest": _alone(nest_attempts),
    "net": _alone(net_attempts),
}
