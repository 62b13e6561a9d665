"""What a packing method is given and what it gives back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class PackInput:
    """Facets to place, in pixels. Every facet fits the page in at least one of its two orientations.

    Attributes:
        size: (n, 2) raster width and height of each facet.
        corner_start: (n+1,) offsets into `polygon`.
        polygon: (C, 2) corners in facet pixels.
        page: width and height of a page.
        padding: pixels to keep free between facets; none is needed at the page's border.
    """

    size: Int32Array
    corner_start: IntArray
    polygon: FloatArray
    page: tuple[int, int]
    padding: int


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
    """

    page: Int32Array
    turn: Int32Array
    mirror: BoolArray
    corner: Int32Array


Method: TypeAlias = Callable[[PackInput], PackResult]


def placed_size(size: Int32Array, turn: Int32Array) -> Int32Array:
    """Width and height (n, 2) of rasters after their quarter turns."""
    result = size.copy()
    odd = turn % 2 == 1
    result[odd] = size[odd][:, ::-1]
    return result


def page_count(result: PackResult) -> int:
    """Number of pages a result takes."""
    return int(result.page.max(initial=-1)) + 1
