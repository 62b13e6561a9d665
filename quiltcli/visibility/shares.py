"""Binning a frame in shares: vertices first, then triangles, by whoever is free.

What is found does not depend on how the work is divided. A share of the vertices tells for each where
it is from the eye and which facet's core its ray meets; a share of the triangles needs that of all
vertices and gives pairs of triangles and blocks.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.scene import Scene
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.pairs import Cones, Cores, Parts, common_value, lit_cones, pairs_of
from quiltcli.visibility.binning.patches import with_patch_cones
from quiltcli.visibility.draw import (
    BlockPairs,
    Blocks,
    Sight,
    block_keys,
    pairs_by_block,
    triangles_in_range,
    vertex_blocks,
)


@dataclass(frozen=True)
class Seen:
    """What is known of the scene's V vertices and T triangles from one eye, written share by share.

    Attributes:
        vertices: (V, 3) world minus eye, metres.
        reach: (V,) what near and far cut, metres.
        core: (V,) part of the display whose core the ray through the vertex meets; −1 for none, and where
            all triangles at the vertex are left out because they face away.
        block: (V,) the block that it lies well inside of, −1 for none.
        cut: (T,) triangles that reach beyond the near or far depth.
    """

    vertices: FloatArray
    reach: FloatArray
    core: Int32Array
    block: Int32Array
    cut: BoolArray


@dataclass(frozen=True)
class BinPlan:
    """What all shares of a frame's binning have in common.

    Attributes:
        scene: the scene.
        blocks: the blocks of the layout.
        viewer: the viewer.
        rays: rays through the quilt.
        cones: of the lit parts of the display.
        cores: of the same parts.
        culling: whether triangles that face away are left out.
        single: (T,) triangles that are left out where they face away; None for none.
        reach: pixels by which samples lie beside the centres of their pixels, at most.
    """

    scene: Scene
    blocks: Blocks
    viewer: Viewer
    rays: QuiltRays
    cones: Cones
    cores: Cores
    culling: bool
    reach: float
    single: BoolArray | None = None


@dataclass(frozen=True)
class Share:
    """What a share of the triangles has on the display.

    Attributes:
        keys: (N,) block pairs as `block_keys` gives them, ascending.
        triangles: those that can be drawn at all.
        reaching: those of them that reach a facet.
        settled: those that the first pass of binning settled.
        pairs: pairs of triangles and facets.
    """

    keys: IntArray
    triangles: int
    reaching: int
    settled: int
    pairs: int


@dataclass(frozen=True)
class Binned:
    """A frame after binning; numbers as in `Share`, of all triangles."""

    sight: Sight
    pairs: BlockPairs
    triangles: int
    reaching: int
    settled: int
    facet_pairs: int


def bin_plan(
    scene: Scene,
    parts: Parts,
    blocks: Blocks,
    viewer: Viewer,
    rays: QuiltRays,
    *,
    culling: bool,
    reach: float = 0.0,
    one_sided: bool = False,
) -> BinPlan:
    """The plan of a frame.

    Args:
        scene: the scene.
        parts: the convex pieces of the facets, in the world.
        blocks: the blocks of the layout.
        viewer: the viewer.
        rays: rays through the quilt.
        culling: whether triangles that face away are left out.
        reach: pixels by which samples lie beside the centres of their pixels, at most.
        one_sided: whether those are that the scene's materials say are seen from one side.
    """
    cones = lit_cones(parts, rays.lit, viewer.eye)
    if rays.patched is not None:
        cones = with_patch_cones(cones, rays.patched, blocks, reach)
    single = scene.one_sided if one_sided else None
    return BinPlan(scene, blocks, viewer, rays, cones, Cores(cones), culling, reach, single)


def unseen(scene: Scene) -> Seen:
    """Memory for what will be known of a scene."""
    count = len(scene.vertices)
    return Seen(
        np.empty((count, 3)),
        np.empty(count),
        np.empty(count, dtype=np.int32),
        np.empty(count, dtype=np.int32),
        np.empty(len(scene.triangles), dtype=np.bool_),
    )


def see_vertices(plan: BinPlan, part: slice, seen: Seen) -> None:
    """Find out about some of the vertices and write it down."""
    vertices = np.subtract(plan.scene.vertices[part], plan.viewer.eye, out=seen.vertices[part])
    seen.reach[part] = plan.viewer.reach_of(vertices.T)
    if plan.culling:
        asked = np.flatnonzero(may_face(plan.scene.facing[:, part], vertices))
        core = np.full(len(vertices), -1, dtype=np.int32)
        core[asked] = plan.cores.met_by(vertices.take(asked, axis=0))
    else:
        core = plan.cores.met_by(vertices)
    seen.core[part] = core
    facet = np.append(plan.cones.whole_facet, np.int32(-1)).take(core)
    seen.block[part] = vertex_blocks(vertices, facet, plan.rays, plan.blocks)


def bin_share(plan: BinPlan, part: slice, seen: Seen) -> Share:
    """Bin some of the triangles, once all vertices are seen; writes down which of them are cut."""
    # Triangles that are drawn at all.
    scene, eye = plan.scene, plan.viewer.eye
    wanted, cut = triangles_in_range(seen.reach, seen.vertices, scene.triangles[part], plan.viewer)
    seen.cut[part] = cut
    if plan.culling:
        wanted &= faces_eye(scene.planes[:, part], eye)
    elif plan.single is not None:
        wanted &= ~plan.single[part] | faces_eye(scene.planes[:, part], eye)
    drawn = np.flatnonzero(wanted)
    drawn += part.start
    # First pass: all corners see one block, or the cones of facets decide (second pass).
    block = common_value(seen.block, scene.triangles, drawn)
    inside, rest = np.flatnonzero(block >= 0), np.flatnonzero(block < 0)
    pairs = pairs_of(seen.vertices, scene.triangles, drawn[rest], seen.core, plan.cones)
    at_once = block[inside].astype(np.int64) << 32 | drawn[inside]
    # Pairs as numbers that sort by block, then triangle.
    sight = sight_of(scene, seen, culling=plan.culling)
    keys = np.concatenate((at_once, block_keys(pairs, sight, plan.rays, plan.blocks, plan.reach)))
    keys.sort()
    return Share(
        keys=keys,
        triangles=drawn.size,
        reaching=inside.size + pairs.reaching,
        settled=inside.size + pairs.settled,
        pairs=inside.size + pairs.facet.size,
    )


def join(sight: Sight, shares: Iterable[Share], pairs: BlockPairs) -> Binned:
    """The frame, when all its shares are done; `pairs` are those of all shares."""
    shares = list(shares)
    return Binned(
        sight=sight,
        pairs=pairs,
        triangles=sum(share.triangles for share in shares),
        reaching=sum(share.reaching for share in shares),
        settled=sum(share.settled for share in shares),
        facet_pairs=sum(share.pairs for share in shares),
    )


def bin_frame(plan: BinPlan) -> Binned:
    """Bin a frame in one share."""
    seen = unseen(plan.scene)
    see_vertices(plan, slice(0, len(seen.vertices)), seen)
    share = bin_share(plan, slice(0, len(seen.cut)), seen)
    return join(
        sight_of(plan.scene, seen, culling=plan.culling), [share], pairs_by_block([share.keys], plan.blocks)
    )


def sight_of(scene: Scene, seen: Seen, *, culling: bool) -> Sight:
    """The scene from the eye, as far as it has been seen."""
    return Sight(seen.vertices, scene.triangles, seen.cut, culling, scene.soft)


def faces_eye(planes: FloatArray, eye: FloatArray) -> BoolArray:
    """Which triangles with these `planes` (4, T) are wound counter-clockwise as seen from `eye` (3,)."""
    x, y, z, offset = planes
    result: BoolArray = x * eye[0] + y * eye[1] + z * eye[2] > offset
    return result


def may_face(facing: FloatArray, vertices: FloatArray) -> BoolArray:
    """Which vertices (n, 3), minus the eye, have triangles that may face the eye, by `Scene.facing` (4, n).

    A wrong answer costs time, nothing else: without a core its triangles are settled by the second pass.
    """
    x, y, z = vertices.T
    towards = facing[0] * x + facing[1] * y + facing[2] * z
    result: BoolArray = towards < facing[3] * np.sqrt(x * x + y * y + z * z)
    return result
