"""Which quilt pixels lie inside which facet, as runs of pixels.

A pixel belongs to a facet when its centre lies inside the facet's polygon by the even-odd rule; a
centre exactly on an edge belongs to the polygon to the right of it or below it (top-left rule).
Corners are first snapped to a grid of 2⁻²⁰ pixel, and the place where an edge crosses a row of
centres is computed from its upper end whatever way the edge runs. Two polygons that share an edge
therefore agree to the last bit on which of them a centre belongs to: none is lost, none is claimed twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray, next_in_row, offsets, segments
from quiltcli.layout.layout import Layout, quilt_polygons

_GRID = 2.0**20


@dataclass(frozen=True)
class Spans:
    """Runs of quilt pixels inside facets, in the order of their addresses.

    Attributes:
        row: (S,) row of the layout's arrays the run belongs to.
        start: (S,) flat address of the run's first pixel.
        stop: (S,) flat address one past its last pixel, greater than `start`.
    """

    row: Int32Array
    start: IntArray
    stop: IntArray


@dataclass(frozen=True)
class Overlap:
    """Two facets that claim the same pixels: rows of the layout, pixel count, first address."""

    row_a: int
    row_b: int
    pixels: int
    first: int


def snapped(corners: FloatArray) -> FloatArray:
    """Corners on a grid fine enough not to matter and coarse enough to make shared corners equal."""
    return np.rint(corners * _GRID) / _GRID


def facet_spans(layout: Layout) -> Spans:
    """Runs of pixels inside each facet of the layout, clipped to its page.

    Works on all edges of all facets at once: an edge gives one crossing for every row of centres
    it passes, and crossings of the same facet and row, sorted, are ends of runs in turn.
    """
    row, _ = segments(layout.corner_start)
    here = snapped(quilt_polygons(layout))
    there = here[next_in_row(layout.corner_start)]
    down = (here[:, 1] < there[:, 1])[:, None]
    upper, lower = np.where(down, here, there), np.where(down, there, here)
    page = np.maximum(layout.page[row], 0)
    width, height = layout.pages[page, 0].astype(np.int64), layout.pages[page, 1]
    first = np.clip(np.ceil(upper[:, 1] - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.ceil(lower[:, 1] - 0.5), 0, height).astype(np.int64)
    last = np.where(layout.page[row] < 0, first, last)
    edge, rank = segments(offsets(last - first))
    y = first[edge] + rank
    x = np.clip(_crossings(upper, lower, edge, y), 0, width[edge]).astype(np.int64)
    address = layout.page_offset[page[edge]] + y * width[edge]
    # Sorting by facet, then by x within the row of pixels; a facet lies on one page only.
    order = np.lexsort((x, address, row[edge]))
    start, stop = (address + x)[order][0::2], (address + x)[order][1::2]
    owner = row[edge][order][0::2].astype(np.int32)
    order = np.lexsort((stop, owner, start))
    order = order[(start < stop)[order]]
    return Spans(owner[order], start[order], stop[order])


def _crossings(upper: FloatArray, lower: FloatArray, edge: IntArray, y: IntArray) -> FloatArray:
    """First pixel to the right of each edge on each row of centres, as whole floats."""
    run = lower - upper
    slope = np.divide(run[:, 0], run[:, 1], out=np.zeros(run.shape[0]), where=run[:, 1] > 0)
    x = upper[edge, 0] + (y + 0.5 - upper[edge, 1]) * slope[edge]
    # On the grid again, so that a centre meant to lie on an edge does, though it is cut in pieces elsewhere.
    return np.asarray(np.ceil(snapped(x) - 0.5))


def overlaps(spans: Spans) -> list[Overlap]:
    """Pairs of facets that claim the same pixels, in the order of their first shared pixel.

    Among runs sorted by their start, those that begin before run i ends follow i directly.
    """
    reach = np.searchsorted(spans.start, spans.stop) - np.arange(spans.start.size) - 1
    i, rank = segments(offsets(reach))
    j = i + 1 + rank
    low, high = np.minimum(spans.row[i], spans.row[j]), np.maximum(spans.row[i], spans.row[j])
    first = spans.start[j]
    count = np.minimum(spans.stop[i], spans.stop[j]) - first
    pairs, where = np.unique(np.stack((low, high), axis=1), axis=0, return_inverse=True)
    pixels = np.bincount(where.ravel(), weights=count, minlength=len(pairs))
    earliest = np.full(len(pairs), np.iinfo(np.int64).max)
    np.minimum.at(earliest, where.ravel(), first)
    found = [
        Overlap(int(a), int(b), int(n), int(at))
        for (a, b), n, at in zip(pairs, pixels, earliest, strict=True)
    ]
    return sorted(found, key=lambda o: (o.first, o.row_a, o.row_b))


def fill(layout: Layout) -> float:
    """Share of the quilt's pixels whose centre lies inside a facet, 0 to 1."""
    spans = facet_spans(layout)
    return float((spans.stop - spans.start).sum() / layout.page_offset[-1])
