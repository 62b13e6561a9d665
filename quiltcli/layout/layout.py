"""The layout record: where each facet's pixels lie in the quilt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, Self

import numpy as np

from quiltcli.errors import Problem
from quiltcli.geometry import BoolArray, FloatArray, IntArray, offsets, segments
from quiltcli.job.layout_table import Places

PIXEL_TOLERANCE = 0.01
"""Pixels by which corners may miss: texture coordinates of six digits, on an 8192 canvas, miss by this."""


class Place(Protocol):
    """Something that can say where in a file a key stands."""

    def problem(self, key: Sequence[str | int], message: str) -> Problem:
        """A problem with file, line, column and key filled in."""


@dataclass(frozen=True)
class Packed:
    """What a layout was packed from, by hashes; see `PackedSpec`."""

    wishes_sha256: str
    facets_sha256: str
    places_sha256: str


@dataclass(frozen=True, eq=False)
class Layout(Places):
    """Places of F facets, by ascending id, on the pages of a quilt.

    All pages lie in one flat pixel address space: pixel (x, y) of page g has the address
    `page_offset[g] + y·W + x`.

    Attributes:
        method: name of the packing method, `manual` when made by hand.
        display: the display file the layout was made for.
        display_sha256: hash of that display's geometry.
        packed: what it was packed from, None when it was not packed.
        path: the layout file it was read from, empty when it was made by the program.
        place: finds lines in that file, None when it was made by the program.
        file_row: (F,) row of each facet in the file, None when it was made by the program.
        masks: by facet id, the pixels (H, W) of facets that are not all there.
        surfaces: by facet id, names of curved facets.
    """

    method: str
    display: str
    display_sha256: str
    packed: Packed | None = None
    path: str = ""
    place: Place | None = field(default=None, repr=False)
    file_row: IntArray | None = field(default=None, repr=False)
    masks: Mapping[int, BoolArray] = field(default_factory=dict, repr=False)
    surfaces: Mapping[int, str] = field(default_factory=dict, repr=False)

    @property
    def page_offset(self) -> IntArray:
        """Flat address (G+1,) of every page's first pixel; the last entry is the pixel count."""
        pixels = self.pages[:, 0].astype(np.int64) * self.pages[:, 1]
        return offsets(pixels)

    def taken(self, rows: IntArray) -> Self:
        """Some of the facets, in this order, on the same pages."""
        kept = super().taken(rows)
        return kept if self.file_row is None else replace(kept, file_row=self.file_row[rows])

    def problem(self, message: str, row: int = -1, key: str = "") -> Problem:
        """A problem with this layout, told with the line it stands on when that is known.

        Args:
            message: what is wrong; it must name the facet by itself.
            row: row of the arrays, −1 when no single facet is at fault.
            key: the key inside the facet's entry, or of the whole file.
        """
        if self.place is None or self.file_row is None:
            return Problem(message, file=self.path or self.display)
        path: list[str | int] = [] if row < 0 else ["facets", int(self.file_row[row])]
        return self.place.problem([*path, key] if key else path, message)


def quilt_polygons(layout: Layout) -> FloatArray:
    """Corners (C, 2) of all facets in pixels of their pages."""
    row, _ = segments(layout.corner_start)
    maps = layout.quilt_from_facet[row]
    x, y = layout.polygon[:, 0], layout.polygon[:, 1]
    # Summed from the left: a whole-pixel map then adds its offset last, in one rounding.
    result: FloatArray = maps[:, :, 0] * x[:, None] + maps[:, :, 1] * y[:, None] + maps[:, :, 2]
    return result


def whole_pixel(layout: Layout) -> BoolArray:
    """Facets (F,) whose map is a whole-pixel translation with quarter turns, and perhaps a mirror.

    Their images are copied to and from the quilt pixel by pixel, never resampled.
    """
    linear, offset = layout.quilt_from_facet[:, :, :2], layout.quilt_from_facet[:, :, 2]
    units = (np.abs(linear) == 1).sum(axis=(1, 2)) == 2
    square = (np.abs(linear).sum(axis=1) == 1).all(axis=1) & (np.abs(linear).sum(axis=2) == 1).all(axis=1)
    result: BoolArray = units & square & (offset == np.rint(offset)).all(axis=1)
    return result


def facet_pixels_inside_page(layout: Layout) -> BoolArray:
    """Facets (F,) whose whole raster, not only its polygon, lies on their page."""
    corners = np.zeros((layout.facet.size, 4, 2))
    corners[:, 1:3, 0] = layout.size[:, :1]
    corners[:, 2:, 1] = layout.size[:, 1:]
    maps = layout.quilt_from_facet
    placed = np.einsum("fij,fkj->fki", maps[:, :, :2], corners) + maps[:, None, :, 2]
    limit = layout.pages[layout.page][:, None, :]
    result: BoolArray = ((placed >= 0) & (placed <= limit)).all(axis=(1, 2)) | (layout.page < 0)
    return result
