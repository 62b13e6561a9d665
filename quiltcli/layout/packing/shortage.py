"""What to say when facets do not fit: how much is missing, and what would do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quiltcli.errors import counted
from quiltcli.job.layout import PACKING_METHODS, PackSpec
from quiltcli.layout.packing.bounds import LARGEST_PAGE
from quiltcli.layout.packing.methods import METHODS
from quiltcli.layout.packing.model import PackInput, PackResult, page_count
from quiltcli.layout.packing.search import best_pages

_SHARE = 0.2  # of the time, for each try at another density or size


def shortage(wanted: PackInput, result: PackResult, wishes: PackSpec, size: tuple[int, int]) -> str:
    """The message when a packing takes more pages than allowed.

    Density and size are found by halving, with the first attempts of the same method: what they fit,
    the method fits.
    """
    most = wishes.max_pages or 0
    outside = result.page >= most
    missing = int(wanted.size[outside].astype(np.int64).prod(axis=1).sum())
    pages = max(page_count(result), wanted.begun)
    said = (
        f"{counted(len(wanted.size), 'facet')} take {counted(pages, 'page')} of {size[0]}×{size[1]} pixels"
        f" by the method {wishes.method}, but at most {most} may be used; {counted(missing, 'pixel')} of"
        f" {counted(int(outside.sum()), 'facet')} find no place"
    )
    ways = []
    density = _density(wanted, wishes, size)
    if density:
        ways.append(f"a density of at most {density / 10:g} % of the present one would do")
    larger = _larger(wanted, wishes, size)
    if larger is not None:
        ways.append(f"pages of {larger[0]}×{larger[1]} would")
    return "; ".join((said, ", or ".join(ways))) if ways else said


def _density(wanted: PackInput, wishes: PackSpec, size: tuple[int, int]) -> int:
    """Greatest density that fits, in thousandths of the present one; 0 when none does."""
    low, high = 0, 1000
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _fits(scaled(wanted, middle / 1000), wishes, size) else (low, middle)
    return low


def scaled(wanted: PackInput, factor: float) -> PackInput:
    """The same facets with fewer pixels, as the display would have them at that density."""
    polygon = wanted.polygon * factor
    ends = np.maximum.reduceat(polygon, wanted.corner_start[:-1], axis=0)
    size = np.maximum(np.ceil(ends - 1e-6), 1).astype(np.int32)
    return replace(wanted, polygon=polygon, size=np.minimum(size, wanted.size))


def _larger(wanted: PackInput, wishes: PackSpec, size: tuple[int, int]) -> tuple[int, int] | None:
    """Smallest page of the same shape that fits, to about a hundredth; None when none is small enough."""
    if wanted.begun:
        return None

    def shape(width: int) -> tuple[int, int]:
        return width, 2 * math.ceil(width * size[1] / size[0] / 2)

    low, high = size[0], 2 * math.ceil(size[0] * 1.05 / 2)
    while not _fits(wanted, wishes, shape(high)):
        low, high = high, 2 * math.ceil(high * 1.3 / 2)
        if max(shape(high)) > LARGEST_PAGE:
            return None
    while high - low > max(2, low // 100):
        middle = 2 * math.ceil((low + high) / 4)
        low, high = (low, middle) if _fits(wanted, wishes, shape(middle)) else (middle, high)
    return shape(high)


def _fits(wanted: PackInput, wishes: PackSpec, size: tuple[int, int]) -> bool:
    wanted = replace(wanted, page=size)
    sides = np.sort(wanted.size, axis=1)
    if (sides > np.sort(size)).any():
        return False
    searches = METHODS[PACKING_METHODS[wishes.method]](wanted, wishes.seconds)
    return page_count(best_pages(searches, wanted, wishes.seconds * _SHARE)) <= (wishes.max_pages or 0)
