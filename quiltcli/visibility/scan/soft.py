"""Fragments of surfaces that light may pass: all that lie before the opaque surface, not the nearest alone.

They are gathered when everything opaque is drawn, by the same tests of the same pixels. Where there are any,
the opaque fragment behind them leaves the canvas and becomes the last of the list: a pixel is either the
canvas's or the list's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, IntArray, slices
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.scan.large import tile_keys
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.scan.small import LIMIT, Candidates, candidates_of
from quiltcli.visibility.scan.spans import MICROTILE, Spans, large_spans
from quiltcli.visibility.setup.blocks import Canvas
from quiltcli.visibility.setup.planes import Planes, PlaneTable, Warped

_ROUND = 1024  # microtiles whose pixels are evaluated at a time


@dataclass(frozen=True)
class Fragments:
    """F fragments at n pixels.

    Attributes:
        pixel: (n,) the pixels, 64 times the microtile's place in the canvas and the pixel's in it; ascending.
        which: (F,) the pixel of each fragment, a row of `pixel`.
        keys: (F,) depth keys.
    """

    pixel: IntArray
    which: IntArray
    keys: IntArray

    def layers(self, light: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
        """The nearest fragments, then those behind them, and so on.

        Args:
            light: (n,) pixels that light still passes; whoever takes a layer notes where it ends.

        Yields:
            rows of `pixel` (m,) and keys (m,) of a layer, each pixel once.
        """
        which, keys = self.which, self.keys
        nearest = np.zeros(self.pixel.size, dtype=np.int64)
        while which.size:
            nearest[which] = 0
            np.maximum.at(nearest, which, keys)
            front = nearest.take(which) == keys
            yield which[front], keys[front]
            rest = ~front & light.take(which)
            which, keys = which[rest], keys[rest]


def soft_fragments(
    pairs: Warped,
    rows: IntArray,
    table: PlaneTable,
    canvas: Canvas,
    limits: DepthRange,
    bits: int,
    by: BatchOrder | None,
) -> Fragments | None:
    """Gather the fragments of some pairs, and take over the pixels they lie in; None where there are none.

    Args:
        pairs: all pairs of the batch.
        rows: those that light may pass.
        table: is given their planes.
        canvas: everything opaque.
        limits: near and far, for pairs that reach beyond them.
        bits: bits of the serial in a key.
        by: what to order by instead of 1/t.
    """
    width, height = (np.take(pairs.box[k + 1] - pairs.box[k], rows) for k in (0, 2))
    small = np.maximum(width, height) < LIMIT
    # Those that lie behind something opaque are left out as soon as they are found.
    found = list(candidates_of(pairs, rows[small], table, canvas, limits, bits, by))
    large = table.add(pairs, rows[~small]).compact()
    found += _large(large, large_spans(large, canvas, by, hide=False), canvas, limits, bits, by)
    address, keys = together(found)
    _settle(np.unique(address >> 6), table, canvas, limits, bits)
    return taken_over(canvas, address, keys)


def together(found: Iterable[Candidates]) -> Candidates:
    """All candidates in one."""
    parts = list(found)
    address = np.concatenate([np.zeros(0, dtype=np.int64), *(part for part, _ in parts)])
    keys = np.concatenate([np.zeros(0, dtype=np.int64), *(part for _, part in parts)])
    return address, keys


def taken_over(canvas: Canvas, address: IntArray, keys: IntArray) -> Fragments | None:
    """Fragments of candidates that lie before what is opaque, whose pixels leave the canvas; None if none do.

    Args:
        canvas: everything opaque, the candidates' microtiles with keys for each pixel.
        address: (F,) pixels of candidates.
        keys: (F,) their keys.
    """
    opaque = canvas.keys.reshape(-1)
    front = (keys > opaque.take(address)) & _owned(canvas, address)
    if not front.any():
        return None
    address, keys = address[front], keys[front]
    pixel, which = np.unique(address, return_inverse=True)
    behind = opaque.take(pixel)
    last = np.flatnonzero(behind)
    opaque[pixel] = 0
    tiles = np.unique(pixel >> 6)
    canvas.touched[tiles], canvas.full[tiles] = True, False
    return Fragments(pixel, np.concatenate((which.reshape(-1), last)), np.concatenate((keys, behind[last])))


def _large(
    planes: Planes, spans: Spans, canvas: Canvas, limits: DepthRange, bits: int, by: BatchOrder | None
) -> Iterator[Candidates]:
    """Addresses and keys of what large pairs cover."""
    for part in slices(0, spans.row.size, _ROUND):
        few = spans[part]
        keys = tile_keys(planes, few, limits, bits, by)
        seen = np.flatnonzero(keys > np.maximum(canvas.keys.take(few.tile, axis=0), 0))
        tile, place = np.divmod(seen, MICROTILE * MICROTILE)
        yield few.tile.take(tile) * 64 + place, keys.reshape(-1).take(seen)


def _settle(tiles: IntArray, table: PlaneTable, canvas: Canvas, limits: DepthRange, bits: int) -> None:
    """Give microtiles (n,) that one opaque pair fills its keys, which nobody needed so far."""
    filled = tiles[canvas.filler.take(tiles) > 0]
    if not filled.size:
        return
    row = table.row_of_serial.take(canvas.filler.take(filled) - 1)
    place = canvas.place.take(filled)
    y, x = np.divmod(filled - canvas.tile_start.take(place), canvas.tiles_across.take(place))
    none = np.zeros(filled.size)
    spans = Spans(row, filled, x * MICROTILE, y * MICROTILE, none.astype(np.uint8), none, none)
    for part in slices(0, filled.size, _ROUND):
        few = spans[part]
        canvas.keys[few.tile] = tile_keys(table.planes, few, limits, bits, None)
    canvas.filler[filled] = 0
    canvas.touched[filled] = True


def _owned(canvas: Canvas, address: IntArray) -> BoolArray:
    """Whether pixels are their facet's or its bleed."""
    byte = canvas.owned[address >> 6, address >> 3 & 7]
    return np.asarray(byte >> (7 - (address & 7)).astype(np.uint8) & 1, dtype=np.bool_)


def apart(pairs: Warped, soft: BoolArray, some: BoolArray) -> tuple[BoolArray, IntArray]:
    """Of `some` pairs (N,), those that are opaque (N,), and the others (R,); `soft` (T,) are triangles."""
    mine = soft.take(pairs.triangle)
    return some & ~mine, np.flatnonzero(some & mine)
