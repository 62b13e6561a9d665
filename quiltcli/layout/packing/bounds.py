"""What no packing can be better than: the smallest page, and the fewest pages, by area alone.

Every facet takes the pixels it touches and the padding to the right of them and below. Those never
overlap, and none reaches further past the page's right and lower edge than the padding, or than the
next multiple of the alignment.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.layout.packing.model import PackInput

LARGEST_PAGE = 16384
"""Pixels that GPUs and media servers take in one direction."""

MULTIPLE = 16
"""Pages that are chosen are whole blocks of this many pixels each way, as video codecs like them."""

LONGEST = 3
"""A page more than so many times as long as wide is a strip, taken only when there is no other."""


def outline_area(wanted: PackInput, area: FloatArray) -> float:
    """Pixels that facets and their padding take at least, however they interlock.

    Args:
        wanted: the facets.
        area: (n,) pixels of each outline.

    A set of area a grown by a square of side p has at least (√a + p)² (Brunn & Minkowski); a facet
    that fills its raster has exactly as much as the raster grown so.
    """
    size = wanted.size.astype(np.float64)
    # A pixel that the outline reaches into by less than a hundredth is not touched.
    surely = np.maximum(area - 0.02 * size.sum(axis=1), 0)
    grown = (np.sqrt(surely) + wanted.padding) ** 2
    boxes = (size + wanted.padding).prod(axis=1)
    return float(np.where(area > size.prod(axis=1) - 0.5, boxes, grown).sum())


def fewest_pages(wanted: PackInput, least: float) -> int:
    """Pages of the wanted size that `least` pixels of facets and padding take at least."""
    width, height = wanted.page
    over = wanted.padding + wanted.align - 1
    return max(math.ceil(least / ((width + over) * (height + over))), 1)


def smallest_page(
    wanted: PackInput, least: float, narrowest: int, aspect: Fraction | None
) -> tuple[bool, int, int]:
    """What a page costs at least that `least` pixels of facets and padding fit.

    Returns:
        whether it is a strip, its pixels, and width less height, in the order in which pages are
        compared; (False, 0, 0) when nothing is known.
    """
    width: IntArray = np.arange(whole_blocks(narrowest), LARGEST_PAGE + 1, MULTIPLE)
    over = wanted.padding + wanted.align - 1
    if aspect is None:
        height = np.maximum(np.ceil(least / (width + over)).astype(np.int64) - over, narrowest)
        height = -(-height // MULTIPLE) * MULTIPLE
    else:
        height = np.array([height_of(side, aspect) for side in width.tolist()])
        enough = (width + over) * (height + over) >= least
        width, height = width[enough], height[enough]
    long, short = np.maximum(width, height), np.minimum(width, height)
    fits = (height <= LARGEST_PAGE) & (long >= wanted.size.max())
    if aspect is None:
        fits &= long <= LONGEST * short
    if not fits.any():
        return False, 0, 0
    pixels, unequal = (width * height)[fits], np.abs(width - height)[fits]
    best = np.lexsort((unequal, pixels))[0]
    return False, int(pixels[best]), int(unequal[best])


def height_of(width: int, aspect: Fraction) -> int:
    """The even height that goes with a width, rounded up."""
    return 2 * math.ceil(width / aspect / 2)


def whole_blocks(pixels: int) -> int:
    """So many pixels or more, in whole blocks."""
    return math.ceil(pixels / MULTIPLE) * MULTIPLE
