"""The page size when nobody asks for one: a single page, nearly square, as small as can be found."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quiltcli.packing.model import Method, PackInput, PackResult, page_count, placed_size

LARGEST_PAGE = 16384
"""Pixels that GPUs and media servers take in one direction."""

_MULTIPLE = 16  # video codecs like whole macroblocks
_WIDTHS = 24
_EFFORT = 8000  # facets placed in all tries together


def pack_auto(method: Method, wanted: PackInput) -> tuple[PackResult, tuple[int, int]]:
    """Try a range of page widths and keep the smallest page.

    Ties go to the squarest, then the one with fewest turned facets, then the narrowest. A page more
    than three times as long as wide is taken only when there is no other. Pages are at most 16384
    pixels wide and high; a display too large for one is packed on several of that size.
    """
    best: tuple[tuple[bool, int, int, int, int], PackResult, tuple[int, int]] | None = None
    for width in _widths(wanted):
        result = method(replace(wanted, page=(width, LARGEST_PAGE)))
        if page_count(result) > 1:
            continue
        used = (result.corner + placed_size(wanted.size, result.turn)).max(axis=0)
        w, h = (min(_rounded(int(side)), LARGEST_PAGE) for side in used)
        cost = (max(w, h) > 3 * min(w, h), w * h, abs(w - h), int(np.count_nonzero(result.turn)), w)
        if best is None or cost < best[0]:
            best = (cost, result, (w, h))
    if best is not None:
        return best[1], best[2]
    page = (LARGEST_PAGE, LARGEST_PAGE)
    return method(replace(wanted, page=page)), page


def _rounded(pixels: int) -> int:
    return math.ceil(pixels / _MULTIPLE) * _MULTIPLE


def _widths(wanted: PackInput) -> list[int]:
    """Page widths from 0.8 to 1.4 times a square of the facets' area, and that of the widest facet.

    Large displays get fewer tries: their pages fill about as well at any width.
    """
    area = float((wanted.size + wanted.padding).astype(np.int64).prod(axis=1).sum())
    narrowest = int(wanted.size.min(axis=1).max())
    tries = max(3, min(_WIDTHS, _EFFORT // len(wanted.size)))
    sides = math.sqrt(area) * np.linspace(0.8, 1.4, tries)
    widths = {_rounded(max(int(side), narrowest)) for side in (*sides, wanted.size[:, 0].max())}
    return sorted(width for width in widths if width <= LARGEST_PAGE) or [LARGEST_PAGE]
