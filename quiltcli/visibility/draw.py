"""Rasterization: which triangle does each pixel's ray meet first?

The stages, in order: `blocks` cuts the facets' rectangles into pieces that fit the cache; `prewarp`
gives each pair of binning to its blocks and finds its pixels there; `small` and `large` make `planes`
of the pairs and raise the depth `keys` of a canvas (the visibility buffer); `visibility` reads from the
canvas which `surfaces` its `whole` microtiles or single `pixels` see, region by region, and `tiles` knows
where those are. Nothing here knows of colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.scene import Scene
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.footprints import Cells
from quiltcli.visibility.resolve.hits import Hits, Places, Wanted
from quiltcli.visibility.resolve.pixels import MixedTiles
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import missed_pixels
from quiltcli.visibility.resolve.visibility import SQUARE, Region, read_canvas
from quiltcli.visibility.resolve.whole import WholeTiles
from quiltcli.visibility.scan.depth import DepthRange, triangles_in_range
from quiltcli.visibility.scan.depth_buffers import DepthOrder
from quiltcli.visibility.scan.keys import serial_bits
from quiltcli.visibility.scan.large import covering_keys, draw_large
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.scan.small import LIMIT, draw_small
from quiltcli.visibility.scan.spans import large_spans
from quiltcli.visibility.setup.blocks import (
    Blocks,
    Canvas,
    block_window,
    cut_batches,
    cut_blocks,
    give_back,
    new_canvas,
    ray_matrices,
)
from quiltcli.visibility.setup.planes import PlaneTable
from quiltcli.visibility.setup.prewarp import (
    BlockPairs,
    Sight,
    block_keys,
    block_matrices,
    pairs_by_block,
    vertex_blocks,
    warp,
)

__all__ = [
    "BlockPairs",
    "Blocks",
    "Cells",
    "Drawing",
    "Frame",
    "Hits",
    "MixedTiles",
    "Region",
    "Sight",
    "Wanted",
    "WholeTiles",
    "batches",
    "block_keys",
    "block_window",
    "cut_blocks",
    "draw",
    "pairs_by_block",
    "rasterize",
    "triangles_in_range",
    "vertex_blocks",
]


@dataclass(frozen=True)
class Frame:
    """Everything the batches of one frame share; nothing in it is written to.

    Attributes:
        viewer: the viewer.
        sight: the scene from the viewer's eye.
        rays: rays through the quilt.
        blocks: the blocks of the layout.
        pairs: triangles by block.
        order: the depth buffer that decides what is nearest; None for exact depth.
    """

    viewer: Viewer
    sight: Sight
    rays: QuiltRays
    blocks: Blocks
    pairs: BlockPairs
    order: DepthOrder | None = None


def batches(frame: Frame, wanted: BoolArray | None = None, workers: int = 1) -> list[tuple[int, int]]:
    """The frame's work in ranges of blocks; any may be rasterized anywhere, in any order.

    Args:
        frame: the frame.
        wanted: (B,) the blocks that the ranges must hold; by default those that have pairs.
        workers: how many will share them.
    """
    counts = frame.pairs.per_block
    return cut_batches(counts, frame.blocks, counts > 0 if wanted is None else wanted, workers)


@dataclass(frozen=True)
class Drawing:
    """A batch all triangles of which are drawn; its pixels are yet to be read.

    Attributes:
        blocks: the blocks of the layout.
        canvas: depth keys.
        table: planes of the pairs.
        limits: how depth is measured.
        bits: bits of the serial in a key.
        cells: the parts of pixels that its samples stand for; None for all of them.
    """

    blocks: Blocks
    canvas: Canvas
    table: PlaneTable
    limits: DepthRange
    bits: int
    cells: Cells | None = None

    def regions(
        self, wanted: Wanted = Wanted.NOTHING, scene: Scene | None = None, largest: int = SQUARE
    ) -> Iterator[Region]:
        """All that is seen, each pixel of the batch in at most one region.

        Args:
            wanted: what the regions' hits shall tell.
            scene: what was drawn; its normals are needed where they are wanted.
            largest: microtiles from side to side of the largest regions, SQUARE or 1.
        """
        reader = Reader(
            self.canvas, self.table, self.blocks, self.limits, self.bits, scene, wanted, self.cells
        )
        return read_canvas(reader, largest)

    def hits(self, wanted: Wanted = Wanted.NOTHING, scene: Scene | None = None) -> Iterator[Hits]:
        """What the pixels see, each of the batch at most once; see `regions`."""
        for region in self.regions(wanted, scene, largest=1):
            yield from region.hits()

    def missed(self, wanted: BoolArray, first: int) -> Iterator[Places]:
        """The pixels of facets that see nothing, in microtiles whose blocks have pairs.

        Reading finds microtiles that have none: asked afterwards, there is less to look through.

        Args:
            wanted: (m,) the microtiles that are asked about, of the batch's blocks.
            first: the index of the first of these among those of all blocks.
        """
        return missed_pixels(self.canvas, self.blocks, wanted, first)

    def drawn(self) -> IntArray:
        """The microtiles of which pixels see something."""
        return self.canvas.number[self.canvas.drawn()]

    def done(self) -> None:
        """Leave the drawing's memory to the next; nothing may be read from it any more."""
        give_back(self.canvas)


def rasterize(
    frame: Frame,
    batch: tuple[int, int],
    sample: FloatArray | None = None,
    wanted: Wanted = Wanted.NOTHING,
    scene: Scene | None = None,
) -> Iterator[Hits]:
    """What the pixels of one batch see; `wanted` is what the hits shall tell. See `draw`, `Drawing.hits`."""
    drawing = draw(frame, batch, sample)
    yield from drawing.hits(wanted, scene)
    drawing.done()


def draw(
    frame: Frame, batch: tuple[int, int], sample: FloatArray | None = None, cells: Cells | None = None
) -> Drawing:
    """Draw the triangles of one batch.

    Args:
        frame: the frame.
        batch: one of `batches(frame)`.
        sample: (F, 2) where in each facet's pixels to look, in pixels from their centres; None for there.
        cells: the parts of the pixels that the sample stands for; None for all of them.
    """
    # What will be drawn on: the batch's microtiles, their rays, and how keys of depth are made.
    counts = frame.pairs.per_block
    block = batch[0] + np.flatnonzero(counts[batch[0] : batch[1]])
    bits = serial_bits(int(counts[block].sum()))
    canvas = new_canvas(block, frame.blocks)
    rays = ray_matrices(frame.rays.eye_from_quilt, frame.blocks, block, sample)
    viewer = frame.viewer
    limits = DepthRange(
        viewer.near, viewer.far, viewer.by_distance, viewer.depth == "radial", viewer.look, rays
    )
    by = None if frame.order is None else BatchOrder(frame.order, limits, frame.blocks.facet[block])
    # Triangles in homogeneous pixels, small ones apart from large ones.
    matrices = block_matrices(frame.rays, frame.blocks, block, sample)
    pairs = warp(frame.sight, frame.pairs, frame.blocks, block, matrices)
    table = PlaneTable(pairs.triangle.size)
    width, height = pairs.box[1] - pairs.box[0], pairs.box[3] - pairs.box[2]
    some = np.minimum(width, height) >= 0
    small = np.maximum(width, height) < LIMIT
    large = table.add(pairs, np.flatnonzero(some & ~small)).compact()
    # All at once: the more a tile has been offered, the more of it is known to be hidden.
    spans = large_spans(large, canvas, by)
    covering = covering_keys(large, spans, canvas, bits) if by is None else None
    rows, culled = np.flatnonzero(some & small), frame.sight.culled
    draw_small(pairs, rows, table, canvas, limits, bits, by, covering, culled=culled)
    draw_large(large, spans, covering, canvas, limits, bits, by)
    return Drawing(frame.blocks, canvas, table, limits, bits, cells)
