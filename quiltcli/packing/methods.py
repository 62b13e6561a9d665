"""The table of packing methods."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import zip_longest

from quiltcli.packing.attempt import Attempt, Method
from quiltcli.packing.model import PackInput
from quiltcli.packing.nest import nest_attempts
from quiltcli.packing.net import net_attempts
from quiltcli.packing.rects import maxrects_attempts, rects_attempts, rows_attempts

_SPARSE = 0.7  # of its rectangles a display must fill for rectangles to have a chance


def auto_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """All that `rects` and `nest` do, in turn; rectangles only for facets that nearly fill theirs."""
    rects = rects_attempts(wanted, seconds / 2)
    nest = nest_attempts(wanted, seconds / 2)
    if nest[0].area <= _SPARSE * rects[0].area:
        return nest_attempts(wanted, seconds)
    return [attempt for both in zip_longest(rects, nest) for attempt in both if attempt is not None]


METHODS: Mapping[str, Method] = {
    "auto": auto_attempts,
    "rows": rows_attempts,
    "rects": rects_attempts,
    "maxrects": maxrects_attempts,
    "nest": nest_attempts,
    "net": net_attempts,
}
DEFAULT_METHOD = "auto"
