"""Polygons in space as ragged arrays: normals, plane coordinates, convexity, triangles.

Polygons are given as `corners` (C, 3) and `start` (F+1,), as in the mesh record and the display's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quiltcli.formats.mesh.ears import STRAIGHT, ear_clip, ear_sines, sides
from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    IntArray,
    cross,
    dot,
    next_in_row,
    normalized,
    segments,
    some_rows,
)


class Triangles(NamedTuple):
    """Triangles that cover polygons.

    Attributes:
        corners: (T, 3) numbers of the polygons' corners, in their winding.
        face: (T,) the polygon each is a part of, ascending.
    """

    corners: IntArray
    face: IntArray


def area_vectors(corners: FloatArray, start: IntArray) -> FloatArray:
    """Newell's area vectors (F, 3): along the side the winding faces, as long as twice the area."""
    row, _ = segments(start)
    local = corners - corners[start[:-1]][row]
    result: FloatArray = np.add.reduceat(cross(local, local[next_in_row(start)]), start[:-1], axis=0)
    return result


def diameters(corners: FloatArray, start: IntArray) -> FloatArray:
    """Diagonal (F,) of each polygon's axis-aligned bounding box, the size tolerances refer to."""
    high = np.maximum.reduceat(corners, start[:-1], axis=0)
    extent = high - np.minimum.reduceat(corners, start[:-1], axis=0)
    result: FloatArray = np.sqrt(dot(extent, extent))
    return result


def plane_coordinates(corners: FloatArray, start: IntArray) -> FloatArray:
    """Coordinates (C, 2) in each polygon's plane, counter-clockwise in the order of the winding."""
    row, _ = segments(start)
    normal = normalized(area_vectors(corners, start))
    local = corners - corners[start[:-1]][row]
    # Any axis in the plane does; the world axis farthest from the normal gives the safest one.
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    x = normalized(cross(axis, normal))[row]
    y = cross(normal[row], x)
    return np.stack((dot(local, x), dot(local, y)), axis=1)


def convex(points: FloatArray, start: IntArray, straight: bool = True) -> BoolArray:
    """Whether each polygon (F,) is convex and simple.

    Args:
        points: (C, 2) counter-clockwise plane coordinates.
        start: (F+1,) offsets.
        straight: whether a corner may lie on the line between its neighbours.
    """
    step = next_in_row(start)
    edge = points[step] - points
    after = edge[step]
    turn = edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0]
    ahead = edge[:, 0] * after[:, 0] + edge[:, 1] * after[:, 1]
    scale = np.hypot(edge[:, 0], edge[:, 1]) * np.hypot(after[:, 0], after[:, 1])
    good = turn > STRAIGHT * scale
    if straight:
        good |= (np.abs(turn) <= STRAIGHT * scale) & (ahead > 0)
    # All turns to the left could still wind twice, as a pentagram does.
    whole = np.add.reduceat(np.arctan2(turn, ahead), start[:-1])
    result: BoolArray = np.logical_and.reduceat(good, start[:-1]) & (np.abs(whole - 2 * np.pi) < 1)
    return result


def triangulate(points: FloatArray, start: IntArray) -> Triangles:
    """Cover polygons with triangles: convex ones by fans, the others by ears.

    Args:
        points: (C, 2) plane coordinates; polygons without area or that are not finite become fans.
        start: (F+1,) offsets, no polygon with fewer than three corners.
    """
    counts = np.diff(start)
    fans = counts == 3
    wide = np.flatnonzero(~fans)
    if not len(wide):
        return Triangles(start[:-1, None] + np.arange(3), np.arange(len(counts)))
    if len(wide):
        part, place = some_rows(start, wide)
        own = points[place]
        broken = ~np.logical_and.reduceat(np.isfinite(own).all(axis=1), part[:-1])
        broken |= ~np.logical_or.reduceat(own.any(axis=1), part[:-1])
        fans[wide] = broken | convex(own, part, straight=False)
    found = [_fans(start, np.flatnonzero(fans)), _quads(points, start, np.flatnonzero(~fans & (counts == 4)))]
    for face in np.flatnonzero(~fans & (counts > 4)).tolist():
        ears = ear_clip(points[start[face] : start[face + 1]])
        cut = start[face] + np.array(ears, np.int64).reshape(-1, 3)
        found.append(Triangles(cut, np.full(len(ears), face)))
    owner = np.concatenate([triangles.face for triangles in found])
    order = np.argsort(owner, kind="stable")
    return Triangles(np.concatenate([triangles.corners for triangles in found])[order], owner[order])


def triangle_areas(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Signed areas (T,) in the plane, positive for triangles that turn to the left."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    result: FloatArray = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    return result


def _fans(start: IntArray, faces: IntArray) -> Triangles:
    """Fans about the first corner of each polygon."""
    part, place = some_rows(start, faces)
    row, rank = segments(part)
    # Corner k of a fan, but for its first and last, makes the triangle (first, k, k + 1).
    second = np.flatnonzero((rank > 0) & (rank < np.diff(part)[row] - 1))
    corners = np.stack((start[faces][row[second]], place[second], place[second] + 1), axis=1)
    return Triangles(corners, faces[row[second]])


def _quads(points: FloatArray, start: IntArray, faces: IntArray) -> Triangles:
    """Quadrilaterals that are not convex, all at once: as ear clipping would, and fans of crossed ones."""
    if not len(faces):
        return Triangles(np.zeros((0, 3), np.int64), np.zeros(0, np.int64))
    place = start[faces, None] + np.arange(4)
    corners = points[place]
    size = np.abs(corners - corners[:, :1]).max(axis=(1, 2)) ** 2 * STRAIGHT
    best, width = np.zeros(len(faces), np.int64), np.full(len(faces), STRAIGHT)
    crossed = np.ones(len(faces), np.bool_)
    for tip in range(4):
        ear = corners[:, [tip - 1, tip, (tip + 1) % 4]]
        sine = ear_sines(ear[:, 0], ear[:, 1], ear[:, 2])
        better = (sine > width) & (sides(ear, corners[:, (tip + 2) % 4]) < -size)
        best[better], width[better], crossed[better] = tip, sine[better], False
    tips = np.array([(3, 0, 1), (0, 1, 2), (1, 2, 3), (2, 3, 0)])[best]
    rests = np.array([(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)])[best]
    tips[crossed], rests[crossed] = (0, 1, 2), (0, 2, 3)
    local = np.stack((tips, rests), axis=1).reshape(-1, 3)
    row = np.repeat(np.arange(len(faces)), 2)
    return Triangles(place[row[:, None], local], faces[row])
