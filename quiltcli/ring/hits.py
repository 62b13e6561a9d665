"""What pixels with viewpoints of their own see, as shading takes it.

Shading knows one eye. Here it is put at the world's origin and every position given from there, so that
lights stand where they do; rays are each pixel's own, so that whatever depends on the viewer is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.ring.forms import edge_values, forms_of
from quiltcli.ring.raster import Mesh, Visible, depth
from quiltcli.ring.rig import Pose
from quiltcli.scene import Scene
from quiltcli.visibility.resolve.footprints import PointEdges
from quiltcli.visibility.resolve.hits import Hits, single_places
from quiltcli.visibility.resolve.vectors import PointVectors

EYE = np.zeros(3)


@dataclass(frozen=True)
class Cell:
    """The part of a pixel that a sample stands for, over which textures are filtered.

    Attributes:
        middle: from the sample, pixels.
        size: across and down, pixels.
    """

    middle: tuple[float, float] = (0.0, 0.0)
    size: tuple[float, float] = (1.0, 1.0)


WHOLE = Cell()
"""All of the pixel, whose centre is looked at."""


def ring_hits(
    pose: Pose,
    mesh: Mesh,
    scene: Scene,
    seen: Visible,
    part: slice,
    address: IntArray,
    cell: Cell = WHOLE,
) -> Hits:
    """Hits of some of the pixels that see something.

    Args:
        pose: the mirror.
        mesh: the scene's triangles.
        scene: the scene.
        seen: what the pixels see.
        part: which of them.
        address: (P,) where these lie in the picture.
        cell: what of its pixel each of them stands for.
    """
    pixel, triangle = seen.pixel[part], seen.triangle[part]
    weights, s = met(mesh, seen, pixel, triangle)
    frame = seen.rays.points(pixel, s)
    world = pose.axes.T @ (frame + pose.origin[:, None])
    b, m = seen.rays.b[pixel], seen.rays.m[pixel]
    away = np.stack((-np.ones(pixel.size), -b, -m))
    away /= np.sqrt(1 + b * b + m * m)
    ray = np.stack([axis[0] * away[0] + axis[1] * away[1] + axis[2] * away[2] for axis in pose.axes.T])
    rows = scene.corner_normals.take(triangle, axis=0).T
    towards = np.sign(-(rows[9:12] * ray).sum(axis=0))
    normal = (rows[0:3] + weights[0] * rows[3:6] + weights[1] * rows[6:9]) * towards
    return Hits(
        places=single_places(address),
        chosen=None,
        facet=np.zeros(pixel.size, dtype=np.int32),
        triangle=triangle.astype(np.int32),
        ray=PointVectors(ray.astype(np.float32)[:, :, None]),
        depth=depth(seen.rays, pixel, s)[:, None],
        normal=PointVectors(normal.astype(np.float32)[:, :, None]),
        weights=weights.astype(np.float32)[:, :, None],
        position=world[:, :, None],
        inside=pixel.size,
        edges=None if scene.textures is None else _edges(mesh, seen, pixel, triangle, weights, cell),
    )


def _edges(
    mesh: Mesh, seen: Visible, pixel: IntArray, triangle: IntArray, weights: FloatArray, cell: Cell
) -> PointEdges:
    """What textures are filtered by: how weights change to the neighbouring pixels' rays.

    Every pixel has a viewpoint of its own, so no plane over the picture says it; the ray of the neighbour,
    met with the same triangle, does.
    """
    row, column = np.divmod(pixel, seen.window.width)
    slopes = np.zeros((2, 2, pixel.size))
    for axis, (place, length, step) in enumerate(
        ((column, seen.window.width, 1), (row, seen.window.height, seen.window.width))
    ):
        if length > 1:
            way = np.where(place < length - 1, 1, -1)
            with np.errstate(divide="ignore", invalid="ignore"):
                beside, _ = met(mesh, seen, pixel + way * step, triangle)
            # Beyond the horizon there is nothing to filter by.
            slopes[:, axis] = np.nan_to_num((beside - weights) * way, posinf=0.0, neginf=0.0)
    if cell != WHOLE:
        weights = weights + slopes[:, 0] * cell.middle[0] + slopes[:, 1] * cell.middle[1]
        slopes *= np.array(cell.size)[:, None]
    return PointEdges(triangle.astype(np.int32), weights, slopes)


def met(mesh: Mesh, seen: Visible, pixel: IntArray, triangle: IntArray) -> tuple[FloatArray, FloatArray]:
    """Weights (2, P) of the second and third corner where rays meet triangles, and s (P,) there."""
    rays = seen.rays
    corners = [seen.corners.take(corner.take(triangle), axis=1) for corner in mesh.triangles]
    edges = forms_of(*corners).edges
    values = [
        edge_values(
            edge,
            rays.b[pixel],
            rays.m[pixel],
            rays.kappa[pixel],
            rays.omega[pixel],
            None if rays.eta is None else rays.eta[pixel],
        )
        for edge in edges
    ]
    total = values[0] + values[1] + values[2]
    weights = np.stack((values[1] / total, values[2] / total))
    s = corners[0][0] + weights[0] * (corners[1][0] - corners[0][0])
    s += weights[1] * (corners[2][0] - corners[0][0])
    return weights, s
