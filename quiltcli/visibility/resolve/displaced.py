"""Reading patches of curved facets: pixel by pixel, each at the place where its own ray goes through."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.visibility.resolve.hits import Hits
from quiltcli.visibility.resolve.pixels import MixedTiles, Rays, pixel_hits
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import in_parts, owned_pixels, tiles_at
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
        x, y = (self.samples.place[k].take(self.tiles.index, axis=0).reshape(-1).take(pixel) for k in (0, 1))
        rays = _rays(self.reader, self.tiles.block.take(pixel >> 6), x, y)
        return pixel_hits(self.reader, self.tiles, keys, pixel, places, inside, rays)


def _rays(reader: Reader, block: IntArray, x: FloatArray, y: FloatArray) -> Rays:
    """Rays of pixels (G,) of blocks (G,) that go through at columns x and rows y."""
    limits = reader.limits
    vectors = np.stack(limits.directions(block.astype(np.int32), x, y))
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
