"""What is seen through what: the hits of one layer of fragments after another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, IntArray, slices
from quiltcli.visibility.resolve.displaced import rays_of
from quiltcli.visibility.resolve.hits import Hits, single_places
from quiltcli.visibility.resolve.pixels import pixel_hits
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import tiles_at
from quiltcli.visibility.scan.soft import Fragments
from quiltcli.visibility.setup.samples import Samples

_TILES = 1024  # microtiles whose pixels are read at a time


@dataclass(frozen=True)
class LayerHits:
    """Some of a layer's hits.

    Attributes:
        row: (G,) their pixels, rows of the fragments' `pixel`.
        hits: the hits, each a group of its own.
        inside: (G,) whether they lie in their facet's polygon, not in its bleed.
    """

    row: IntArray
    hits: Hits
    inside: BoolArray


def layer_hits(
    reader: Reader, fragments: Fragments, light: BoolArray, samples: Samples | None = None
) -> Iterator[LayerHits]:
    """The hits of all layers, the nearest first.

    Args:
        reader: the canvas.
        fragments: those gathered of it.
        light: (n,) pixels that light still passes, kept up to date by whoever takes a layer.
        samples: where the rays of patches go through; None of flat facets.
    """
    for row, keys in fragments.layers(light):
        order = np.argsort(row, kind="stable")
        row, keys = row[order], keys[order]
        tile = fragments.pixel.take(row) >> 6
        first = np.flatnonzero(np.diff(tile, prepend=-1))
        for part in slices(0, first.size, _TILES):
            begin = int(first[part.start])
            end = int(first[part.stop]) if part.stop < first.size else row.size
            yield _read(reader, fragments, row[begin:end], keys[begin:end], samples)


def _read(
    reader: Reader, fragments: Fragments, row: IntArray, keys: IntArray, samples: Samples | None
) -> LayerHits:
    """Hits of pixels in ascending order."""
    address = fragments.pixel.take(row)
    index, which = np.unique(address >> 6, return_inverse=True)
    tiles = tiles_at(reader.canvas, reader.blocks, index)
    place = address & 63
    bits = np.unpackbits(reader.blocks.inside.take(tiles.number, axis=0), axis=1).view(np.bool_)
    inside = bits[which, place]
    quilt = tiles.address[which] + tiles.stride[which] * (place >> 3) + (place & 7)
    count = int(np.count_nonzero(inside))
    pixel, known = which * 64 + place, None
    if samples is not None:
        known = rays_of(reader, samples, tiles, pixel)
    hits = pixel_hits(reader, tiles, keys, pixel, single_places(quilt), count, known)
    return LayerHits(row, hits, inside)
