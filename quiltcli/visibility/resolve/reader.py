"""What reading a canvas needs, whether by microtiles or by pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.scene import Scene
from quiltcli.visibility.resolve.footprints import Cells
from quiltcli.visibility.resolve.hits import Wanted
from quiltcli.visibility.resolve.tiles import Tiles
from quiltcli.visibility.resolve.vectors import BlockVectors
from quiltcli.visibility.scan.depth import DepthRange
from quiltcli.visibility.setup.blocks import Blocks, Canvas
from quiltcli.visibility.setup.grids import grid_values, on_grid
from quiltcli.visibility.setup.planes import PlaneTable


@dataclass(frozen=True)
class Reader:
    """What is needed to read a canvas.

    Attributes:
        canvas: what was drawn.
        table: the planes of all pairs that were.
        blocks: the blocks.
        limits: how depth is measured, with the rays of the canvas's blocks.
        bits: bits of the serial in a key.
        scene: what was drawn; None where nothing of its surfaces is wanted.
        wanted: what hits shall tell.
        cells: the parts of pixels that the canvas's samples stand for; None for all of them.
    """

    canvas: Canvas
    table: PlaneTable
    blocks: Blocks
    limits: DepthRange
    bits: int
    scene: Scene | None
    wanted: Wanted
    cells: Cells | None = None

    def facet_of(self, block: IntArray | Int32Array) -> Int32Array:
        """Facets (n,) of blocks by their places in the batch."""
        return self.blocks.facet[self.canvas.block[block]]

    @property
    def corner_normals(self) -> Float32Array:
        """The scene's (T, 12)."""
        assert self.scene is not None
        return self.scene.corner_normals


@dataclass(frozen=True)
class TileRays:
    """Rays d through the pixels of n squares of microtiles.

    Attributes:
        vectors: d, of any length, from the eye.
        along: (3, n) planes, on grids (`grids.grid_values`), of the depth of d; None where it is radial.
        axes: (3, 3, n) planes, on grids, of d by axis; none where neither depth nor position needs them.
        placed: whether positions are wanted.
    """

    vectors: BlockVectors
    along: FloatArray | None
    axes: FloatArray
    placed: bool

    def __getitem__(self, part: slice | IntArray) -> TileRays:
        """Those of some squares."""
        along = None if self.along is None else self.along[:, part]
        return TileRays(self.vectors[part], along, self.axes[:, :, part], self.placed)

    def values(self) -> tuple[FloatArray, FloatArray | None]:
        """The depth (n, k) of the k points d, and if wanted these points (3, n, k), the eye at the origin."""
        side = self.vectors.side
        points = [grid_values(plane, side) for plane in self.axes]
        if self.along is None:
            x, y, z = points
            depth = np.sqrt(x * x + y * y + z * z)
        else:
            depth = grid_values(self.along, side)
        return depth, np.stack(points) if self.placed else None


def rays_through(reader: Reader, tiles: Tiles, side: int = 1) -> TileRays:
    """Rays through the pixels of squares of `side` by `side` microtiles, the first of which are `tiles`."""
    limits, placed = reader.limits, Wanted.POSITION in reader.wanted
    matrix = np.ascontiguousarray(limits.rays.transpose(1, 2, 0))
    vectors = BlockVectors(matrix, tiles.block, tiles.x, tiles.y, side)
    none = np.zeros((0, 3, tiles.x.size))
    return TileRays(
        vectors=vectors,
        along=None if limits.radial else on_grid(vectors.along(limits.look), side),
        axes=on_grid(vectors.planes, side) if limits.radial or placed else none,
        placed=placed,
    )
