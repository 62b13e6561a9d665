"""Which pixels are looked at: every facet's share, and more where mistakes are likely.

Half of the pixels are spread evenly over the facets that are lit, so that small ones are not missed,
and over all their pixels; the other half goes to the first and last pixel of runs along the facets'
outlines and to their bleed. The choice depends on the frame number alone.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quiltcli.geometry import BoolArray, IntArray, OwnerArray, offsets, segments
from quiltcli.layout import Layout, facet_spans

_BLOCK = 1 << 16


def every_pixel(owners: OwnerArray, lit: BoolArray) -> Iterator[IntArray]:
    """Addresses of all pixels of lit facets and their bleed, block by block.

    Args:
        owners: (pixels,) facet id of every quilt pixel, negative in its bleed, 0 for none.
        lit: (F,) facets to look at.
    """
    wanted = np.concatenate(([False], lit))
    for start in range(0, owners.size, _BLOCK):
        block = np.flatnonzero(wanted[np.abs(owners[start : start + _BLOCK])])
        if block.size:
            yield block + start


def sampled_pixels(
    layout: Layout,
    owners: OwnerArray,
    lit: BoolArray,
    bleed: int,
    count: int,
    frame: int,
    also: IntArray,
) -> Iterator[IntArray]:
    """Addresses of about `count` pixels and those in `also`, ascending, block by block.

    Args:
        layout: the layout.
        owners: as for `every_pixel`.
        lit: (F,) facets to look at.
        bleed: pixels of bleed around a facet.
        count: pixels to look at.
        frame: frame number, from which the choice follows.
        also: addresses to look at in any case.
    """
    random = np.random.default_rng([frame & 0xFFFFFFFF, count])
    chosen = np.union1d(_choose(layout, owners, lit, bleed, count, random), also)
    for start in range(0, chosen.size, _BLOCK):
        yield chosen[start : start + _BLOCK]


def _choose(
    layout: Layout,
    owners: OwnerArray,
    lit: BoolArray,
    bleed: int,
    count: int,
    random: np.random.Generator,
) -> IntArray:
    spans = facet_spans(layout)
    keep = lit[spans.row]
    row, start, stop = spans.row[keep].astype(np.int64), spans.start[keep], spans.stop[keep]
    if not row.size:
        return np.empty(0, dtype=np.int64)
    order = np.argsort(row, kind="stable")
    row, start, stop = row[order], start[order], stop[order]
    edge = _edge_pixels(layout, row, start, stop)
    beside = _beside(layout, owners, edge, bleed)
    inside = _inside(row, start, stop, count // 2, random)
    rest = (_thinned(edge, count - count // 2 - count // 8, random), _thinned(beside, count // 8, random))
    return np.unique(np.concatenate((inside, *rest)))


def _inside(
    row: IntArray, start: IntArray, stop: IntArray, count: int, random: np.random.Generator
) -> IntArray:
    """Addresses of pixels in the runs: half as many from each facet, half by area."""
    length = stop - start
    cumulative = np.concatenate(([0], np.cumsum(length)))
    first = np.flatnonzero(np.diff(row, prepend=-1))
    area = np.add.reduceat(length, first)
    share = 0.5 / area.size + 0.5 * area / area.sum()
    quota = np.minimum(np.ceil(share * count).astype(np.int64), area)
    facet, step = segments(offsets(quota))
    # One pixel in each of `quota` equal stretches of the facet's pixels: no pixel comes twice.
    place = (step + random.random(facet.size)) * (area / quota)[facet]
    rank = cumulative[first][facet] + np.minimum(place.astype(np.int64), area[facet] - 1)
    run = np.searchsorted(cumulative, rank, side="right") - 1
    result: IntArray = start[run] + rank - cumulative[run]
    return result


def _edge_pixels(layout: Layout, row: IntArray, start: IntArray, stop: IntArray) -> IntArray:
    """Addresses of the ends of all runs, and of all pixels of each facet's first and last run."""
    last_of = np.flatnonzero(np.diff(row, append=-1))
    first_of = np.flatnonzero(np.diff(row, prepend=-1))
    # Long first and last runs are thinned: their ends are there already.
    runs = [np.linspace(start[k], stop[k] - 1, 64).astype(np.int64) for k in (*first_of, *last_of)]
    return np.unique(np.concatenate((start, stop - 1, *runs)))


def _beside(layout: Layout, owners: OwnerArray, edge: IntArray, bleed: int) -> IntArray:
    """Addresses of bleed pixels next to edge pixels, straight in all four directions."""
    facet = owners[edge]
    width = layout.pages[layout.page[facet - 1], 0].astype(np.int64)
    found = [np.empty(0, dtype=np.int64)]
    for step in range(1, bleed + 1):
        for way in (step, -step, step * width, -step * width):
            address = np.clip(edge + way, 0, owners.size - 1)
            found.append(address[owners[address] == -facet])
    return np.unique(np.concatenate(found))


def _thinned(addresses: IntArray, count: int, random: np.random.Generator) -> IntArray:
    """About `count` of the addresses, or all where there are fewer."""
    if addresses.size <= count:
        return addresses
    rank = (np.arange(count) + random.random(count)) * (addresses.size / count)
    return addresses[rank.astype(np.int64)]
