"""Reading patches of curved facets: pixel by pixel, each at the place where its own ray goes through."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import IntArray
from quiltcli.visibility.resolve.hits import Hits
from quiltcli.visibility.resolve.pixels import MixedTiles, Rays, pixel_hits
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import Tiles, in_parts, owned_pixels, tiles_at
from quiltcli.visibility.setup.samples import Samples

_AT_ONCE = 1024  # microtiles


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
        keys = keys.reshape(-1).take(pixel)
        rays = rays_of(self.reader, self.samples, self.tiles, pixel)
        return pixel_hits(self.reader, self.tiles, keys, pixel, places, inside, rays)


def rays_of(reader: Reader, samples: Samples, tiles: Tiles, pixel: IntArray) -> Rays:
    """Rays of pixels (G,) of microtiles of patches, counted through all of these."""
    limits = reader.limits
    # All pixels of microtiles, for a matrix each is less to move than one a pixel.
    x, y = (samples.place[k].take(tiles.index, axis=0) for k in (0, 1))
    directions = limits.directions(tiles.block.astype(np.int32)[:, None], x, y)
    vectors = np.empty((3, pixel.size))
    for k in range(3):
        directions[k].reshape(-1).take(pixel, out=vectors[k])
    if limits.radial:
        depth = np.sqrt(vectors[0] * vectors[0] + vectors[1] * vectors[1] + vectors[2] * vectors[2])
    else:
        look = limits.look
        depth = look[0] * vectors[0] + look[1] * vectors[1] + look[2] * vectors[2]
    return Rays(x.reshape(-1).take(pixel), y.reshape(-1).take(pixel), vectors, depth)


def read_displaced(reader: Reader, samples: Samples) -> Iterator[DisplacedTiles]:
    """All regions of a canvas of patches."""
    tiles = tiles_at(reader.canvas, reader.blocks, reader.canvas.drawn())
    for some in in_parts(np.arange(tiles.index.size), _AT_ONCE):
        yield DisplacedTiles(reader, tiles[some], False, samples)
