"""Microtiles, and squares of them, that one triangle fills: its planes are looked up once for all pixels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, slices
from quiltcli.shading.nodes import NodeColors, Nodes, nodes_of
from quiltcli.visibility.resolve.hits import Hits, Places, Points
from quiltcli.visibility.resolve.reader import Reader, TileRays, rays_through
from quiltcli.visibility.resolve.surfaces import one_normal, surfaces
from quiltcli.visibility.resolve.tiles import Tiles, owned_pixels
from quiltcli.visibility.resolve.vectors import TileVectors, Vectors, grid_values, on_grid
from quiltcli.visibility.setup.blocks import Blocks
from quiltcli.visibility.setup.planes import moved

_AT_A_TIME = 2048


@dataclass(frozen=True)
class WholeTiles:
    """G squares of microtiles, each filled by one triangle.

    Attributes:
        tiles: where their first microtiles lie.
        triangle: (G,) triangle index.
        rays: rays through their pixels.
        inverse: (3, G) planes of 1/t on grids (`vectors.grid_values`), from their first pixels.
        normal: normals on the side of the eye, of any length; None unless wanted.
        weights: (3, 3, G) planes, on grids, of the second and third edge function and of the sum of all;
            none unless wanted, (0, 3, G).
        border: the blocks, where some pixels are not the facet's; None where all are.
        side: how many microtiles are the side of a square; 1 where some pixels are not the facet's.
    """

    tiles: Tiles
    triangle: Int32Array
    rays: TileRays
    inverse: FloatArray
    normal: Vectors | None
    weights: FloatArray
    border: Blocks | None
    side: int = 1

    def __getitem__(self, part: slice | IntArray) -> WholeTiles:
        """Some of the squares."""
        return WholeTiles(
            tiles=self.tiles[part],
            triangle=self.triangle[part],
            rays=self.rays[part],
            inverse=self.inverse[:, part],
            normal=None if self.normal is None else self.normal[part],
            weights=self.weights[:, :, part],
            border=self.border,
            side=self.side,
        )

    def of(self, chosen: BoolArray) -> WholeTiles:
        """The chosen (G,) of them."""
        return self if chosen.all() else self[np.flatnonzero(chosen)]

    @property
    def nodes(self) -> Nodes:
        """The nodes of the squares."""
        return nodes_of(self.side)

    def at_nodes(self) -> Points:
        """What is seen at the nodes."""
        nodes = self.nodes
        weights = position = None
        if len(self.weights):
            second, third, total = nodes.at(self.weights)
            weights = np.stack((second / total, third / total)).astype(np.float32)
        if self.rays.placed:
            position = nodes.at(self.rays.axes) / nodes.at(self.inverse)
        return Points(
            triangle=self.triangle[None],
            ray=nodes.vectors(self.rays.vectors),
            normal=None if self.normal is None else nodes.vectors(self.normal),
            weights=weights,
            position=position,
        )

    def hits(self, colors: NodeColors | None) -> Hits:
        """What their pixels see; `colors` are those at the nodes, if they are known."""
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
            colors=colors,
        )

    def _places(self, shape: tuple[int, ...]) -> tuple[Places, IntArray | None, int]:
        """Where the pixels lie that are drawn; which these are; how many are no bleed."""
        if self.border is None:
            return self.tiles.places(self.side), None, shape[0] * shape[1]
        pixel, places, inside = owned_pixels(self.border, self.tiles, np.ones(shape, dtype=np.bool_))
        return places, pixel, inside


class TileShader(Protocol):
    """Whoever can shade squares of microtiles by their nodes."""

    def calm(self, squares: WholeTiles) -> BoolArray:
        """Which squares (G,) nodes tell enough of."""

    def colors(self, squares: WholeTiles) -> NodeColors:
        """Colours at the nodes of squares."""


def whole_tiles(
    reader: Reader, tiles: Tiles, serial: IntArray, *, even: bool, border: bool, side: int
) -> WholeTiles:
    """Squares (G,) that one pair each fills.

    Args:
        reader: the canvas.
        tiles: where their first microtiles lie.
        serial: (G,) the pairs.
        even: whether each of their triangles has one normal.
        border: whether some of their pixels are not the facet's.
        side: how many microtiles are their side.
    """
    planes, wanted, handed = reader.table.planes, reader.wanted, reader.limits.handed
    rows = reader.table.row_of_serial.take(serial)
    normal: Vectors | None = None
    if even and wanted.normals is not None:
        normal = one_normal(wanted.normals, planes, rows, handed)
        wanted = replace(wanted, normals=None)
    seen = surfaces(planes, rows, wanted, handed, tiles.x, tiles.y)
    if wanted.normals is not None:
        normal = TileVectors(seen.normal.astype(np.float64), side)
    return WholeTiles(
        tiles=tiles,
        triangle=seen.triangle,
        rays=rays_through(reader, tiles, side),
        inverse=moved(np.take(planes.inverse, rows, axis=1), tiles.x, tiles.y),
        normal=normal,
        weights=on_grid(seen.weights, side),
        border=reader.blocks if border else None,
        side=side,
    )


def shaded_hits(tiles: WholeTiles, shader: TileShader, calm: BoolArray) -> Iterator[Hits]:
    """Hits of the `calm` (G,) squares, with their colours."""
    if calm.any():
        some = tiles.of(calm)
        yield from tile_hits(some, shader.colors(some))


def tile_hits(tiles: WholeTiles, colors: NodeColors | None = None) -> Iterator[Hits]:
    """Hits of squares, a cache-sized number at a time; `colors` are those at the nodes, if they are known."""
    step = _AT_A_TIME // tiles.side**2
    for part in slices(0, tiles.triangle.size, step):
        yield tiles[part].hits(None if colors is None else colors[part])
