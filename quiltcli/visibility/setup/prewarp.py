"""Prewarp: the pairs of binning become block pairs, and those get a place among the pixels.

The vertices of a facet's triangles are carried through the facet's own matrix into homogeneous
pixels, which is the paper's prewarping (§3.2.2): from here on the whole quilt is one raster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, gather_corners, offsets, segments
from quiltcli.projection.planar import QuiltRays
from quiltcli.visibility.binning.pairs import Pairs
from quiltcli.visibility.setup.blocks import SIDE, Blocks
from quiltcli.visibility.setup.planes import LATTICE, Warped, pixel_boxes, project

_CHUNK = 1 << 14
_WELL_INSIDE = 2.0  # pixels; boxes are a pixel wider than their triangles, for samples beside the centre


@dataclass(frozen=True)
class Sight:
    """The scene as one eye sees it.

    Attributes:
        vertices: (V, 3) world minus eye, metres.
        triangles: (T, 3).
        cut: (T,) triangles that reach beyond the near or far depth.
        culled: whether triangles that face away have been left out.
        soft: (T,) triangles that light may pass; None where there are none.
    """

    vertices: FloatArray
    triangles: Int32Array
    cut: BoolArray
    culled: bool = False
    soft: BoolArray | None = None


@dataclass(frozen=True)
class BlockPairs:
    """N (triangle, block) pairs by block, then triangle.

    They lie in memory as they were found: in S shares of ascending triangles, each by block.

    Attributes:
        first: (S, B) where the pairs of every share with every block begin in `memory`.
        count: (S, B) how many they are.
        memory: (C,) triangle indices, and gaps between the shares.
    """

    first: IntArray
    count: IntArray
    memory: Int32Array

    @cached_property
    def per_block(self) -> IntArray:
        """Number (B,) of every block's pairs."""
        return np.asarray(self.count.sum(axis=0))

    def of(self, block: IntArray) -> tuple[Int32Array, IntArray]:
        """Triangles (n,) of the pairs of some blocks (K,), and for each the place among these blocks."""
        count = np.ascontiguousarray(self.count[:, block].T).reshape(-1)
        piece, rank = segments(offsets(count))
        rank += np.ascontiguousarray(self.first[:, block].T).reshape(-1).take(piece)
        return self.memory.take(rank), piece // len(self.count)


def block_matrices(
    rays: QuiltRays, blocks: Blocks, block: IntArray, sample: FloatArray | None = None
) -> FloatArray:
    """Matrices (K, 3, 3) from points minus eye to homogeneous pixels of blocks.

    Whole numbers are sample positions: `sample` (F, 2) is the place in each facet's pixels from their
    centres, None for the centres themselves.
    """
    facet = blocks.facet[block]
    matrix = rays.quilt_from_eye[facet].copy()
    beside = np.zeros((1, 2)) if sample is None else sample[facet]
    x = blocks.x0[block] + (0.5 + beside[:, 0] + LATTICE[0])
    y = blocks.y0[block] + (0.5 + beside[:, 1] + LATTICE[1])
    matrix[:, 0] -= x[:, None] * matrix[:, 2]
    matrix[:, 1] -= y[:, None] * matrix[:, 2]
    return matrix


def block_keys(pairs: Pairs, sight: Sight, rays: QuiltRays, blocks: Blocks, reach: float = 0.0) -> IntArray:
    """Give every pair to the blocks of its facet that the triangle's bounding box touches.

    Args:
        pairs: triangles and facets.
        sight: the scene from the eye.
        rays: rays through the quilt.
        blocks: the blocks of the layout.
        reach: pixels by which samples lie beside the centres of their pixels, at most.

    Returns:
        (N,) block pairs as numbers block·2³² + triangle, ascending.
    """
    per_facet = np.diff(blocks.start)
    single = per_facet[pairs.facet] == 1
    block = [blocks.start[pairs.facet[single]]]
    triangle = [pairs.triangle[single]]
    rest = np.flatnonzero(~single)
    for at in range(0, rest.size, _CHUNK):
        chunk = rest[at : at + _CHUNK]
        found, owner = _blocks_under(pairs.facet[chunk], pairs.triangle[chunk], sight, rays, blocks, reach)
        block.append(found)
        triangle.append(pairs.triangle[chunk][owner])
    keys: IntArray = np.concatenate(block) << 32 | np.concatenate(triangle)
    if rest.size:
        keys.sort()
    return keys


def vertex_blocks(vertices: FloatArray, facet: Int32Array, rays: QuiltRays, blocks: Blocks) -> Int32Array:
    """The blocks (n,) that vertices lie well inside of, −1 where there is none.

    A triangle all of whose corners have the same block needs no other: facet and block are convex.

    Args:
        vertices: (n, 3) minus the eye.
        facet: (n,) the convex facet that alone shows each vertex and what is about it, −1 for none.
        rays: rays through the quilt.
        blocks: the blocks.
    """
    result = np.full(facet.size, -1, dtype=np.int32)
    count = np.diff(blocks.start)
    known = np.flatnonzero(facet >= 0)
    mine = count.take(facet[known])
    alone, known = known[mine == 1], known[mine > 1]
    result[alone] = blocks.start.take(facet[alone])
    if not known.size:
        return result
    first = np.where(count > 0, blocks.start[:-1], 0)  # nobody asks about facets without blocks
    last = first + np.maximum(count, 1) - 1
    matrices = np.ascontiguousarray(block_matrices(rays, blocks, first).transpose(1, 2, 0))
    width, height = _extent(blocks, first, last)
    for at in range(0, known.size, _CHUNK):
        some = known[at : at + _CHUNK]
        of = facet.take(some)
        corner = np.ascontiguousarray(vertices.take(some, axis=0).T)[None]
        x, y, w = project(corner, np.take(matrices, of, axis=2), np.empty_like(corner))[0]
        left, right = _cells_about(x / w, width.take(of))
        top, bottom = _cells_about(y / w, height.take(of))
        block = first.take(of) + top * blocks.columns.take(of) + left
        result[some] = np.where((left == right) & (top == bottom), block, -1)
    return result


def _extent(blocks: Blocks, first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """Width and height (n,), in pixels, of what reaches from the first blocks (n,) to the last ones."""
    width: IntArray = blocks.x0[last] + blocks.width[last] - blocks.x0[first]
    height: IntArray = blocks.y0[last] + blocks.height[last] - blocks.y0[first]
    return width, height


def _cells_about(pixel: FloatArray, extent: IntArray) -> tuple[IntArray, IntArray]:
    """First and last block (n,), by columns or rows, of all that is near pixels (n,) of an `extent` (n,)."""
    low = np.maximum(pixel - _WELL_INSIDE, 0.0)
    high = np.minimum(pixel + _WELL_INSIDE, extent - 1.0)
    return low.astype(np.int64) // SIDE, high.astype(np.int64) // SIDE


def pairs_by_block(keys: Sequence[IntArray], blocks: Blocks) -> BlockPairs:
    """The pairs of `block_keys`, of shares of ascending triangles."""
    edges = np.arange(blocks.facet.size + 1, dtype=np.int64) << 32
    start = np.stack([np.searchsorted(share, edges) for share in keys])
    begin = np.cumsum([0, *(share.size for share in keys[:-1])])
    memory = np.concatenate([triangles_of(share) for share in keys])
    return BlockPairs(begin[:, None] + start[:, :-1], np.diff(start, axis=1), memory)


def triangles_of(keys: IntArray) -> Int32Array:
    """The triangles of `block_keys`."""
    return (keys & 0xFFFFFFFF).astype(np.int32)


def _blocks_under(
    facet: Int32Array, triangle: Int32Array, sight: Sight, rays: QuiltRays, blocks: Blocks, reach: float
) -> tuple[IntArray, IntArray]:
    """Blocks (S,) that the triangles' boxes touch, and whose box each is (S,)."""
    first, last = blocks.start[facet], blocks.start[facet + 1] - 1
    matrix = block_matrices(rays, blocks, first)
    width, height = _extent(blocks, first, last)
    corners = gather_corners(sight.vertices, sight.triangles[triangle])
    homogeneous = project(corners, np.ascontiguousarray(matrix.transpose(1, 2, 0)), np.empty_like(corners))
    box = pixel_boxes(homogeneous, width, height, reach)
    x0, y0 = box[0::2] // SIDE
    x1, y1 = box[1::2] // SIDE
    counts = (x1 - x0 + 1) * (y1 - y0 + 1)
    counts[(box[1] < box[0]) | (box[3] < box[2])] = 0
    owner, rank = segments(offsets(counts))
    across = (x1 - x0 + 1)[owner]
    column = x0[owner] + rank % across
    row = y0[owner] + rank // across
    return first[owner] + row * blocks.columns[facet[owner]] + column, owner


def warp(
    sight: Sight,
    block_pairs: BlockPairs,
    blocks: Blocks,
    block: IntArray,
    matrices: FloatArray,
    reach: FloatArray | float = 0.0,
) -> Warped:
    """The pairs of some blocks in homogeneous pixels, in the order of `block_pairs`.

    Args:
        sight: the scene from the eye.
        block_pairs: pairs of all blocks.
        blocks: the blocks.
        block: (K,) the blocks of the batch, ascending.
        matrices: (K, 3, 3) from `block_matrices`.
        reach: pixels by which samples lie beside the centres of their pixels, at most: (K, 2), a row a block,
            or for all.
    """
    triangle, place = block_pairs.of(block)
    matrices = np.ascontiguousarray(matrices.transpose(1, 2, 0))
    extent = blocks.width[block].astype(np.float64), blocks.height[block].astype(np.float64)
    margin = blocks.margin[block].astype(np.int32)
    corners = np.empty((3, 3, place.size))
    box = np.empty((4, place.size), dtype=np.int32)
    for at in range(0, place.size, _CHUNK):
        part = slice(at, at + _CHUNK)
        world = gather_corners(sight.vertices, sight.triangles.take(triangle[part], axis=0))
        project(world, np.take(matrices, place[part], axis=2), corners[:, :, part])
        width, height = (size.take(place[part]) for size in extent)
        if isinstance(reach, np.ndarray):
            beside = reach[:, 0].take(place[part]), reach[:, 1].take(place[part])
            box[:, part] = pixel_boxes(corners[:, :, part], width, height, beside)
        else:
            box[:, part] = pixel_boxes(corners[:, :, part], width, height, reach)
        np.maximum(box[0, part], margin.take(place[part]), out=box[0, part])
    return Warped(triangle, place.astype(np.int32), corners, box, sight.cut.take(triangle))
