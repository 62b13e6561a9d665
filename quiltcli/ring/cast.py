"""Rays cast with Embree from every pixel's own viewpoint, and settled in double precision.

Embree is single precision and may name the neighbour near an edge. Five rays are cast around each sample;
where they name different triangles, all of these and what touches them are met in double precision by
Möller and Trumbore's intersection, in the world's own coordinates: nothing of `raster` takes part.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from quiltcli.errors import MissingExtraError
from quiltcli.geometry import BoolArray, FloatArray, IntArray, cross, dot
from quiltcli.ring.curve import Curve
from quiltcli.ring.maps import backward
from quiltcli.ring.raster import Limits, Mesh, Visible, in_frame
from quiltcli.ring.rays import Window, window_rays
from quiltcli.ring.rig import Pose
from quiltcli.visibility.rays.embree import embree_scene
from quiltcli.visibility.rays.exact import Neighbours
from quiltcli.visibility.rays.pixels import OFFSETS
from quiltcli.visibility.setup.planes import LATTICE

MISS = -1
_STEP = 1e-6
_MOST_STEPS = 1000
_SAME = 2.0**-30
_ROWS = 1 << 16


@dataclass(frozen=True)
class Target:
    """A scene for rays.

    Attributes:
        corners: (V, 3) world metres.
        triangles: (T, 3).
        normal: (T, 3) by the winding.
        embree: Embree's scene of it.
        neighbours: which triangles touch which.
        radius: no corner is farther from the world's origin, metres.
    """

    corners: FloatArray
    triangles: Any
    normal: FloatArray
    embree: Any
    neighbours: Neighbours
    radius: float


@dataclass(frozen=True)
class Lines:
    """N rays: from viewpoints (N, 3) along unit directions (N, 3)."""

    eye: FloatArray
    along: FloatArray


@lru_cache(maxsize=1)
def _target_of(mesh: _Same) -> Target:
    return aim_at(mesh.mesh)


@dataclass(frozen=True)
class _Same:
    """A mesh, equal to itself only."""

    mesh: Mesh

    def __hash__(self) -> int:
        return id(self.mesh)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.mesh is self.mesh


def aim_at(mesh: Mesh) -> Target:
    """Make a target of a mesh.

    Raises:
        MissingExtraError: there is no Embree on this machine.
    """
    corners = np.ascontiguousarray(mesh.vertices.T)
    triangles = np.ascontiguousarray(mesh.triangles.T)
    embree = embree_scene(corners, triangles)
    if embree is None:
        words = "rays are cast with Embree, but embreex is not installed (not every kind of machine has it)"
        raise MissingExtraError(words)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    radius = float(np.sqrt(dot(corners, corners).max(initial=0.0)))
    return Target(corners, triangles, cross(b - a, c - a), embree, Neighbours(corners, triangles), radius)


def see_by_rays(
    pose: Pose,
    curve: Curve,
    mesh: Mesh,
    size: tuple[int, int],
    backface_culling: bool = False,
    limits: Limits | None = None,
    beside: tuple[float, float] = (0.0, 0.0),
) -> Visible:
    """As `raster.see`, by rays."""
    target, window = _target_of(_Same(mesh)), Window(0, 0, *size)
    pixel: list[IntArray] = []
    triangle: list[IntArray] = []
    for start in range(0, window.size, _ROWS):
        every_pixel = np.arange(start, min(start + _ROWS, window.size), dtype=np.float64)
        row, column = np.divmod(every_pixel, window.width)
        found = first_triangles(
            target, pose, curve, column + beside[0], row + beside[1], backface_culling, limits
        )
        hit = np.flatnonzero(found >= 0)
        pixel.append(hit + start)
        triangle.append(found[hit])
    rays = window_rays(pose, curve, window, (LATTICE[0] + beside[0], LATTICE[1] + beside[1]))
    every = np.concatenate(pixel)
    corners = in_frame(pose, mesh.vertices)
    return Visible(window, rays, every, np.concatenate(triangle), corners, window.size, every.size, 0.0)


def lines_of(pose: Pose, curve: Curve, x: FloatArray, y: FloatArray) -> Lines:
    """The rays of pixels (N,) in the world."""
    rays = backward(pose, curve, x, y)
    eye = pose.to_world(rays.viewer.T)
    along = pose.to_world(rays.mirror.T) - eye
    return Lines(eye, along / np.sqrt(dot(along, along))[:, None])


def first_triangles(
    target: Target,
    pose: Pose,
    curve: Curve,
    column: FloatArray,
    row: FloatArray,
    backface_culling: bool = False,
    limits: Limits | None = None,
) -> IntArray:
    """The first triangle (N,) that pixels see, −1 for none; five rays each, and where they differ exactly."""
    limits = limits or Limits(0.0, np.inf)
    named = np.stack(
        [
            cast(target, lines_of(pose, curve, column + 0.5 + dx, row + 0.5 + dy), backface_culling, limits)
            for dx, dy in OFFSETS
        ]
    )
    result: IntArray = named[0].copy()
    rows = np.flatnonzero((named != named[0]).any(axis=0))
    if rows.size:
        x, y = column[rows] + (0.5 + LATTICE[0]), row[rows] + (0.5 + LATTICE[1])
        lines = lines_of(pose, curve, x, y)
        result[rows] = settled(target, lines, named[:, rows], backface_culling, limits)
    return result


def cast(target: Target, lines: Lines, backface_culling: bool, limits: Limits) -> IntArray:
    """The triangles (N,) that Embree names along rays, those before near and from behind passed by."""
    found = np.full(len(lines.eye), MISS, dtype=np.int64)
    live = np.arange(len(lines.eye))
    # From just outside of the scene, so that single precision keeps its digits.
    start = np.maximum(-dot(lines.eye, lines.along) - target.radius * 1.01, 0.0)
    for _ in range(_MOST_STEPS):
        if not live.size:
            break
        origin = lines.eye[live] + start[live, None] * lines.along[live]
        met = target.embree.run(origin.astype(np.float32), lines.along[live].astype(np.float32))
        met = met.astype(np.int64)
        live, met = live[met >= 0], met[met >= 0]
        away = dot(target.normal[met], lines.along[live])
        to = dot(target.normal[met], target.corners[target.triangles[met, 0]] - lines.eye[live])
        distance = np.divide(to, away, out=np.zeros(away.shape), where=away != 0)
        passed = (distance < limits.near) | (backface_culling & (away >= 0))
        ends = ~passed & (distance <= limits.far)
        found[live[ends]] = met[ends]
        live, distance = live[passed], distance[passed]
        start[live] = np.maximum(distance, start[live]) * (1 + _STEP) + _STEP * 1e-3
    return found


def settled(
    target: Target, lines: Lines, named: IntArray, backface_culling: bool, limits: Limits
) -> IntArray:
    """The nearest triangles (N,) of those named (k, N) and all that touch them, in double precision."""
    which, column = np.nonzero(named.T >= 0)
    row, triangle = target.neighbours.around(which, named.T[which, column])
    hit, distance = meet(target, lines, row, triangle, backface_culling)
    hit &= (distance >= limits.near) & (distance <= limits.far)
    row, triangle, distance = row[hit], triangle[hit], distance[hit]
    nearest = np.full(len(lines.eye), np.inf)
    np.minimum.at(nearest, row, distance)
    first = distance <= nearest[row] * (1 + _SAME)
    result = np.full(len(lines.eye), target.triangles.shape[0], dtype=np.int64)
    np.minimum.at(result, row[first], triangle[first])
    return np.where(result == target.triangles.shape[0], MISS, result)


def meet(
    target: Target, lines: Lines, row: IntArray, triangle: IntArray, backface_culling: bool
) -> tuple[BoolArray, FloatArray]:
    """Whether rays `row` (M,) meet triangles (M,), and at which distance: Möller and Trumbore (1997)."""
    a, b, c = (target.corners[target.triangles[triangle, k]] for k in range(3))
    eye, along = lines.eye[row], lines.along[row]
    p = cross(along, c - a)
    det = dot(b - a, p)
    q = cross(eye - a, b - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v, t = dot(eye - a, p) / det, dot(along, q) / det, dot(c - a, q) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    hit &= (det > 0) if backface_culling else (det != 0)
    return hit, t
