"""ST maps: for every pixel of an image, where in another image it comes from.

Red runs from 0 at the left border to 1 at the right, green from 0 at the bottom to 1 at the top, in
single precision; pixel (x, y) of an untouched picture holds ((x + ½)/W, 1 − (y + ½)/H).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.display import Facets
from quiltcli.exchange.pixelmaps.naming import page_files
from quiltcli.exchange.pixelmaps.placing import placed_rows
from quiltcli.formats.exr.image import write_exr
from quiltcli.formats.whole import make_folder
from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.images.facets import facet_image, page_of
from quiltcli.layout import Layout, pixel_owners


def write_st_maps(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write the map of every page, and beside them, in the folder NAME_facets, that of every facet.

    A facet's map, of the facet's raster, takes its image out of the quilt; a page's map, of the
    page's size, puts facet images into it: B says of which facet, by id, a pixel shows a part.
    """
    owners = pixel_owners(layout)
    written = []
    for page, file in enumerate(page_files(path, len(layout.pages))):
        red, green, facet = page_st_map(layout, page, owners)
        alpha = (facet > 0).astype(np.float32)
        _write(file, {"R": red, "G": green, "B": facet, "A": alpha}, {"quilt:page": page + 1})
        written.append(file)
    folder = path.with_name(f"{path.stem}_facets")
    make_folder(folder)
    for row in placed_rows(layout):
        number = int(layout.facet[row])
        red, green = facet_st_map(layout, row)
        inside = facet_image({"id": owners}, layout, row, owners)["id"] == number
        page = int(layout.page[row]) + 1
        attributes = {"quilt:facet": number, "quilt:page": page}
        file = folder / f"facet_{number:04d}.exr"
        channels = {"R": red, "G": green, "B": np.zeros_like(red), "A": inside.astype(np.float32)}
        _write(file, channels, attributes)
        written.append(file)
    return written


def _write(path: Path, channels: dict[str, Float32Array], attributes: Mapping[str, object]) -> None:
    write_exr(path, channels, {**attributes, "quilt:stmap": "R = x from the left, G = y from the bottom"})


def facet_st_map(layout: Layout, row: int) -> tuple[Float32Array, Float32Array]:
    """Red and green (H, W) of a facet's raster: where on its page each pixel's centre lies.

    Outside the polygon the map goes on in the same way, so that filters find no edge.
    """
    width, height = (int(side) for side in layout.size[row])
    page_width, page_height = layout.pages[layout.page[row]]
    x, y = centres_mapped(layout.quilt_from_facet[row], width, height)
    return (x / page_width).astype(np.float32), (1 - y / page_height).astype(np.float32)


def page_st_map(
    layout: Layout, page: int, owners: NDArray[np.integer[Any]]
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Red, green and facet id (H, W) of a page (0-based): where in its facet's image each pixel lies.

    Pixels of no facet hold 0.
    """
    width, height = (int(side) for side in layout.pages[page])
    here = page_of(owners, layout, page)
    found = np.zeros((3, height, width), dtype=np.float32)
    for row in np.flatnonzero(layout.page == page).tolist():
        back = np.linalg.inv(np.vstack((layout.quilt_from_facet[row], [0, 0, 1])))[:2]
        rows, columns = _window(layout, row)
        mine: BoolArray = here[rows, columns] == layout.facet[row]
        x, y = centres_mapped(back, mine.shape[1], mine.shape[0], columns.start, rows.start)
        size = layout.size[row]
        for channel, value in enumerate((x / size[0], 1 - y / size[1], np.float64(layout.facet[row]))):
            np.copyto(found[channel, rows, columns], value, where=mine, casting="same_kind")
    return found[0], found[1], found[2]


def _window(layout: Layout, row: int) -> tuple[slice, slice]:
    """Rows and columns of the page that hold the facet's polygon."""
    corners = layout.outline(row)
    matrix = layout.quilt_from_facet[row]
    quilt = corners @ matrix[:, :2].T + matrix[:, 2]
    width, height = layout.pages[layout.page[row]]
    low = np.clip(np.floor(quilt.min(axis=0)) - 1, 0, (width, height)).astype(int)
    high = np.clip(np.ceil(quilt.max(axis=0)) + 1, low, (width, height)).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def centres_mapped(
    matrix: FloatArray, width: int, height: int, left: int = 0, top: int = 0
) -> tuple[FloatArray, FloatArray]:
    """Centres of a block of pixels through an affine map (2, 3); x and y, each (H, W)."""
    i, j = np.arange(left, left + width) + 0.5, np.arange(top, top + height)[:, None] + 0.5
    x, y = (line[0] * i + line[1] * j + line[2] for line in matrix)
    return x, y
