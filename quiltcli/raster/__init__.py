"""Rasterization: which triangle does each pixel's ray meet first?

The stages, in order: `blocks` cuts the facets' rectangles into pieces that fit the cache; `prewarp`
gives each pair of binning to its blocks and finds its pixels there; `small` and `large` make `planes`
of the pairs and raise the depth `keys` of a canvas; `visibility` reads from the canvas which `surfaces`
its pixels see, and where.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray
from quiltcli.homography import QuiltRays
from quiltcli.orders import DepthOrder
from quiltcli.raster.blocks import Blocks, block_window, cut_batches, cut_blocks, new_canvas, ray_matrices
from quiltcli.raster.depth import DepthRange, triangles_in_range
from quiltcli.raster.hits import Hits, Wanted
from quiltcli.raster.keys import serial_bits
from quiltcli.raster.large import draw_large
from quiltcli.raster.order import BatchOrder
from quiltcli.raster.planes import PlaneTable
from quiltcli.raster.prewarp import (
    BlockPairs,
    Sight,
    block_keys,
    block_matrices,
    pairs_by_block,
    warp,
)
from quiltcli.raster.small import LIMIT, draw_small
from quiltcli.raster.visibility import read_canvas
from quiltcli.viewer import Viewer

__all__ = [
    "BlockPairs",
    "Blocks",
    "Frame",
    "Hits",
    "Sight",
    "Wanted",
    "batches",
    "block_keys",
    "block_window",
    "cut_blocks",
    "pairs_by_block",
    "rasterize",
    "triangles_in_range",
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


def batches(frame: Frame, wanted: BoolArray | None = None) -> list[tuple[int, int]]:
    """The frame's work in ranges of blocks; any may be rasterized anywhere, in any order.

    Args:
        frame: the frame.
        wanted: (B,) the blocks that the ranges must hold; by default those that have pairs.
    """
    counts = np.diff(frame.pairs.start)
    return cut_batches(counts, frame.blocks, counts > 0 if wanted is None else wanted)


def rasterize(
    frame: Frame,
    batch: tuple[int, int],
    sample: tuple[float, float] = (0.0, 0.0),
    wanted: Wanted | None = None,
) -> Iterator[Hits]:
    """What the pixels of one batch see.

    Args:
        frame: the frame.
        batch: one of `batches(frame)`.
        sample: where in the pixel to look, in pixels from its centre.
        wanted: what the hits shall tell beside the triangle, the ray and its depth.

    Yields:
        Hits of distinct pixels, each pixel of the batch at most once.
    """
    counts = np.diff(frame.pairs.start)
    block = batch[0] + np.flatnonzero(counts[batch[0] : batch[1]])
    bits = serial_bits(int(counts[block].sum()))
    canvas = new_canvas(block, frame.blocks)
    rays = ray_matrices(frame.rays.eye_from_quilt, frame.blocks, block, sample)
    viewer = frame.viewer
    limits = DepthRange(viewer.near, viewer.far, viewer.depth == "radial", viewer.look, rays)
    by = None if frame.order is None else BatchOrder(frame.order, limits, frame.blocks.facet[block])
    matrices = block_matrices(frame.rays, frame.blocks, block, sample)
    pairs = warp(frame.sight, frame.pairs, frame.blocks, block, matrices)
    table = PlaneTable(pairs.triangle.size)
    width, height = pairs.box[1] - pairs.box[0], pairs.box[3] - pairs.box[2]
    some = np.minimum(width, height) >= 0
    small = np.maximum(width, height) < LIMIT
    draw_small(pairs, np.flatnonzero(some & small), table, canvas, limits, bits, by)
    # All at once: the more a tile has been offered, the more of it is known to be hidden.
    draw_large(table.add(pairs, np.flatnonzero(some & ~small)).compact(), canvas, limits, bits, by)
    yield from read_canvas(canvas, table, frame.blocks, limits, bits, wanted or Wanted())
