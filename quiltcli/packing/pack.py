"""From a display to a layout: choose the page, run the method, write down the transforms."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping

import numpy as np

from quiltcli.display import Facets, corner_pixels
from quiltcli.errors import LayoutError, Problem, raise_all
from quiltcli.geometry import Int32Array, segments
from quiltcli.layout.fromuv import MIRROR, QUARTER_TURNS
from quiltcli.layout.record import Layout
from quiltcli.packing.autosize import LARGEST_PAGE, pack_auto
from quiltcli.packing.maxrects import pack_maxrects
from quiltcli.packing.model import Method, PackInput, PackResult, page_count
from quiltcli.packing.rows import pack_rows

METHODS: Mapping[str, Method] = {"maxrects": pack_maxrects, "rows": pack_rows}
DEFAULT_METHOD = "maxrects"
_MOST_PROBLEMS = 10


def pack(
    facets: Facets,
    method: str = DEFAULT_METHOD,
    size: tuple[int, int] | None = None,
    padding: int = 2,
    max_pages: int | None = None,
) -> Layout:
    """Lay out the display's enabled facets on pages of a quilt; no image is resampled.

    Args:
        facets: the display; a facet's raster is placed as it is, or turned by quarter turns.
        method: a name of `METHODS`.
        size: page width and height in pixels; None chooses one page that holds everything.
        padding: pixels to keep free between facets.
        max_pages: most pages to take; None takes as many as are needed.

    Raises:
        LayoutError: an argument makes no sense, a facet is larger than the page, or there are more
            pages than allowed; the message says what would do.
    """
    raise_all(LayoutError, _bad_arguments(facets, method, size, padding, max_pages))
    rows = np.flatnonzero(facets.enabled)
    raise_all(LayoutError, _too_large(facets, rows, size))
    wanted = _pack_input(facets, rows, size or (LARGEST_PAGE, LARGEST_PAGE), padding)
    if size is None:
        result, size = pack_auto(METHODS[method], wanted)
    else:
        result = METHODS[method](wanted)
    needed = page_count(result)
    if max_pages is not None and needed > max_pages:
        raise LayoutError(
            Problem(
                f"{len(rows)} facets take {_pages(needed)} of {size[0]}×{size[1]} pixels by the method"
                f" {method}, but at most {max_pages} may be used",
                file=facets.path,
            )
        )
    return _layout(facets, rows, wanted, result, size, method)


def _pages(count: int) -> str:
    return "1 page" if count == 1 else f"{count} pages"


def _bad_arguments(
    facets: Facets, method: str, size: tuple[int, int] | None, padding: int, max_pages: int | None
) -> Iterator[Problem]:
    if method not in METHODS:
        near = difflib.get_close_matches(method, METHODS, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        yield Problem(f"unknown packing method {method!r} (known: {', '.join(METHODS)}{hint})")
    if size is not None and min(size) < 1:
        yield Problem(f"page size {size[0]}×{size[1]}; both must be at least 1 pixel")
    if padding < 0:
        yield Problem(f"padding {padding}; it must be 0 pixels or more")
    if max_pages is not None and max_pages < 1:
        yield Problem(f"at most {max_pages} pages; it must be at least 1")
    if not facets.enabled.any():
        yield Problem("no facet is enabled, so there is nothing to pack", file=facets.path)


def _too_large(facets: Facets, rows: np.ndarray, size: tuple[int, int] | None) -> Iterator[Problem]:
    """Facets that no turn makes fit, with the page or density that would hold them."""
    limit = sorted(size or (LARGEST_PAGE, LARGEST_PAGE))
    sides = np.sort(facets.size[rows], axis=1)
    large = np.flatnonzero((sides > limit).any(axis=1))
    width, height = size or (LARGEST_PAGE, LARGEST_PAGE)
    for at in large[:_MOST_PROBLEMS]:
        row = int(rows[at])
        name = f" ({facets.names[row]})" if facets.names[row] else ""
        w, h = facets.size[row]
        density = 100 * min(limit[0] / sides[at, 0], limit[1] / sides[at, 1])
        yield Problem(
            f"facet {row + 1}{name} is {w}×{h} pixels, more than a {width}×{height} page holds turned or not;"
            f" a page of {sides[:, 1].max()}×{sides[:, 0].max()} would, or a density of at most"
            f" {math.floor(density * 10) / 10:g} % of the present one",
            file=facets.path,
        )
    if large.size > _MOST_PROBLEMS:
        yield Problem(f"{large.size - _MOST_PROBLEMS} more facets are larger than the page", file=facets.path)


def _pack_input(facets: Facets, rows: np.ndarray, page: tuple[int, int], padding: int) -> PackInput:
    corner_row, _ = segments(facets.corner_start)
    return PackInput(
        size=facets.size[rows],
        corner_start=np.concatenate(([0], np.cumsum(np.diff(facets.corner_start)[rows]))),
        polygon=corner_pixels(facets)[facets.enabled[corner_row]],
        page=page,
        padding=padding,
    )


def _layout(
    facets: Facets,
    rows: np.ndarray,
    wanted: PackInput,
    result: PackResult,
    size: tuple[int, int],
    method: str,
) -> Layout:
    return Layout(
        facet=(rows + 1).astype(np.int32),
        page=result.page,
        size=facets.size[rows],
        quilt_from_facet=quilt_from_facet(wanted.size, result),
        origin=facets.origin[rows],
        du=facets.du[rows],
        dv=facets.dv[rows],
        corner_start=wanted.corner_start,
        polygon=wanted.polygon,
        pages=np.array([size] * page_count(result), dtype=np.int32),
        padding=wanted.padding,
        method=method,
        display=facets.path,
        display_sha256=facets.sha256,
    )


def quilt_from_facet(size: Int32Array, result: PackResult) -> np.ndarray:
    """Whole-pixel maps (n, 2, 3) that put rasters of `size` (n, 2) where the result has them."""
    turns = QUARTER_TURNS[result.turn]
    turns = np.where(result.mirror[:, None, None], turns @ MIRROR, turns)
    # The turned raster's lowest corner goes to `corner`, whichever corner that is now.
    low = np.minimum(turns * size[:, None, :], 0).sum(axis=2)
    return np.concatenate((turns, (result.corner - low)[:, :, None]), axis=2)
