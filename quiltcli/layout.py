"""The layout: where each facet's pixels lie in the quilt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class Layout:
    """Places of F facets on the pages of a quilt.

    All pages lie in one flat pixel address space: pixel (x, y) of page g has the address
    `page_offset[g] + y·W + x`.

    Attributes:
        facet: (F,) facet ids, 1-based, ascending.
        page: (F,) 0-based page, −1 for a facet that has no place in the quilt.
        size: (F, 2) facet raster width and height, pixels.
        quilt_from_facet: (F, 2, 3) affine maps from facet pixels to pixels of the page.
        origin: (F, 3) world position of the raster's top-left corner, metres.
        du: (F, 3) world step to the next facet pixel right, metres.
        dv: (F, 3) world step to the next facet pixel down, metres.
        corner_start: (F+1,) offsets into `polygon`.
        polygon: (C, 2) corners in facet pixels.
        pages: (G, 2) page width and height, pixels.
        padding: pixels kept free between facets.
        method: name of the packing method, `manual` when made by hand.
        display: the display file the layout was made for.
        display_sha256: hash of that display's geometry.
    """

    facet: Int32Array
    page: Int32Array
    size: Int32Array
    quilt_from_facet: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    corner_start: IntArray
    polygon: FloatArray
    pages: Int32Array
    padding: int
    method: str
    display: str
    display_sha256: str

    @property
    def page_offset(self) -> IntArray:
        """Flat address (G+1,) of every page's first pixel; the last entry is the pixel count."""
        pixels = self.pages[:, 0].astype(np.int64) * self.pages[:, 1]
        return np.concatenate(([0], np.cumsum(pixels)))
