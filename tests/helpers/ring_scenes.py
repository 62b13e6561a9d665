"""Mirrors, meshes and rays for the tests of rings."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from quiltcli.geometry import FloatArray, Int32Array, IntArray, cross, dot, rotation_deg
from quiltcli.ring.curve import Curve, User
from quiltcli.ring.maps import backward
from quiltcli.ring.raster import Mesh, Visible, mesh_of
from quiltcli.ring.rig import Pose, Rig, Side, ideal_projector

HEIGHT, DIAMETER = 0.6, 0.13
BESIDE = User(azimuth=0.5, height=0.1, distance=0.6, hold=0.1, blend=0.25)
RING = Curve(0.4, 1.0)
TRACKED = Curve(0.4, 1.0, (BESIDE,))


def tilted(size: tuple[int, int]) -> FloatArray:
    """A projector beside the axis that looks a little aside."""
    straight = ideal_projector(size, HEIGHT, DIAMETER)
    focal = size[0] * HEIGHT / DIAMETER
    intrinsic = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1]])
    turned = np.linalg.solve(intrinsic, straight[:, :3]) @ rotation_deg((0.2, 3, 0.4))
    return np.asarray(intrinsic @ np.column_stack((turned, -turned @ [0.004, 0.62, -0.003])))


def pose(
    size: tuple[int, int], angle: float = 0.3, ridge: float = 0.0, aside: bool = False, cone: bool = False
) -> Pose:
    """One plane of a mirror."""
    projector = tilted(size) if aside else ideal_projector(size, HEIGHT, DIAMETER)
    return Pose(angle, math.pi / 4, ridge, projector, cone)


def rig(size: tuple[int, int], positions: int = 288, disk: float = 0.13, cone: bool = False) -> Rig:
    """The usual mirror with a small picture."""
    side = Side(0.0, 0.0, ideal_projector(size, HEIGHT, DIAMETER))
    step = 2 * math.pi / positions
    return Rig(size, (side,), math.pi / 4, disk, (0.0, 0.0), positions, 0.0, step, math.radians(1.25), cone)


def ball(radius: float = 0.04, times: int = 2) -> tuple[FloatArray, Int32Array]:
    """A closed mesh, uneven so that nothing lies on a symmetry."""
    found = trimesh.creation.icosphere(subdivisions=times, radius=radius)
    vertices = np.asarray(found.vertices) * (1.0, 0.8, 0.9) + (0.004, 0.003, -0.006)
    return vertices, np.asarray(found.faces, dtype=np.int32)


def cube(half: float = 0.03) -> tuple[FloatArray, Int32Array]:
    """Twelve triangles with edges so long that they bend."""
    found = trimesh.creation.box(extents=(2 * half,) * 3)
    return np.asarray(found.vertices) @ rotation_deg((11, 23, 37)).T, np.asarray(found.faces, dtype=np.int32)


def whole(seen: Visible, size: tuple[int, int]) -> IntArray:
    """Triangles (H, W) that are seen, −1 for none."""
    found = np.full((size[1], size[0]), -1)
    row, column = np.divmod(seen.pixel, max(seen.window.width, 1))
    found[row + seen.window.y, column + seen.window.x] = seen.triangle
    return found


def world_rays(where: Pose, curve: Curve, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Viewpoints and unit directions (N, 3) of pixels in the world."""
    rays = backward(where, curve, x, y)
    eye = where.to_world(rays.viewer.T)
    along = where.to_world(rays.mirror.T) - eye
    return eye, along / np.sqrt(dot(along, along))[:, None]


def brute_force(
    mesh: Mesh, eye: FloatArray, along: FloatArray, culled: bool = False
) -> tuple[IntArray, FloatArray]:
    """First triangles (N,) along rays, −1 for none, and how far away: Möller and Trumbore, all with all."""
    a, b, c = (mesh.vertices[:, corner].T for corner in mesh.triangles)
    found, far = np.full(len(eye), -1), np.full(len(eye), np.inf)
    for k in range(len(eye)):
        p = cross(np.broadcast_to(along[k], c.shape), c - a)
        det = dot(b - a, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = dot(eye[k] - a, p) / det
            q = cross(eye[k] - a, b - a)
            v, t = dot(q, along[k][None]) / det, dot(c - a, q) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & ((det > 0) if culled else (det != 0))
        t = np.where(hit, t, np.inf)
        if hit.any():
            found[k], far[k] = int(t.argmin()), t.min()
    return found, far


__all__ = ["RING", "TRACKED", "ball", "brute_force", "cube", "mesh_of", "pose", "rig", "whole", "world_rays"]
