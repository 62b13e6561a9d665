"""Rasterization: which triangle does each pixel's ray meet first?

The stages, in order: `blocks` cuts the facets' rectangles into pieces that fit the cache; `prewarp`
gives each pair of binning to its blocks and finds its pixels there; `small` and `large` make `planes`
of the pairs and raise the depth `keys` of a canvas (the visibility buffer); `visibility` reads from the
canvas which `surfaces` its `whole` microtiles or single `pixels` see, region by region, and `tiles` knows
where those are. Nothing here knows of colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.projection.patches import Patches
from quiltcli.projection.planar import QuiltRays
from quiltcli.scene import Scene
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.displaced import read_displaced
from quiltcli.visibility.resolve.footprints import Cells
from quiltcli.visibility.resolve.hits import Hits, Places, Wanted
from quiltcli.visibility.resolve.layers import LayerHits, layer_hits
from quiltcli.visibility.resolve.pixels import MixedTiles
from quiltcli.visibility.resolve.reader import Reader
from quiltcli.visibility.resolve.tiles import missed_pixels
from quiltcli.visibility.resolve.visibility import SQUARE, Region, read_canvas
from quiltcli.visibility.resolve.whole import WholeTiles
from quiltcli.visibility.scan.depth import DepthRange, triangles_in_range
from quiltcli.visibility.scan.depth_buffers import DepthOrder
from quiltcli.visibility.scan.displaced import displaced_fragments, draw_displaced
from quiltcli.visibility.scan.keys import serial_bits
from quiltcli.visibility.scan.large import covering_keys, draw_large
from quiltcli.visibility.scan.order import BatchOrder
from quiltcli.visibility.scan.settled import REACH, settled_tiles
from quiltcli.visibility.scan.small import LIMIT, draw_small
from quiltcli.visibility.scan.soft import Fragments, apart, soft_fragments
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
from quiltcli.visibility.setup.planes import DISPLACED, LATTICE, PlaneTable
from quiltcli.visibility.setup.prewarp import (
    BlockPairs,
    Sight,
    block_keys,
    block_matrices,
    pairs_by_block,
    vertex_blocks,
    warp,
)
from quiltcli.visibility.setup.samples import Samples, samples_of

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
        patches: of curved facets, whose blocks come last; None where there are none.
    """

    viewer: Viewer
    sight: Sight
    rays: QuiltRays
    blocks: Blocks
    pairs: BlockPairs
    order: DepthOrder | None = None
    patches: Patches | None = None


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
        samples: where the rays of patches go through; None of flat facets.
        soft: pixels that are seen through something, which the canvas has not; None where there are none.
        cells: the parts of pixels that its samples stand for; None for all of them.
    """

    blocks: Blocks
    canvas: Canvas
    table: PlaneTable
    limits: DepthRange
    bits: int
    samples: Samples | None = None
    cells: Cells | None = None
    soft: Fragments | None = None

    def regions(
        self, wanted: Wanted = Wanted.NOTHING, scene: Scene | None = None, largest: int = SQUARE
    ) -> Iterator[Region]:
        """All that is seen, each pixel of the batch in at most one region.

        Args:
            wanted: what the regions' hits shall tell.
            scene: what was drawn; its normals are needed where they are wanted.
            largest: microtiles from side to side of the largest regions, SQUARE or 1.
        """
        reader = self._reader(wanted, scene)
        if self.samples is not None:
            return read_displaced(reader, self.samples)
        return read_canvas(reader, largest)

    def _reader(self, wanted: Wanted, scene: Scene | None) -> Reader:
        return Reader(self.canvas, self.table, self.blocks, self.limits, self.bits, scene, wanted, self.cells)

    def layers(self, light: BoolArray, wanted: Wanted, scene: Scene) -> Iterator[LayerHits]:
        """The pixels that are seen through something, layer by layer from the front.

        Args:
            light: (n,) which of the pixels of `soft` light still passes; whoever takes a layer notes the end.
            wanted: what the hits shall tell.
            scene: what was drawn.
        """
        assert self.soft is not None
        return layer_hits(self._reader(wanted, scene), self.soft, light, self.samples)

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
    frame: Frame,
    batch: tuple[int, int],
    sample: FloatArray | None = None,
    cells: Cells | None = None,
    *,
    settled: bool = False,
    done: BoolArray | None = None,
) -> Drawing:
    """Draw the triangles of one batch.

    Args:
        frame: the frame.
        batch: one of `batches(frame)`.
        sample: (F, 2) where in each facet's pixels to look, in pixels from their centres; None for there.
        cells: the parts of the pixels that the sample stands for; None for all of them.
        settled: whether only microtiles are drawn in which all samples see one triangle.
        done: (m,) microtiles of the batch's blocks that are not drawn.
    """
    # What will be drawn on: the batch's microtiles, their rays, and how keys of depth are made.
    counts = frame.pairs.per_block
    block = batch[0] + np.flatnonzero(counts[batch[0] : batch[1]])
    bits = serial_bits(int(counts[block].sum()))
    canvas = new_canvas(block, frame.blocks)
    if done is not None:
        canvas.used[done.take(canvas.number - frame.blocks.tiles(batch).start)] = False
    if block.size and block[0] >= frame.blocks.flat:
        return _draw_patches(frame, canvas, bits, sample, cells, settled=settled)
    rays = ray_matrices(frame.rays.eye_from_quilt, frame.blocks, block, sample)
    viewer = frame.viewer
    limits = DepthRange(
        viewer.near, viewer.far, viewer.by_distance, viewer.depth == "radial", viewer.look, rays
    )
    by = None if frame.order is None else BatchOrder(frame.order, limits, frame.blocks.facet[block])
    # Triangles in homogeneous pixels, small ones apart from large ones.
    matrices = block_matrices(frame.rays, frame.blocks, block, sample)
    reach = REACH if settled else 0.0
    pairs = warp(frame.sight, frame.pairs, frame.blocks, block, matrices, reach)
    table = PlaneTable(pairs.triangle.size)
    width, height = pairs.box[1] - pairs.box[0], pairs.box[3] - pairs.box[2]
    some = np.minimum(width, height) >= 0
    light = np.zeros(0, dtype=np.int64)
    if frame.sight.soft is not None and not settled:
        some, light = apart(pairs, frame.sight.soft, some)
    small = np.maximum(width, height) < LIMIT
    large = table.add(pairs, np.flatnonzero(some & ~small)).compact()
    if settled:
        opaque = np.ones(len(frame.sight.triangles), dtype=np.bool_)
        if frame.sight.soft is not None:
            opaque &= ~frame.sight.soft
        canvas.used[:] &= settled_tiles(pairs, np.flatnonzero(some & small), large, opaque, canvas)
    # All at once: the more a tile has been offered, the more of it is known to be hidden.
    spans = large_spans(large, canvas, by)
    covering = covering_keys(large, spans, canvas, bits) if by is None else None
    rows, culled = np.flatnonzero(some & small), frame.sight.culled
    draw_small(pairs, rows, table, canvas, limits, bits, by, covering, culled=culled)
    draw_large(large, spans, covering, canvas, limits, bits, by)
    # What lies before all that is opaque.
    soft = soft_fragments(pairs, light, table, canvas, limits, bits, by) if light.size else None
    return Drawing(frame.blocks, canvas, table, limits, bits, cells=cells, soft=soft)


def _draw_patches(
    frame: Frame,
    canvas: Canvas,
    bits: int,
    sample: FloatArray | None,
    cells: Cells | None,
    *,
    settled: bool,
) -> Drawing:
    """Draw the triangles of a batch of patches, none of which is settled; for the arguments see `draw`."""
    rays, patches, viewer, block = frame.rays, frame.patches, frame.viewer, canvas.block
    assert patches is not None
    assert rays.patched is not None
    which = block - frame.blocks.flat
    beside = np.zeros((2, which.size)) if sample is None else sample[frame.blocks.facet[block]].T
    samples = samples_of(rays, patches, canvas, which, (beside[0], beside[1]))
    canvas = replace(canvas, owned=np.packbits(samples.lit, axis=1))
    # Rays and planes of the patches, counted from the samples of their first pixels.
    matrix = rays.patched.eye_from_patch[which].copy()
    matrix[:, :, 2] += beside[0, :, None] * matrix[:, :, 0] + beside[1, :, None] * matrix[:, :, 1]
    limits = DepthRange(
        viewer.near, viewer.far, viewer.by_distance, viewer.depth == "radial", viewer.look, matrix
    )
    inverse = rays.patched.patch_from_eye[which].copy()
    inverse[:, 0] -= (beside[0] + LATTICE[0])[:, None] * inverse[:, 2]
    inverse[:, 1] -= (beside[1] + LATTICE[1])[:, None] * inverse[:, 2]
    pairs = warp(frame.sight, frame.pairs, frame.blocks, block, inverse, samples.reach)
    table = PlaneTable(pairs.triangle.size)
    if settled:
        canvas.used[:] = False
        return Drawing(frame.blocks, canvas, table, limits, bits)
    some = (pairs.box[1] >= pairs.box[0]) & (pairs.box[3] >= pairs.box[2])
    light = np.zeros(0, dtype=np.int64)
    if frame.sight.soft is not None:
        some, light = apart(pairs, frame.sight.soft, some)
    planes = table.add(pairs, np.flatnonzero(some), DISPLACED).compact()
    draw_displaced(planes, canvas, samples, limits, bits)
    soft = None
    if light.size:
        planes = table.add(pairs, light, DISPLACED).compact()
        soft = displaced_fragments(planes, canvas, samples, limits, bits)
    return Drawing(frame.blocks, canvas, table, limits, bits, samples, cells, soft)
