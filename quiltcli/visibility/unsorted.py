"""Binning without sorting: facets are sent the triangles of an octree's leaves, or all of them.

What is sent is more than what shows, never less, so that the same pixels come of it as of sorting.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from quiltcli.errors import JobError
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray
from quiltcli.projection.planar import QuiltRays
from quiltcli.scene import Scene
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.binning.cones import Cones
from quiltcli.visibility.binning.octree import build_octree, facet_leaves, sent
from quiltcli.visibility.binning.pairs import Pairs
from quiltcli.visibility.draw import Blocks, block_keys, pairs_by_block, triangles_in_range
from quiltcli.visibility.shares import Binned, Share, faces_eye, join, sight_of, unseen

_AT_ONCE = 1 << 18
MOST_PAIRS = 100_000_000
"""Of triangles and facets in a frame, a few bytes each."""

Sent: TypeAlias = Iterator[tuple[int, IntArray]]
Sending: TypeAlias = Callable[[FloatArray, Int32Array, IntArray, Cones], Sent]
"""From vertices minus eye (V, 3), triangles (T, 3), those that are drawn (D,) and the cones of lit parts to
facets and the triangles that each is sent, ascending."""


def by_octree(vertices: FloatArray, triangles: Int32Array, drawn: IntArray, cones: Cones) -> Sent:
    """Each lit facet with the triangles of the leaves that meet its cone."""
    tree = build_octree(vertices, triangles, drawn)
    leaves = facet_leaves(tree, cones, int(cones.facet.max(initial=-1)) + 1)
    return ((facet, found) for facet, found, _ in sent(tree, leaves))


def to_all(vertices: FloatArray, triangles: Int32Array, drawn: IntArray, cones: Cones) -> Sent:
    """Each lit facet with all triangles."""
    return ((facet, drawn) for facet in np.unique(cones.facet).tolist())


def bin_unsorted(
    scene: Scene,
    viewer: Viewer,
    rays: QuiltRays,
    blocks: Blocks,
    cones: Cones,
    send: Sending,
    *,
    single: BoolArray | None,
    culling: bool,
    reach: float,
) -> Binned:
    """Bin a frame by what each facet is sent.

    Args:
        scene: the scene.
        viewer: the viewer.
        rays: rays through the quilt.
        blocks: the blocks of the layout.
        cones: of the lit parts of the display.
        send: chooses what each facet is sent.
        single: (T,) triangles that are left out where they face away; None for none.
        culling: whether all are left out that face away.
        reach: pixels by which samples lie beside the centres of their pixels, at most.

    Raises:
        JobError: more pairs than memory is likely to hold.
    """
    seen = unseen(scene)
    np.subtract(scene.vertices, viewer.eye, out=seen.vertices)
    seen.reach[:] = viewer.reach_of(seen.vertices.T)
    wanted, seen.cut[:] = triangles_in_range(seen.reach, seen.vertices, scene.triangles, viewer)
    if culling:
        wanted &= faces_eye(scene.planes, viewer.eye)
    elif single is not None:
        wanted &= ~single | faces_eye(scene.planes, viewer.eye)
    drawn, sight = np.flatnonzero(wanted), sight_of(scene, seen, culling=culling)
    reached = np.zeros(wanted.size, dtype=np.bool_)
    keys, count = [np.zeros(0, dtype=np.int64)], 0
    for pairs in _together(send(seen.vertices, scene.triangles, drawn, cones)):
        if count + pairs.triangle.size > MOST_PAIRS:
            raise JobError(
                f"frame {viewer.frame}: without sorting, more than {MOST_PAIRS:,} pairs of triangles and"
                " facets would be drawn (expected fewer of either; method: homography sorts them)"
            )
        keys.append(block_keys(pairs, sight, rays, blocks, reach))
        reached[pairs.triangle] = True
        count += pairs.triangle.size
    # Facets come in their order, and their blocks with them.
    share = Share(np.concatenate(keys), drawn.size, int(np.count_nonzero(reached)), 0, count)
    return join(sight, [share], pairs_by_block([share.keys], blocks))


def _together(sent: Sent) -> Iterator[Pairs]:
    """The pairs of some facets at a time: as many as are not too much, and not each by itself."""
    facets: list[int] = []
    triangles: list[IntArray] = []
    total = 0

    def pairs() -> Pairs:
        facet = np.repeat(np.array(facets, np.int32), [found.size for found in triangles])
        return Pairs(facet, np.concatenate(triangles).astype(np.int32), 0, total)

    for facet, found in sent:
        if facets and total + found.size > _AT_ONCE:
            yield pairs()
            facets, triangles, total = [], [], 0
        facets.append(facet)
        triangles.append(found)
        total += found.size
    if facets:
        yield pairs()
