"""The paper's way: vertices go to the pixels that show them, and edges between them are straight.

They are not, so triangles are divided until they bend by less than is asked for (Jones et al., section
4.3). Names of pixels along edges remain wrong, fewer the finer the division; `raster` needs none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, segments
from quiltcli.geometry import offsets as starts_of
from quiltcli.ring.curve import Curve
from quiltcli.ring.propose import bending
from quiltcli.ring.raster import Limits, Mesh, Visible, in_frame, mesh_of, see
from quiltcli.ring.rig import Pose

TESSELLATE = 0.05
"""Pixels by which edges may bend where a job does not say."""


def see_by_vertices(
    pose: Pose,
    curve: Curve,
    mesh: Mesh,
    size: tuple[int, int],
    backface_culling: bool = False,
    limits: Limits | None = None,
    beside: tuple[float, float] = (0.0, 0.0),
    *,
    tessellate: float = TESSELLATE,
    soft: BoolArray | None = None,
) -> Visible:
    """As `raster.see`, with straight edges; `tessellate` is how far they may bend, pixels."""
    corners = in_frame(pose, mesh.vertices)
    bend = bending(pose, curve, corners.min(axis=1), corners.max(axis=1)).most / 2
    pieces, parent = divided(mesh, bend / 8, tessellate)
    passed = None if soft is None else soft[parent]
    seen = see(pose, curve, pieces, size, backface_culling, limits, beside, straight=True, soft=passed)
    through = None if seen.through is None else replace(seen.through, parent=parent)
    return replace(seen, triangle=parent[seen.triangle], corners=corners, through=through)


def divided(mesh: Mesh, bend: float, most: float) -> tuple[Mesh, IntArray]:
    """A mesh of pieces that bend by at most `most`, and the triangle (T,) that each is of.

    Args:
        mesh: the triangles.
        bend: pixels by which an edge of length 1 bends; it grows with the square of the length.
        most: pixels.
    """
    times = np.maximum(np.ceil(np.sqrt(mesh.square * (bend / most))), 1).astype(np.int64)
    if int(times.max(initial=1)) == 1:
        return mesh, np.arange(mesh.count)
    parent, rank = segments(starts_of(times * times))
    count = times[parent]
    # Rows of a divided triangle: 2r + 1 pieces in the r-th, every second one upside down.
    row = np.sqrt(rank).astype(np.int64)
    place = rank - row * row
    column, odd = place // 2, place % 2 == 1
    first = _corner(mesh, parent, row, column, count)
    second = _corner(mesh, parent, row + 1, column + odd, count)
    third = _corner(mesh, parent, row + ~odd, column + 1, count)
    points = np.concatenate((first, second, third), axis=1).T
    number = np.arange(parent.size, dtype=np.int32)
    return mesh_of(points, np.stack((number, number + parent.size, number + 2 * parent.size), axis=1)), parent


def _corner(mesh: Mesh, parent: IntArray, row: IntArray, column: IntArray, count: IntArray) -> FloatArray:
    """Points (3, N) of triangles divided `count` times: `row` steps down, `column` of them to the right."""
    a, b, c = (mesh.vertices[:, corner[parent]] for corner in mesh.triangles)
    down, across = row / count, column / count
    result: FloatArray = a * (1 - down) + b * (down - across) + c * across
    return result
