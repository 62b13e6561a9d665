"""Who owns each quilt pixel: a facet, a facet's bleed, or nobody."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import LayoutError
from quiltcli.formats.capacity import bytes_text, free_memory
from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    Int32Array,
    IntArray,
    next_in_row,
    offsets,
    segments,
    shares,
)
from quiltcli.layout.layout import Layout, quilt_polygons
from quiltcli.layout.spans import Spans, facet_spans, overlaps, snapped

Owners: TypeAlias = NDArray[np.int16] | NDArray[np.int32]
_BATCH = 200_000  # candidate pixels looked at together: bounds the memory, not the result


def pixel_owners(layout: Layout, bleed: float = 0) -> Owners:
    """Owner of every pixel of every page, in one flat array.

    Args:
        layout: a layout whose facets do not overlap.
        bleed: distance in quilt pixels up to which pixels around a polygon are its bleed.

    Returns:
        (page_offset[-1],) int16, or int32 from 32767 facets on: the facet's id where the pixel's
        centre lies inside its polygon, minus the id where it lies within `bleed` of the polygon and
        inside none, 0 elsewhere. A bleed pixel within reach of several goes to the nearest polygon
        on its page, the lowest id among equals.

    Raises:
        LayoutError: two facets claim one pixel, or memory cannot hold so many.
    """
    demand_memory(layout, owner_bytes(layout))
    spans = facet_spans(layout)
    if overlaps(spans):
        raise LayoutError(layout.problem("facets overlap in the quilt"))
    owners = _fill_runs(layout, spans)
    if bleed > 0:
        _add_bleed(layout, owners, bleed)
    for row in np.flatnonzero(layout.page >= 0).tolist():
        mask = layout.masks.get(int(layout.facet[row]))
        if mask is not None:
            _leave_out(layout, row, mask, owners)
    return owners


def _leave_out(layout: Layout, row: int, mask: BoolArray, owners: Owners) -> None:
    """Take from a facet the pixels that are not in its mask (H, W), in place; they are nobody's then."""
    page = int(layout.page[row])
    width, height = layout.pages[page].tolist()
    first = int(layout.page_offset[page])
    mine = owners[first : first + width * height].reshape(height, width)
    y, x = np.nonzero(mine == layout.facet[row])
    (a, b, c), (d, e, f) = np.linalg.inv(np.vstack((layout.quilt_from_facet[row], [0, 0, 1])))[:2]
    i = np.floor(a * (x + 0.5) + b * (y + 0.5) + c).astype(np.int64).clip(0, mask.shape[1] - 1)
    j = np.floor(d * (x + 0.5) + e * (y + 0.5) + f).astype(np.int64).clip(0, mask.shape[0] - 1)
    gone = ~mask[j, i]
    mine[y[gone], x[gone]] = 0


def owner_bytes(layout: Layout) -> int:
    """Bytes that the owner of a pixel takes."""
    return 2 if layout.facet.max(initial=0) < np.iinfo(np.int16).max else 4


def demand_memory(layout: Layout, pixel_bytes: int) -> None:
    """Raise a LayoutError unless so many bytes for every pixel of the pages fit into free memory."""
    pixels, free = int(layout.page_offset[-1]), free_memory()
    if free is not None and pixels * pixel_bytes > free:
        words = f"the pages have {pixels:,} pixels, which take {bytes_text(pixels * pixel_bytes)} of memory"
        raise LayoutError(
            layout.problem(f"{words}, but {bytes_text(free)} are free (expected smaller pages)")
        )


def _fill_runs(layout: Layout, spans: Spans) -> Owners:
    """Facet ids inside the runs, 0 between them: runs and gaps in turn, each repeated to its length."""
    small = owner_bytes(layout) == 2
    ends = np.zeros(2 * spans.start.size + 2, dtype=np.int64)
    ends[1:-1:2], ends[2:-1:2], ends[-1] = spans.start, spans.stop, layout.page_offset[-1]
    values = np.zeros(ends.size - 1, dtype=np.int32)
    values[1::2] = layout.facet[spans.row]
    if small:
        return np.repeat(values.astype(np.int16), np.diff(ends))
    return np.repeat(values, np.diff(ends))


@dataclass(frozen=True)
class _Edges:
    """Polygon edges from `a` to `b` (E, 2) in page pixels, and where their facets live."""

    a: FloatArray
    b: FloatArray
    facet: Int32Array
    address: IntArray  # of the page's first pixel
    page: Int32Array  # (E, 2) width and height of the page


def _edges(layout: Layout) -> _Edges:
    row, _ = segments(layout.corner_start)
    a = snapped(quilt_polygons(layout))
    placed = layout.page[row] >= 0
    b, row, a = a[next_in_row(layout.corner_start)][placed], row[placed], a[placed]
    page = layout.page[row]
    return _Edges(a, b, layout.facet[row], layout.page_offset[page], layout.pages[page])


def _add_bleed(layout: Layout, owners: Owners, bleed: float) -> None:
    """Give every free pixel within `bleed` of an edge to the nearest facet, in place.

    A point outside a polygon is as far from it as from its nearest edge, so edges are enough.
    """
    edges = _edges(layout)
    length = np.abs(edges.b - edges.a).max(axis=1, initial=0) + 2 * bleed + 2
    cost = np.ceil(length * (2 * bleed + 2))
    found = [_candidates(edges, batch, owners, bleed) for batch in shares(cost, _BATCH)]
    if found:
        address, _, facet = _nearest(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
        owners[address] = -facet


def _candidates(
    edges: _Edges, batch: slice, owners: Owners, bleed: float
) -> tuple[IntArray, FloatArray, Int32Array]:
    """Free pixels within `bleed` of the edges of a batch: address, squared distance, facet id."""
    a, b, page = edges.a[batch], edges.b[batch], edges.page[batch]
    top = np.clip(np.ceil(np.minimum(a[:, 1], b[:, 1]) - bleed - 0.5), 0, page[:, 1])
    bottom = np.clip(np.floor(np.maximum(a[:, 1], b[:, 1]) + bleed - 0.5) + 1, top, page[:, 1])
    edge, rank = segments(offsets((bottom - top).astype(np.int64)))
    y: FloatArray = top[edge] + rank
    left, right = _reach(a[edge], b[edge], y + 0.5, bleed, page[edge, 0])
    counts = (right - left).astype(np.int64)
    begin = edges.address[batch][edge] + (y * page[edge, 0] + left).astype(np.int64)
    # Addresses run on within a line of pixels; most of them are owned, and done with before anything else.
    address = np.arange(int(counts.sum())) + np.repeat(begin - np.cumsum(counts) + counts, counts)
    free = np.flatnonzero(owners.take(address) == 0)
    address = address.take(free)
    line = np.repeat(np.arange(counts.size), counts).take(free)
    x = left.take(line) + (address - begin.take(line)) + 0.5
    edge, y = edge.take(line), y.take(line) + 0.5
    distance2 = _distance2(x, y, a, b - a, edge)
    near = np.flatnonzero(distance2 <= bleed * bleed)
    return address.take(near), distance2.take(near), edges.facet[batch].take(edge.take(near))


def _reach(
    a: FloatArray, b: FloatArray, y: FloatArray, bleed: float, width: Int32Array
) -> tuple[FloatArray, FloatArray]:
    """Pixels [left, right) on rows of centres at `y` that can be within `bleed` of segments a to b."""
    rise = b[:, 1] - a[:, 1]
    flat = rise == 0
    rise = np.where(flat, 1.0, rise)
    t = (np.stack((y - bleed, y + bleed)) - a[:, 1]) / rise
    t = np.clip(np.where(flat, [[0.0], [1.0]], t), 0, 1)
    x = a[:, 0] + t * (b[:, 0] - a[:, 0])
    # Half a pixel more than needed forgives the rounding of x; the distance decides.
    left = np.clip(np.floor(x.min(axis=0) - bleed - 0.5), 0, width)
    return left, np.clip(np.ceil(x.max(axis=0) + bleed + 0.5), left, width)


def _distance2(x: FloatArray, y: FloatArray, a: FloatArray, run: FloatArray, edge: IntArray) -> FloatArray:
    """Squared distance (N,) of points x, y to segments `edge` (N,) of those from `a` along `run` (E, 2)."""
    length2 = (run * run).sum(axis=1).take(edge)
    run_x, run_y = run[:, 0].take(edge), run[:, 1].take(edge)
    x, y = x - a[:, 0].take(edge), y - a[:, 1].take(edge)
    along = x * run_x + y * run_y
    t = np.clip(np.divide(along, length2, out=np.zeros_like(along), where=length2 > 0), 0, 1)
    x -= t * run_x
    y -= t * run_y
    return x * x + y * y


def _nearest(
    address: IntArray, distance2: FloatArray, facet: Int32Array
) -> tuple[IntArray, FloatArray, Int32Array]:
    """The nearest facet of every address that occurs; candidates come in the order of ids."""
    order = np.argsort(address, kind="stable")
    address, distance2, facet = address[order], distance2[order], facet[order]
    first = np.flatnonzero(np.diff(address, prepend=-1))
    if first.size == 0:
        return address, distance2, facet
    least = np.minimum.reduceat(distance2, first)
    group = np.repeat(np.arange(first.size), np.diff(first, append=address.size))
    nearest = np.flatnonzero(distance2 == least[group])
    nearest = nearest[np.diff(group[nearest], prepend=-1) > 0]  # the lowest id among equals
    return address[nearest], distance2[nearest], facet[nearest]
