"""Few facets as tight as they go: a search of minutes by the library spyrrow, an optional extra.

Sparrow (Gardeyn, Vanden Berghe & Wauters 2025) lets outlines overlap and works the overlaps out while the
strip they lie in gets shorter. It stops by a clock, so two runs differ; nothing else here does.

Its places are real numbers, ours whole pixels. Each outline is therefore given to it grown by a square:
when grown outlines do not meet, neither do the pixels that the outlines touch after rounding, padding
included. The grown square of half side h keeps points 2h apart in x or in y; points of two touched pixels
that are too near are less than padding + 1 apart, and rounding moves them by as much as a step of the
alignment nearer.
"""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.errors import LayoutError, Problem
from quiltcli.geometry import FloatArray
from quiltcli.layout.packing.attempt import Attempt
from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.grown import grown_by_square
from quiltcli.layout.packing.outlines.nest import nest_attempts
from quiltcli.layout.packing.outlines.settle import settle
from quiltcli.layout.packing.outlines.shapes import Shapes, facet_shapes
from quiltcli.layout.packing.search import LARGEST_PAGE

_SHARES, _SHARES_OF_ONE = (0.1, 0.58), (0.05, 0.95)
"""Of the time, for a look at one of several page widths and for the search on the best of them; and when
the page is given, for a look whether it is enough and for the search on it."""


def sparrow_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """A short search to find a page width, then a long one.

    Raises:
        LayoutError: the library is not installed.
    """
    if importlib.util.find_spec("spyrrow") is None:
        message = "the method sparrow needs the package spyrrow (pip install 'quiltcli[sparrow]')"
        raise LayoutError(Problem(message))
    shapes = facet_shapes(wanted)
    first = nest_attempts(wanted, seconds)[0]
    narrowest = first.narrowest + 2 * wanted.align
    area = float(shapes.area.sum())
    shares = _SHARES if max(wanted.page) == LARGEST_PAGE else _SHARES_OF_ONE
    return [
        Attempt(_Search(shapes, first, share * seconds).run, share * seconds, area, "sparrow", narrowest)
        for share in shares
    ]


@dataclass(frozen=True)
class _Search:
    """One search; it ends on one page that nothing is on yet, or has the `otherwise` instead."""

    shapes: Shapes
    otherwise: Attempt
    seconds: float

    def run(self, wanted: PackInput) -> PackResult:
        """The settled packing of a strip as wide as the page, if that is no higher than the page."""
        found = None if wanted.begun else _solve(wanted, self.seconds)
        if found is not None:
            found = settle(wanted, self.shapes, found)
            high = self.shapes.size[np.arange(len(found.turn)), found.turn, 1]
            if (found.corner[:, 1] + high <= wanted.page[1]).all():
                return found
        return self.otherwise.run(wanted)


def _solve(wanted: PackInput, seconds: float) -> PackResult | None:
    """Places in the strip, or None when the library gives up."""
    import spyrrow

    half = (wanted.padding + 1 + wanted.align) / 2
    items = [
        spyrrow.Item(str(facet), _points(grown_by_square(polygon, half)), 1, [0.0, 90.0, 180.0, 270.0])
        for facet, polygon in enumerate(np.split(wanted.polygon, wanted.corner_start[1:-1]))
    ]
    # The strip grows along its x, so it is the page turned; a step of margin on either side is for rounding.
    across = wanted.page[0] - 2 * wanted.align + 2 * half
    try:
        instance = spyrrow.StripPackingInstance("quilt", across, items)
        config = spyrrow.StripPackingConfig(total_computation_time=max(math.ceil(seconds), 1), seed=0)
        solution = instance.solve(config)
    except BaseException as problem:
        # The library panics where it might raise, and a panic is no Exception.
        if type(problem).__name__ != "PanicException":
            raise
        return None
    return _placed(wanted, solution.placed_items, half)


def _points(polygon: FloatArray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in polygon.tolist()]


def _placed(wanted: PackInput, items: list[Any], half: float) -> PackResult:
    """Whole-pixel places from the strip's: x runs down the page there, and y to its left."""
    count = len(wanted.size)
    turn, corner = np.zeros(count, dtype=np.int32), np.zeros((count, 2), dtype=np.int32)
    down = np.array([[0, -1], [1, 0]])
    step = wanted.align
    for item in items:
        facet, quarters = int(item.id), round(item.rotation / 90) % 4
        turns = np.linalg.matrix_power(down, quarters + 1)
        start = down @ (np.array(item.translation) - half) + (wanted.page[0] - step, step)
        low = start + np.minimum(turns * wanted.size[facet], 0).sum(axis=1)
        turn[facet], corner[facet] = (quarters + 1) % 4, np.floor(low / step + 0.5) * step
    return PackResult(np.zeros(count, dtype=np.int32), turn, np.zeros(count, dtype=np.bool_), corner)
