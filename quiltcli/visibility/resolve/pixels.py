"""Reading pixels one by one, where several triangles show in a microtile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.visibility.resolve.footprints import PixelEdges, edge_planes_of
from quiltcli.visibility.resolve.hits import Hits, Places, Wanted
from quiltcli.visibility.resolve.reader import Reader, rays_through
from quiltcli.visibility.resolve.scattered import plane_values, values_at
from quiltcli.visibility.resolve.surfaces import surfaces
from quiltcli.visibility.resolve.tiles import Tiles, owned_pixels
from quiltcli.visibility.resolve.vectors import PointVectors, vector_values
from quiltcli.visibility.scan.keys import distinct, serial_of
from quiltcli.visibility.setup.grids import BASIS
from quiltcli.visibility.setup.planes import Planes

_DX, _DY = BASIS[0].astype(np.float32), BASIS[1].astype(np.float32)


@dataclass(frozen=True)
class MixedTiles:
    """A region of n microtiles in which several triangles show, or one triangle and nothing.

    Attributes:
        reader: the canvas.
        tiles: where they lie.
        complete: whether every pixel sees something and is the facet's: such pixels are stored in runs of
            neighbours, for that is fastest.
    """

    reader: Reader
    tiles: Tiles
    complete: bool

    def hits(self) -> Iterator[Hits]:
        """What their pixels see, each a group of its own."""
        seen = self.read()
        if seen.triangle.size:
            yield seen

    def read(self) -> Hits:
        """What their pixels see, if any of them sees something."""
        # Nothing of this outlives the call: whoever shades the hits has the cache for itself.
        keys = self.reader.canvas.keys.take(self.tiles.index, axis=0)
        if self.complete:
            pixel, places, inside = np.arange(keys.size), self.tiles.places(), keys.size
            keys = keys.reshape(-1)
        else:
            pixel, places, inside = owned_pixels(self.reader.blocks, self.tiles, keys != 0)
            keys = keys.reshape(-1).take(pixel)
        return pixel_hits(self.reader, self.tiles, keys, pixel, places, inside)


@dataclass(frozen=True)
class Rays:
    """Rays of G pixels that are known one by one.

    Attributes:
        x: (G,) columns in the block at which they go through.
        y: (G,) rows.
        vectors: (3, G) rays.
        depth: (G,) depth of their ends.
    """

    x: FloatArray
    y: FloatArray
    vectors: FloatArray
    depth: FloatArray

    def of(self, pixel: IntArray | None) -> Rays:
        """Of rays (n, 64) of microtiles those of pixels (G,), counted through all; None for all of them."""

        def chosen(values: FloatArray) -> FloatArray:
            flat = values.reshape(*values.shape[:-2], -1)
            return flat if pixel is None else flat.take(pixel, axis=-1)

        return Rays(chosen(self.x), chosen(self.y), chosen(self.vectors), chosen(self.depth))


def pixel_hits(
    reader: Reader,
    tiles: Tiles,
    keys: IntArray,
    pixel: IntArray,
    places: Places,
    inside: int,
    known: Rays | None = None,
) -> Hits:
    """Hits of pixels of microtiles, each a group of its own.

    Args:
        reader: the canvas.
        tiles: n microtiles.
        keys: (G,) keys of the pixels.
        pixel: (G,) the pixels, counted through all microtiles; ascending, if they are all of them.
        places: where they lie in the quilt.
        inside: pixels that are not bleed.
        known: their rays, where these do not go through the pixels' own places.
    """
    # The distinct surfaces that are seen, and which of them each pixel sees.
    planes, wanted = reader.table.planes, reader.wanted
    serial, which = distinct(serial_of(keys, reader.bits), reader.table.row_of_serial.size)
    rows = reader.table.row_of_serial.take(serial)
    x0, y0 = (planes.box[k].take(rows) for k in (0, 2))
    seen = surfaces(reader, rows, wanted, x0, y0)
    complete = pixel.size == tiles.x.size * 64

    def chosen(values: NDArray[Any]) -> NDArray[Any]:
        """Of values (..., n, 64) those of the pixels, (..., G)."""
        values = values.reshape(*values.shape[:-2], -1)
        return values if complete else values.take(pixel, axis=-1)

    # The ray's multiple t at which it meets the surface is its plane's 1/t, inverted.
    if known is None:
        x, y = (
            chosen(tiles.x.astype(np.float32)[:, None] + _DX),
            chosen(tiles.y.astype(np.float32)[:, None] + _DY),
        )
        inverse = _inverse(planes, rows, which, x.astype(np.float64), y.astype(np.float64))[:, None]
        rays = rays_through(reader, tiles)
        depth, position = rays.values()
        depth, vectors = chosen(depth), chosen(vector_values(rays.vectors))
        position = None if position is None else chosen(position)
    else:
        x, y = known.x.astype(np.float32), known.y.astype(np.float32)
        inverse = _inverse(planes, rows, which, known.x, known.y)[:, None]
        depth, vectors = known.depth, known.vectors.astype(np.float32)
        position = known.vectors if Wanted.POSITION in wanted else None
    # Attributes: numerators that are linear over the pixels, by the sum of the edge functions.
    normal = weights = None
    if Wanted.NORMAL in wanted:
        normal = PointVectors(values_at(seen.normal, which, x, y, x0, y0))
    edges: PixelEdges | None = None
    if Wanted.WEIGHTS in wanted:
        second, third, total = values_at(seen.weights, which, x, y, x0, y0)
        weights = np.stack((second / total, third / total)).astype(np.float32)
    if Wanted.EDGES in wanted:
        planes_of = edge_planes_of(
            planes, rows, x0, y0, reader.cells, reader.facet_of(planes.block.take(rows))
        )
        exact_x, exact_y = (x, y) if known is None else (known.x, known.y)
        edges = PixelEdges(planes_of, which, exact_x.astype(np.float64), exact_y.astype(np.float64), x0, y0)
    return Hits(
        places=places,
        chosen=None,
        facet=chosen(np.broadcast_to(tiles.facet[:, None], (tiles.facet.size, 64))),
        triangle=seen.triangle.take(which),
        ray=PointVectors(vectors[:, :, None]),
        depth=depth[:, None] / inverse,
        normal=normal,
        weights=weights,
        position=None if position is None else position[:, :, None] / inverse,
        inside=inside,
        edges=edges,
    )


def _inverse(planes: Planes, rows: IntArray, which: IntArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """1/t (G,), held between the least and the greatest of the triangle's corners.

    Args:
        planes: the planes of a batch.
        rows: (S,) the pairs that are seen.
        which: (G,) which of them each pixel sees.
        x: (G,) columns in the block.
        y: (G,) rows.
    """
    table = np.empty((rows.size, 5))
    for k, column in enumerate((*planes.inverse, planes.low, planes.high)):
        table[:, k] = column.take(rows)
    table = table.take(which, axis=0)
    result = plane_values(table, x, y, np.empty(x.size))
    np.maximum(result, table[:, 3], out=result)
    np.minimum(result, table[:, 4], out=result)
    return result
