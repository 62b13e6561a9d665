"""Blocks of curved facets: small, for each is drawn on a plane that is close to it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from quiltcli.charts import Chart
from quiltcli.geometry import BoolArray, IntArray, OwnerArray, offsets
from quiltcli.layout import Layout
from quiltcli.projection.curved import inverse_affine
from quiltcli.projection.patches import SIDE, Patches, make_patches, small_enough
from quiltcli.visibility.setup.blocks import Blocks, facet_rectangles, tile_bits, window

T = TypeVar("T", bound=np.generic)


def with_patches(
    blocks: Blocks,
    layout: Layout,
    charts: tuple[Chart | None, ...],
    bleed: int,
    owners: OwnerArray,
    beside: float,
) -> tuple[Blocks, Patches]:
    """The blocks of a display with those of its curved facets behind them, and the latter's planes.

    Args:
        blocks: those of flat facets.
        layout: the facets' places.
        charts: of all facets.
        bleed: pixels drawn past a facet's edge.
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
        beside: pixels by which samples may lie beside pixels' centres.
    """
    cut = [
        _cut(layout, row, chart, rectangle)
        for row, (chart, rectangle) in enumerate(zip(charts, facet_rectangles(layout, bleed), strict=True))
        if chart is not None and layout.page[row] >= 0
    ]
    facet, x0, y0, width, height, margin = np.concatenate([np.zeros((6, 0), np.int64), *cut], axis=1)
    page = layout.page[facet]
    stride = layout.pages[page, 0].astype(np.int64)
    address = layout.page_offset[page] + y0 * stride + x0
    owned, inside = _owned(facet, width, height, address, stride, margin, owners)
    across, down = -(-width // 8), -(-height // 8)
    tiles = offsets(across * down)
    shown: BoolArray = np.asarray(owned.any(axis=1))
    # Patches that have no pixel of their facet are none.
    per_tile = offsets(shown)
    keep = np.flatnonzero(per_tile[tiles[1:]] > per_tile[tiles[:-1]])
    mine = np.repeat(np.isin(np.arange(facet.size), keep), np.diff(tiles))
    facet, x0, y0, width, height, margin, address, stride, across, down = (
        column[keep] for column in (facet, x0, y0, width, height, margin, address, stride, across, down)
    )
    owned, inside = owned[mine], inside[mine]

    def behind(first: NDArray[T], more: NDArray[Any]) -> NDArray[T]:
        return np.concatenate((first, more.astype(first.dtype)))

    together = replace(
        blocks,
        start=behind(blocks.start, blocks.start[-1] + np.arange(1, facet.size + 1)),
        facet=behind(blocks.facet, facet),
        x0=behind(blocks.x0, x0),
        y0=behind(blocks.y0, y0),
        width=behind(blocks.width, width),
        height=behind(blocks.height, height),
        margin=behind(blocks.margin, margin),
        address=behind(blocks.address, address),
        stride=behind(blocks.stride, stride),
        columns=behind(blocks.columns, np.ones(facet.size)),
        tiles_across=behind(blocks.tiles_across, across),
        tile_start=behind(blocks.tile_start, blocks.tile_start[-1] + offsets(across * down)[1:]),
        interior=np.concatenate((blocks.interior, (inside == 255).all(axis=1))),
        used=np.concatenate((blocks.used, owned.any(axis=1))),
        owned=np.concatenate((blocks.owned, owned)),
        inside=np.concatenate((blocks.inside, inside)),
    )
    return together, make_patches(charts, layout, facet.astype(np.int32), x0, y0, width, height, beside)


def _cut(layout: Layout, row: int, chart: Chart, rectangle: IntArray) -> IntArray:
    """Blocks (6, n) of one facet: facet, x0, y0, width, height, and columns at the left that are not its.

    They end where the chart is broken, for no plane is close to both sides of a break.
    """
    (a, b, c), (d, e, f) = layout.quilt_from_facet[row]
    columns, rows = chart.cuts
    # A quarter turn makes rows of columns.
    x_cuts = {round(a * cut + c) for cut in columns} if b == 0 else {round(b * cut + c) for cut in rows}
    y_cuts = {round(e * cut + f) for cut in rows} if d == 0 else {round(d * cut + f) for cut in columns}
    x0, y0, x1, y1 = rectangle.tolist()
    pieces = [
        (left, top, right, bottom)
        for top, bottom in _pieces(y0, y1, y_cuts, 1)
        for left, right in _pieces(x0, x1, x_cuts, 8)
    ]
    found = _split(np.array(pieces, dtype=np.int64).reshape(-1, 4), layout, row, chart)
    left, top, right, bottom = found.T
    begin = left - left % 8
    return np.stack((np.full(len(found), row), begin, top, right - begin, bottom - top, left - begin))


def _split(pieces: IntArray, layout: Layout, row: int, chart: Chart) -> IntArray:
    """Rectangles (n, 4) left, top, right, bottom, those in which the chart turns too much cut smaller."""
    (a, b, c), (d, e, f) = inverse_affine(layout.quilt_from_facet[row])
    done = []
    while len(pieces):
        left, top, right, bottom = pieces.T
        x, y, width, height = left + 0.5, top + 0.5, right - left - 1.0, bottom - top - 1.0
        # A quarter turn makes rows of columns.
        i, j = a * x + b * y + c, d * x + e * y + f
        good = small_enough(chart, i, j, a * width + b * height, d * width + e * height)
        good |= (width < 1) & (height < 1)
        done.append(pieces[good])
        pieces = _quarters(pieces[~good])
    order = np.concatenate([np.zeros((0, 4), dtype=np.int64), *done])
    return order[np.lexsort((order[:, 0], order[:, 1]))]


def _quarters(pieces: IntArray) -> IntArray:
    """Rectangles cut in four, or in two where they are a line; at multiples of 8 where there are some."""
    parts = [np.zeros((0, 4), dtype=np.int64)]
    for left, top, right, bottom in pieces.tolist():
        x = _middle(left, right, 8)
        y = _middle(top, bottom, 1)
        for x0, x1 in ((left, x), (x, right)):
            parts += [
                np.array([[x0, y0, x1, y1]]) for y0, y1 in ((top, y), (y, bottom)) if x1 > x0 and y1 > y0
            ]
    return np.concatenate(parts)


def _middle(first: int, last: int, grid: int) -> int:
    """Where to cut a range: at a multiple of `grid` inside it if there is one."""
    middle = (first + last) // 2
    near = round(middle / grid) * grid
    return near if first < near < last else middle


def _pieces(first: int, last: int, cuts: set[int], grid: int) -> list[tuple[int, int]]:
    """Ranges of at most SIDE from multiples of `grid` on, that end at cuts."""
    ends = sorted({first, last} | {cut for cut in cuts if first < cut < last})
    found: list[tuple[int, int]] = []
    for begin, end in pairwise(ends):
        aligned = begin - begin % grid
        found += [(max(at, begin), min(at + SIDE, end)) for at in range(aligned, end, SIDE)]
    return found


def _owned(
    facet: IntArray,
    width: IntArray,
    height: IntArray,
    address: IntArray,
    stride: IntArray,
    margin: IntArray,
    owners: OwnerArray,
) -> tuple[BoolArray, BoolArray]:
    """As for flat blocks, bits (microtiles, 8): pixels in a margin are another block's."""
    owned, inside = [np.zeros((0, 8), dtype=np.uint8)], [np.zeros((0, 8), dtype=np.uint8)]
    for f, w, h, first, step, left in zip(facet, width, height, address, stride, margin, strict=True):
        mine = np.zeros((-(-h // 8) * 8, -(-w // 8) * 8), dtype=owners.dtype)
        mine[:h, left:w] = window(owners, first, step, w, h)[:, left:]
        polygon = mine == f + 1
        owned.append(tile_bits(polygon | (mine == -f - 1)))
        inside.append(tile_bits(polygon))
    return np.concatenate(owned), np.concatenate(inside)
