"""Nesting by true outlines: interlocking shelves, and for few facets a mosaic improved step by step."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from quiltcli.layout.packing.attempt import SLOW, Attempt, least_width
from quiltcli.layout.packing.bounds import outline_area
from quiltcli.layout.packing.model import PackInput, PackResult, polygon_areas
from quiltcli.layout.packing.outlines.improve import Mosaic
from quiltcli.layout.packing.outlines.pile import Pile
from quiltcli.layout.packing.outlines.settle import settle
from quiltcli.layout.packing.outlines.shapes import Shapes, all_rectangles, facet_shapes
from quiltcli.layout.packing.outlines.shelves import ShelfRule, pack_shelves

_RULES = (
    ShelfRule(window=12, slack=10, levels=4),
    ShelfRule(window=40, slack=10, levels=4, reach=12),
    ShelfRule(window=40, slack=20, levels=8, reach=12),
    ShelfRule(window=12, slack=3, levels=2),
    ShelfRule(window=1, slack=3, levels=2),
    ShelfRule(window=100, slack=20, levels=8, reach=10),
    ShelfRule(window=40, slack=15, levels=6, reach=12),
    ShelfRule(window=100, slack=15, levels=6, reach=10),
)
FEW = 120
"""Facets up to which a mosaic pays."""

_OWN, _TRIANGLES, _RECTANGLES = 0.5, 0.58, 0.9
"""What tells shapes that are all different: sizes to a shape, and the part of its box that it fills."""

_IMPROVING = 0.3  # of the time, for improving the mosaic on one page width


def nest_attempts(wanted: PackInput, seconds: float) -> list[Attempt]:
    """Shelves by several rules; for few facets mosaics too, improved in more steps for more time."""
    boxes = wanted.size.astype(np.float64).prod(axis=1)
    least = outline_area(wanted, boxes if all_rectangles(wanted) else polygon_areas(wanted))
    return [
        replace(attempt, least=least) for attempt in shape_attempts(wanted, facet_shapes(wanted), seconds)
    ]


def shape_attempts(wanted: PackInput, shapes: Shapes, seconds: float) -> list[Attempt]:
    """As `nest_attempts`, for shapes that need not be facets; sizes are those of the input."""
    margin = (wanted.size.sum(axis=1) * wanted.padding).sum()
    area = float(shapes.area.sum() + margin)
    narrowest = least_width(wanted)
    shelves = [
        Attempt(
            partial(_shelves, shapes=shapes, rule=rule),
            _shelf_seconds(shapes, rule),
            area,
            "shelves",
            narrowest,
        )
        for rule in _RULES
    ]
    if len(wanted.size) > FEW:
        return [_pile(wanted, shapes, area), *shelves] if _unlike(shapes) else shelves
    return [*shelves, *_mosaics(wanted, shapes, area, seconds)]


def _shelves(wanted: PackInput, shapes: Shapes, rule: ShelfRule) -> PackResult:
    result = pack_shelves(wanted, shapes, rule)
    return settle(wanted, shapes, result) if len(result.page) <= FEW else result


def _shelf_seconds(shapes: Shapes, rule: ShelfRule) -> float:
    count, orientations = shapes.size.shape[:2]
    height = float(shapes.size[:, :, 1].mean())
    each = 40e-6 + rule.window * rule.levels * orientations * (20e-9 + 1e-9 * height)
    return float(SLOW * count * each)


def _mosaics(wanted: PackInput, shapes: Shapes, area: float, seconds: float) -> list[Attempt]:
    """A first mosaic to try on many pages, then one improved for as long as there is time."""
    side, narrowest = math.sqrt(area), least_width(wanted)
    cell = _cell(side / 256, wanted.align)
    # Every row of cells of every shape costs a few operations on numbers as long as the page is large.
    count, grid = len(wanted.size), side / cell
    rows = math.sqrt(count) * shapes.size.shape[1] * grid
    once = SLOW * (rows * (1e-6 + 1.4e-6 * (grid / 256) ** 2) + 5e-5 * count)
    steps = int(_IMPROVING * seconds / once)
    first, better = Mosaic(shapes, cell, 0), Mosaic(shapes, cell, steps)
    return [
        Attempt(first.run, once, area, "mosaic", narrowest),
        Attempt(better.run, (steps + 1) * once, area, "mosaic", narrowest),
    ]


def _unlike(shapes: Shapes) -> bool:
    """Whether most shapes are of a size of their own, and neither triangles nor rectangles.

    Those stand well in rows: triangles head up and head down, rectangles as they are.
    """
    size = shapes.size[:, 0].astype(np.int64)
    own = len(np.unique(size, axis=0)) > _OWN * len(size)
    filled = float(shapes.area.sum() / size.prod(axis=1).sum())
    return own and _TRIANGLES < filled < _RECTANGLES


def _pile(wanted: PackInput, shapes: Shapes, area: float) -> Attempt:
    """A pile, which pays for many shapes that are all different."""
    heights = shapes.size[:, :, 1]
    cell = _cell(float(heights.mean()) / 22, wanted.align)
    band = math.ceil(1.4 * float(heights.min(axis=1).max()) / cell)
    rows = float(heights.sum()) / cell
    bits = math.sqrt(area) / cell * band
    once = SLOW * (1e-3 * len(wanted.size) + rows * (1.5e-6 + 2e-6 * bits / 65536))
    return Attempt(Pile(shapes, cell, band).run, once, area, "pile", least_width(wanted))


def _cell(pixels: float, align: int) -> int:
    return max(align, round(pixels / align) * align)
