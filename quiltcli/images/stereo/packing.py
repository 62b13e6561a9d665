"""Both eyes' images in one: side by side, one above the other, or in turn by rows, columns or pixels.

Images are (C, H, W). What takes turns begins with the left eye at the panel's top-left pixel. Where the
panels lie in a page turned or mirrored, rows and columns are those of the panel, not of the page.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, IntArray

Column = IntArray
Row = IntArray


@dataclass(frozen=True)
class Raster:
    """Which column and row of its own panel each pixel of an image is.

    Attributes:
        column: (H, W), or (1, W) where all rows agree.
        row: (H, W) or (H, 1).
    """

    column: Column
    row: Row


def own_raster(height: int, width: int) -> Raster:
    """The raster of an image that is a panel itself."""
    return Raster(np.arange(width)[None], np.arange(height)[:, None])


def side_by_side(left: Float32Array, right: Float32Array) -> Float32Array:
    """The left eye's image at the left (C, H, 2W)."""
    return np.concatenate((left, right), axis=2)


def top_bottom(left: Float32Array, right: Float32Array) -> Float32Array:
    """The left eye's image above (C, 2H, W)."""
    return np.concatenate((left, right), axis=1)


def side_by_side_half(left: Float32Array, right: Float32Array) -> Float32Array:
    """Both squeezed to half their width; of an odd one the left eye's has the column more (C, H, W)."""
    width = left.shape[2]
    return np.concatenate((squeezed(left, width - width // 2), squeezed(right, width // 2)), axis=2)


def top_bottom_half(left: Float32Array, right: Float32Array) -> Float32Array:
    """Both squeezed to half their height; of an odd one the left eye's has the row more (C, H, W)."""
    turned = (np.swapaxes(image, 1, 2) for image in (left, right))
    return np.swapaxes(side_by_side_half(*turned), 1, 2)


def squeezed(image: Float32Array, width: int) -> Float32Array:
    """An image (C, H, W) squeezed to `width` columns: each is the mean of what it covers."""
    before = image.shape[2]
    if not width:
        return image[:, :, :0]
    # The sum of all columns left of a place, between columns on a straight line.
    sums = np.zeros((*image.shape[:2], before + 1))
    np.cumsum(image, axis=2, out=sums[:, :, 1:])
    ends = np.arange(width + 1) * (before / width)
    first = np.minimum(ends.astype(np.int64), before - 1)
    share = ends - first
    at = sums[:, :, first] * (1 - share) + sums[:, :, first + 1] * share
    result: Float32Array = (np.diff(at, axis=2) * (width / before)).astype(np.float32)
    return result


def interleaved(left: Float32Array, right: Float32Array, mode: str, raster: Raster) -> Float32Array:
    """Each pixel one eye's (C, H, W), by the pixel's row or column in its panel."""
    return np.where(TURNS[mode](raster), right, left)


TURNS: Mapping[str, Callable[[Raster], BoolArray]] = MappingProxyType(
    {
        "rows": lambda raster: np.asarray(raster.row % 2 == 1),
        "columns": lambda raster: np.asarray(raster.column % 2 == 1),
        "checkerboard": lambda raster: np.asarray((raster.row + raster.column) % 2 == 1),
    }
)
"""Which pixels are the right eye's."""

PACKINGS: Mapping[str, Callable[[Float32Array, Float32Array], Float32Array]] = MappingProxyType(
    {
        "side-by-side": side_by_side,
        "side-by-side-half": side_by_side_half,
        "top-bottom": top_bottom,
        "top-bottom-half": top_bottom_half,
    }
)
"""Packings that depend on nothing but the two images."""


def with_sync_line(image: Float32Array, eye: str) -> Float32Array:
    """The image (C, H, W) with the blue line in its last row that shutter glasses follow.

    Blue over the first quarter of the width for the left eye, over three quarters for the right, black
    behind (the blue-line code of StereoGraphics).
    """
    result = image.copy()
    width = image.shape[2]
    result[:3, -1] = 0
    result[2, -1, : width * (3 if eye == "right" else 1) // 4] = 1
    return result
