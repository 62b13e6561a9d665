"""Facet images out of a quilt, and back into it.

A packed layout moves facets by whole pixels with quarter turns and mirrors: an image is then a view
of the quilt, turned, and copying it changes no bit. Through any other affine map the pixel under the
mapped pixel centre is taken (nearest sampling), in both directions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import BACKGROUND
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.layout import Layout

Channel: TypeAlias = NDArray[Any]

_WHOLE = 1e-3  # pixels a raster's corners may be off a whole-pixel map: centres stay in the same pixels


def facet_image(
    buffers: Mapping[str, Channel],
    layout: Layout,
    row: int,
    owners: NDArray[np.integer[Any]],
    background: Mapping[str, float] = BACKGROUND,
) -> dict[str, Channel]:
    """Cut the image of one facet out of a quilt.

    Args:
        buffers: name → flat planar channel over all pages of the layout.
        layout: where the facets are.
        row: the facet's row in the layout's arrays.
        owners: flat, as `buffers`: the facet's id (1-based) inside its polygon, anything else outside.
        background: value by channel outside the polygon, 0 where not named.

    Returns:
        name → (H, W) C-contiguous copy, of the buffer's dtype. A facet without a page is all background.
    """
    page = int(layout.page[row])
    if page < 0:
        width, height = layout.size[row]
        return {
            name: np.full((height, width), background.get(name, 0), flat.dtype)
            for name, flat in buffers.items()
        }
    pages = {name: page_of(flat, layout, page) for name, flat in buffers.items()}
    return cut_facet(pages, layout, row, page_of(owners, layout, page), background)


def page_of(flat: Channel, layout: Layout, page: int) -> Channel:
    """View (H, W) of one page (0-based) of a flat buffer."""
    start, stop = layout.page_offset[page : page + 2]
    width, height = layout.pages[page]
    return flat[start:stop].reshape(height, width)


def cut_facet(
    pixels: Mapping[str, Channel],
    layout: Layout,
    row: int,
    owners: NDArray[np.integer[Any]],
    background: Mapping[str, float] = BACKGROUND,
) -> dict[str, Channel]:
    """As `facet_image`, from the (H, W) channels and owners of the facet's own page."""
    width, height = layout.size[row]
    window = _window(layout, row)
    samples = None if window else _page_address(layout, row)
    facet = layout.facet[row]
    inside = _taken(owners, window, samples) == facet
    if samples is not None:
        inside &= samples >= 0
    cut = {}
    for name, channel in pixels.items():
        image = np.full((height, width), background.get(name, 0), channel.dtype)
        np.copyto(image, _taken(channel, window, samples), where=inside)
        cut[name] = image
    return cut


def _taken(channel: Channel, window: Window | None, samples: IntArray | None) -> Channel:
    """The facet's raster (H, W) as seen in a page channel: a turned view, or samples of it."""
    return window.view(channel) if window else channel.reshape(-1)[samples]


@dataclass(frozen=True)
class Window:
    """A rectangle of a page seen as a facet's raster: cropped, turned, mirrored, never copied.

    Attributes:
        low, high: the rectangle's bounds (x, y) in page pixels, `high` exclusive.
        swap: whether the facet's rows run along the page's columns.
        step_i, step_j: ±1, the way facet columns and rows run along the page.
    """

    low: tuple[int, int]
    high: tuple[int, int]
    swap: bool
    step_i: int
    step_j: int

    def view(self, channel: Channel) -> Channel:
        """The rectangle of `channel` (page H, W) as an array (facet H, W)."""
        (x0, y0), (x1, y1) = self.low, self.high
        part = channel[y0:y1, x0:x1]
        return (part.T if self.swap else part)[:: self.step_j, :: self.step_i]


def _window(layout: Layout, row: int) -> Window | None:
    """The window of a facet that moves by whole pixels; None of any other, or one that leaves its page."""
    matrix = layout.quilt_from_facet[row]
    size = layout.size[row].astype(np.int64)
    whole = np.rint(matrix).astype(np.int64)
    turn = np.abs(whole[:, :2])
    off = np.abs(matrix - whole) @ [*size, 1.0]
    if (turn.sum(axis=0) != 1).any() or (turn.sum(axis=1) != 1).any() or off.max() > _WHOLE:
        return None
    ends = np.stack((whole[:, 2], whole @ [*size, 1]))
    low, high = ends.min(axis=0), ends.max(axis=0)
    if (low < 0).any() or (high > layout.pages[layout.page[row]]).any():
        return None
    step_i, step_j = whole[:, :2].sum(axis=0)
    return Window((low[0], low[1]), (high[0], high[1]), bool(turn[0, 1]), int(step_i), int(step_j))


def _page_address(layout: Layout, row: int) -> IntArray:
    """Address (H, W) within the page of the pixel under each facet pixel's centre; −1 off the page."""
    width, height = layout.size[row]
    page_width, page_height = layout.pages[layout.page[row]]
    x, y = _mapped(layout.quilt_from_facet[row], np.arange(width), np.arange(height)[:, None])
    inside = (x >= 0) & (x < page_width) & (y >= 0) & (y < page_height)
    return np.where(inside, y * np.int64(page_width) + x, -1)


def _mapped(matrix: FloatArray, i: IntArray, j: IntArray) -> tuple[IntArray, IntArray]:
    """Pixels under the centres of pixels (i, j) through an affine map (2, 3)."""
    centre_i, centre_j = i + 0.5, j + 0.5
    x = matrix[0, 0] * centre_i + matrix[0, 1] * centre_j + matrix[0, 2]
    y = matrix[1, 0] * centre_i + matrix[1, 1] * centre_j + matrix[1, 2]
    return np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)


def quilt_buffers(
    images: Mapping[int, Mapping[str, Channel]],
    layout: Layout,
    owners: NDArray[np.integer[Any]],
    background: Mapping[str, float] = BACKGROUND,
) -> dict[str, Channel]:
    """Put facet images back into a quilt: the inverse of `facet_image`.

    Args:
        images: row of the layout → name → (H, W) channel; all with the same channels.
        layout: where the facets are.
        owners: flat: the facet id at the pixels inside its polygon; no other pixel is written.
        background: value by channel of pixels no image covers, 0 where not named.

    Returns:
        name → flat buffer over all pages.
    """
    some = next(iter(images.values()), {})
    size = int(layout.page_offset[-1])
    quilt = {name: np.full(size, background.get(name, 0), image.dtype) for name, image in some.items()}
    for row in sorted(images):
        if layout.page[row] >= 0:
            _put_facet(quilt, images[row], layout, row, owners)
    return quilt


def lay_facet(
    quilt: Mapping[str, Channel],
    image: Mapping[str, Channel],
    layout: Layout,
    row: int,
    owners: NDArray[np.integer[Any]],
    bleed: int,
) -> None:
    """Put the image of one facet into a quilt, and repeat its edge in the facet's bleed.

    Args:
        quilt: name → flat buffer over all pages, written to.
        image: name → (H, W) channel.
        layout: where the facets are.
        row: the facet's row in the layout.
        owners: flat: the facet's id inside its polygon, minus the id in its bleed.
        bleed: how far from the polygon that may be, pixels.
    """
    page, facet = int(layout.page[row]), layout.facet[row]
    if page < 0:
        return
    pages = {name: page_of(quilt[name], layout, page) for name in image}
    x0, y0, x1, y1 = surroundings(layout, row, bleed + 1)
    left = np.abs(page_of(owners, layout, page)[y0:y1, x0:x1]) == facet
    if window := _window(layout, row):
        mine = np.abs(window.view(page_of(owners, layout, page))) == facet
        for name, channel in image.items():
            np.copyto(window.view(pages[name]), channel, where=mine)
        (low_x, low_y), (high_x, high_y) = window.low, window.high
        left[low_y - y0 : high_y - y0, low_x - x0 : high_x - x0] = False
    y, x = np.nonzero(left)
    back = np.linalg.inv(np.vstack((layout.quilt_from_facet[row], [0, 0, 1])))[:2]
    i, j = _mapped(back, x + x0, y + y0)
    width, height = layout.size[row].tolist()
    i, j = np.clip(i, 0, width - 1), np.clip(j, 0, height - 1)
    for name, channel in image.items():
        pages[name][y + y0, x + x0] = channel[j, i]


def surroundings(layout: Layout, row: int, reach: int) -> tuple[int, int, int, int]:
    """Bounds x0, y0, x1, y1 on the page of a facet's raster and what lies within reach of it."""
    width, height = layout.size[row].tolist()
    corners = np.array([[0, width, 0, width], [0, 0, height, height], [1, 1, 1, 1]])
    at = layout.quilt_from_facet[row] @ corners
    page = layout.pages[layout.page[row]]
    low = np.clip(np.floor(at.min(axis=1)).astype(np.int64) - reach, 0, page)
    high = np.clip(np.ceil(at.max(axis=1)).astype(np.int64) + reach, low, page)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _put_facet(
    quilt: Mapping[str, Channel],
    image: Mapping[str, Channel],
    layout: Layout,
    row: int,
    owners: NDArray[np.integer[Any]],
) -> None:
    page = int(layout.page[row])
    owners, facet = page_of(owners, layout, page), layout.facet[row]
    if window := _window(layout, row):
        mine = window.view(owners) == facet
        for name, channel in image.items():
            np.copyto(window.view(page_of(quilt[name], layout, page)), channel, where=mine)
        return
    y, x = np.nonzero(owners == facet)
    back = np.linalg.inv(np.vstack((layout.quilt_from_facet[row], [0, 0, 1])))[:2]
    i, j = _mapped(back, x, y)
    width, height = layout.size[row]
    known = (i >= 0) & (i < width) & (j >= 0) & (j < height)
    for name, channel in image.items():
        page_of(quilt[name], layout, page)[y[known], x[known]] = channel[j[known], i[known]]
