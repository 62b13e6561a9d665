"""Microtiles, and squares of them, that one triangle fills: its planes are looked up once for all pixels.

square of side 2            its triangle's planes, from the first pixel ·

· ─ ─ ─ ┬ ─ ─ ─ ┐            1/t      a x + b y + c
│ 8 × 8 │       │            normal   a x + b y + c, by axis      a numerator: Σ nₖ Eₖ
├ ─ ─ ─ ┼ ─ ─ ─ ┤            ray      a x + b y + c, by axis
│       │       │            weights  E₂, E₃ and ΣE
└ ─ ─ ─ ┴ ─ ─ ─ ┘
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, slices
from quiltcli.visibility.resolve.footprints import TileEdges, edge_planes_of
from quiltcli.visibility.resolve.hits import Hits, Places, Wanted
from quiltcli.visibility.resolve.reader import Reader, TileRays, rays_through
from quiltcli.visibility.resolve.surfaces import one_normal, surfaces
from quiltcli.visibility.resolve.tiles import Tiles, owned_pixels
from quiltcli.visibility.resolve.vectors import TileVectors, Vectors
from quiltcli.visibility.setup.grids import grid_values, on_grid
from quiltcli.visibility.setup.planes import moved

_AT_A_TIME = 2048
"""Microtiles whose pixels fit the cache."""
AT_ONCE = 8192
"""Squares that a region has at most."""


@dataclass(frozen=True)
class WholeTiles:
    """A region of G squares of microtiles, each filled by one triangle.

    Attributes:
        reader: the canvas.
        tiles: where their first microtiles lie.
        pair: (G,) the pairs, rows of the canvas's planes.
        triangle: (G,) triangle index.
        rays: rays through their pixels.
        inverse: (3, G) planes of 1/t on grids (`grids.grid_values`), from their first pixels.
        normal: normals on the side of the eye, of any length; None unless wanted.
        weights: (3, 3, G) planes, on grids, of the second and third edge function and of the sum of all;
            none unless wanted, (0, 3, G).
        even: whether each of their triangles has one normal.
        border: whether some of their pixels are not the facet's.
        side: how many microtiles are the side of a square; 1 at the border.
        edges: what attributes are worked out by; None unless wanted.
    """

    reader: Reader
    tiles: Tiles
    pair: IntArray
    triangle: Int32Array
    rays: TileRays
    inverse: FloatArray
    normal: Vectors | None
    weights: FloatArray
    even: bool = False
    border: bool = False
    side: int = 1
    edges: TileEdges | None = None

    def __getitem__(self, part: slice | IntArray) -> WholeTiles:
        """Some of the squares."""
        return WholeTiles(
            reader=self.reader,
            tiles=self.tiles[part],
            pair=self.pair[part],
            triangle=self.triangle[part],
            rays=self.rays[part],
            inverse=self.inverse[:, part],
            normal=None if self.normal is None else self.normal[part],
            weights=self.weights[:, :, part],
            even=self.even,
            border=self.border,
            side=self.side,
            edges=None if self.edges is None else self.edges[part],
        )

    def of(self, chosen: BoolArray) -> WholeTiles:
        """The chosen (G,) of them."""
        return self if chosen.all() else self[np.flatnonzero(chosen)]

    def split(self, chosen: BoolArray | None = None) -> Iterator[WholeTiles]:
        """The microtiles that they, or the chosen (G,) of them, are made of, as regions.

        There are none where they are microtiles themselves.
        """
        if self.side == 1:
            return
        some = slice(None) if chosen is None else np.flatnonzero(chosen)
        first, pair = self.tiles[some], self.pair[some].repeat(self.side**2)
        tiles = first.split(self.side, self.reader.canvas.tiles_across.take(first.block))
        for part in slices(0, pair.size, AT_ONCE):
            yield whole_tiles(self.reader, tiles[part], pair[part], even=self.even, border=False, side=1)

    def parts(self, tiles: int = _AT_A_TIME) -> Iterator[slice]:
        """Ranges of the squares of so many microtiles, whose pixels fit the cache."""
        return slices(0, self.triangle.size, max(tiles // self.side**2, 1))

    def hits(self) -> Iterator[Hits]:
        """What their pixels see, a cache-sized number at a time."""
        for part in self.parts():
            yield self[part].read()

    def read(self) -> Hits:
        """What their pixels see, of all at once."""
        # Numerators first: a product with the rays' own planes gives depth and position.
        inverse = grid_values(self.inverse, self.side)
        depth, position = self.rays.values()
        depth /= inverse
        weights = None
        if len(self.weights):
            second, third, total = (grid_values(plane, self.side) for plane in self.weights)
            weights = np.stack((second / total, third / total)).astype(np.float32)
        places, chosen, inside = self._places(depth.shape)
        return Hits(
            places=places,
            chosen=chosen,
            facet=self.tiles.facet,
            triangle=self.triangle,
            ray=self.rays.vectors,
            depth=depth,
            normal=self.normal,
            weights=weights,
            position=None if position is None else position / inverse,
            inside=inside,
            edges=self.edges,
        )

    def _places(self, shape: tuple[int, ...]) -> tuple[Places, IntArray | None, int]:
        """Where the pixels lie that are drawn; which these are; how many are no bleed."""
        if not self.border:
            return self.tiles.places(self.side), None, shape[0] * shape[1]
        drawn = np.ones(shape, dtype=np.bool_)
        pixel, places, inside = owned_pixels(self.reader.blocks, self.tiles, drawn)
        return places, pixel, inside


def whole_tiles(
    reader: Reader, tiles: Tiles, pair: IntArray, *, even: bool, border: bool, side: int
) -> WholeTiles:
    """Squares (G,) that one pair each fills.

    Args:
        reader: the canvas.
        tiles: where their first microtiles lie.
        pair: (G,) the pairs, rows of the canvas's planes.
        even: whether each of their triangles has one normal.
        border: whether some of their pixels are not the facet's.
        side: how many microtiles are their side.
    """
    wanted = reader.wanted
    normal: Vectors | None = None
    # One normal a triangle is looked up; one that varies is a plane over the square.
    if even and Wanted.NORMAL in wanted:
        normal = one_normal(reader, pair)
        wanted &= ~Wanted.NORMAL
    seen = surfaces(reader, pair, wanted, tiles.x, tiles.y)
    if Wanted.NORMAL in wanted:
        normal = TileVectors(seen.normal.astype(np.float64), side)
    edges: TileEdges | None = None
    if Wanted.EDGES in wanted:
        planes = edge_planes_of(reader.table.planes, pair, tiles.x, tiles.y, reader.cells, tiles.facet)
        edges = TileEdges(planes, side)
    return WholeTiles(
        reader=reader,
        tiles=tiles,
        pair=pair,
        triangle=seen.triangle,
        rays=rays_through(reader, tiles, side),
        inverse=moved(tiles.x, tiles.y, out=np.take(reader.table.planes.inverse, pair, axis=1)),
        normal=normal,
        weights=on_grid(seen.weights, side),
        even=even,
        border=border,
        side=side,
        edges=edges,
    )
