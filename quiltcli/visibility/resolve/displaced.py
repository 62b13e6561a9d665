"""Reading patches of curved facets: pixel by pixel, each at the place where its own ray goes through."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.visibility.resolve.hits import Hits
from quiltcli.visibility.resolve.pixels import MixedTiles, Rays, pixel_hits
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import Tiles, in_parts, owned_pixels, tiles_at
from quiltcli.visibility.setup.samples import Samples

_AT_ONCE = 1024  # microtiles
_MANY = 3  # one pixel in so many, from which on all of a microtile's rays are made


@dataclass(frozen=True)
class DisplacedTiles(MixedTiles):
    """A region of n microtiles of patches.

    Attributes:
        samples: those of the canvas.
    """

    samples: Samples

    def read(self) -> Hits:
        """What their pixels see, if any of them sees something."""
        keys = self.reader.canvas.keys.take(self.tiles.index, axis=0)
        pixel, places, inside = owned_pixels(self.reader.blocks, self.tiles, keys != 0)
        keys = keys.reshape(-1)
        rays = rays_of(self.reader, self.samples, self.tiles, pixel)
        keys = keys if pixel.size == keys.size else keys.take(pixel)
        return pixel_hits(self.reader, self.tiles, keys, pixel, places, inside, rays)


def rays_of(reader: Reader, samples: Samples, tiles: Tiles, pixel: IntArray) -> Rays:
    """Rays of pixels (G,) of microtiles of patches, counted through all of these."""
    x, y = (samples.place[k].take(tiles.index, axis=0) for k in (0, 1))
    if _MANY * pixel.size < x.size:
        x, y = (values.reshape(-1).take(pixel) for values in (x, y))
        return _rays(reader, tiles.block.take(pixel >> 6), x, y)
    # A matrix a microtile, not a pixel: numbers that few pixels ask for cost less than looking it up.
    every = _rays(reader, tiles.block[:, None], x, y)
    return every.of(None if _all_of(pixel, x.size) else pixel)


def _all_of(pixel: IntArray, count: int) -> bool:
    return pixel.size == count and bool((pixel == np.arange(count)).all())


def _rays(reader: Reader, block: IntArray, x: FloatArray, y: FloatArray) -> Rays:
    """Rays of pixels (...) of blocks that broadcast with them, through at columns x and rows y."""
    limits = reader.limits
    matrix = limits.rays[block]
    vectors, part = np.empty((3, *x.shape)), np.empty(x.shape)
    for k in range(3):
        np.multiply(matrix[..., k, 0], x, out=vectors[k])
        vectors[k] += np.multiply(matrix[..., k, 1], y, out=part)
        vectors[k] += matrix[..., k, 2]
    if limits.radial:
        depth = np.sqrt(vectors[0] * vectors[0] + vectors[1] * vectors[1] + vectors[2] * vectors[2])
    else:
        look = limits.look
        depth = look[0] * vectors[0] + look[1] * vectors[1] + look[2] * vectors[2]
    return Rays(x, y, vectors, depth)


def read_displaced(reader: Reader, samples: Samples) -> Iterator[DisplacedTiles]:
    """All regions of a canvas of patches."""
    tiles = tiles_at(reader.canvas, reader.blocks, reader.canvas.drawn())
    for some in in_parts(np.arange(tiles.index.size), _AT_ONCE):
        yield DisplacedTiles(reader, tiles[some], False, samples)
