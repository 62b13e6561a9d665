"""What a packing method is given and what it gives back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, next_in_row
from quiltcli.layout.from_uv import MIRROR, QUARTER_TURNS
from quiltcli.layout.layout import PIXEL_TOLERANCE

FAR = 1 << 30
"""Pixels past the end of any page."""


class Room(NamedTuple):
    """A free rectangle of a page: 0-based page, left, top, width, height in pixels."""

    page: int
    left: int
    top: int
    width: int
    height: int


@dataclass(frozen=True)
class PackInput:
    """Facets to place, in pixels. Every facet fits the page in at least one of its two orientations.

    Attributes:
        size: (n, 2) raster width and height of each facet.
        corner_start: (n+1,) offsets into `polygon`.
        polygon: (C, 2) corners in facet pixels.
        page: width and height of a page.
        padding: pixels to keep free between facets; none is needed at the page's border.
        align: top-left pixels of placed rasters lie at multiples of this.
        mirror: whether rasters may be mirrored.
        rooms: free rectangles of pages that something is on already; none means every page is empty.
        begun: number of those pages; fresh pages are numbered from here on.
        vertex: (C,) number of the display's vertex at each corner; None when it is not known.
    """

    size: Int32Array
    corner_start: IntArray
    polygon: FloatArray
    page: tuple[int, int]
    padding: int
    align: int = 1
    mirror: bool = False
    rooms: tuple[Room, ...] = ()
    begun: int = 0
    vertex: IntArray | None = None


@dataclass(frozen=True)
class PackResult:
    """Places of the facets, on as many pages as it took.

    A facet's raster is mirrored left to right if so asked, then turned clockwise by quarter turns,
    then put with its top-left pixel at `corner`.

    Attributes:
        page: (n,) 0-based page; every page from 0 to the last holds something.
        turn: (n,) quarter turns clockwise, 0 to 3.
        mirror: (n,) whether the raster is mirrored in the quilt.
        corner: (n, 2) pixel x, y of the placed raster's top-left pixel.
        polygon: (C, 2) corners in page pixels, from a method that turns facets by any angle; `turn`
            and `mirror` then mean nothing, and `corner` is the top-left pixel of the polygon's box.
    """

    page: Int32Array
    turn: Int32Array
    mirror: BoolArray
    corner: Int32Array
    polygon: FloatArray | None = None


Method: TypeAlias = Callable[[PackInput], PackResult]


def placed_size(size: Int32Array, turn: Int32Array) -> Int32Array:
    """Width and height (n, 2) of rasters after their quarter turns."""
    result = size.copy()
    odd = turn % 2 == 1
    result[odd] = size[odd][:, ::-1]
    return result


def polygon_areas(wanted: PackInput) -> FloatArray:
    """Pixels (n,) that the facets' polygons enclose, exactly."""
    here, there = wanted.polygon, wanted.polygon[next_in_row(wanted.corner_start)]
    twice = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    result: FloatArray = np.abs(np.add.reduceat(twice, wanted.corner_start[:-1])) / 2
    return result


def grown_size(wanted: PackInput) -> IntArray:
    """What rasters (n, 2) take with their padding to the right and below, in whole steps of the alignment."""
    steps = -(-(wanted.size.astype(np.int64) + wanted.padding) // wanted.align)
    result: IntArray = steps * wanted.align
    return result


def extents(wanted: PackInput, result: PackResult) -> IntArray:
    """Right and lower end (n, 2) of every placed facet, in whole pixels."""
    if result.polygon is None:
        return (result.corner + placed_size(wanted.size, result.turn)).astype(np.int64)
    ends = np.maximum.reduceat(result.polygon, wanted.corner_start[:-1], axis=0)
    return np.ceil(ends - PIXEL_TOLERANCE).astype(np.int64)


def used_height(wanted: PackInput, result: PackResult) -> int:
    """Pixels from the top of the last page to the lower end of what is on it."""
    bottom = extents(wanted, result)[:, 1]
    return int(bottom[result.page == page_count(result) - 1].max(initial=0))


def page_count(result: PackResult) -> int:
    """Number of pages a result takes."""
    return int(result.page.max(initial=-1)) + 1


def cost(wanted: PackInput, result: PackResult) -> tuple[int, int, int]:
    """Pages, height of the last, and how low everything lies: the last leads to what lowers the others."""
    return page_count(result), used_height(wanted, result), int(extents(wanted, result)[:, 1].sum())


def quilt_from_facet(size: Int32Array, result: PackResult) -> FloatArray:
    """Whole-pixel maps (n, 2, 3) that put rasters of `size` (n, 2) where the result has them."""
    turns = QUARTER_TURNS[result.turn]
    turns = np.where(result.mirror[:, None, None], turns @ MIRROR, turns)
    # The turned raster's lowest corner goes to `corner`, whichever corner that is now.
    low = np.minimum(turns * size[:, None, :], 0).sum(axis=2)
    return np.concatenate((turns, (result.corner - low)[:, :, None]), axis=2)
