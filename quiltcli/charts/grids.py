"""Shapes that are known at a grid of places: maps, height fields and meshes drawn over their texture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from quiltcli.charts.shapes import Shape, Smooth, stacked
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.mesh import read_mesh
from quiltcli.formats.mesh.polygons import plane_coordinates, triangulate
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import BoolArray, FloatArray, IntArray, cross, dot, normalized
from quiltcli.job.lengths import UNITS

Metres = Callable[[Any], float]


@dataclass(frozen=True, eq=False)
class Grid:
    """Values at the centres of a picture's pixels, and cubic curves between (Catmull and Rom).

    Attributes:
        values: (3, H, W), finite.
        known: (H, W) where they are really known; elsewhere they only keep curves in shape.
    """

    values: FloatArray
    known: BoolArray

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """Values (3, ...) at places of the picture; beyond its outermost centres they go on straight."""
        _, height, width = self.values.shape
        shape = np.broadcast_shapes(np.shape(s), np.shape(t))
        across = _weights(np.asarray(s) * width - 0.5, width)
        down = _weights(np.asarray(t) * height - 0.5, height)
        result = np.zeros((3, *shape))
        for column, wx in zip(*across, strict=True):
            for row, wy in zip(*down, strict=True):
                weight = wx * wy
                if not np.any(weight):
                    continue
                place = np.broadcast_to(row * np.int64(width) + column, shape)
                for k in range(3):
                    result[k] += weight * self.values[k].reshape(-1).take(place)
        return result

    def steps(self) -> tuple[float, float]:
        """Half a pixel, in s and in t: differences over less tell rounding, not slopes."""
        _, height, width = self.values.shape
        return 0.5 / width, 0.5 / height


def _weights(place: FloatArray, count: int) -> tuple[list[IntArray], list[FloatArray]]:
    """Four neighbours of places counted from the first centre, and how much each counts."""
    if count == 1:
        zero = np.zeros(np.shape(place), dtype=np.int64)
        return [zero], [np.ones(np.shape(place))]
    inner = np.clip(np.floor(place), 0, count - 2).astype(np.int64)
    f = place - inner
    curve = [
        ((-0.5 * f + 1.0) * f - 0.5) * f,
        (1.5 * f - 2.5) * f * f + 1.0,
        ((-1.5 * f + 2.0) * f + 0.5) * f,
        (0.5 * f - 0.5) * f * f,
    ]
    # At the borders, and beyond them, straight lines.
    straight = (inner < 1) | (inner > count - 3) | (f < 0) | (f > 1)
    line = [np.zeros_like(f), 1.0 - f, f, np.zeros_like(f)]
    weights = [np.where(straight, line[k], curve[k]) for k in range(4)]
    return [np.clip(inner + k, 0, count - 1) for k in (-1, 0, 1, 2)], weights


def grid_of(values: FloatArray) -> Grid:
    """A grid of values (3, H, W), NaN where there are none."""
    known: BoolArray = np.asarray(np.isfinite(values).all(axis=0))
    if known.all() or not known.any():
        return Grid(np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0), known)
    near = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    return Grid(np.ascontiguousarray(values[:, near[0], near[1]]), known)


def grid_shape(grid: Grid) -> Shape:
    """The shape of a grid."""
    return Smooth(grid.at, grid.steps(), grid.known)


def map_shape(spec: Any, metres: Metres) -> Shape:
    """A map of points, in metres; NaN or an alpha of 0 is no point."""
    picture = read_numbers(spec.file, 3, exact=True)
    values = picture.values[:3] * UNITS[spec.units]
    if picture.alpha is not None:
        values[:, ~(picture.alpha > 0)] = np.nan
    return grid_shape(map_grid(spec, values))


def map_grid(spec: Any, values: FloatArray) -> Grid:
    """The grid of a map whose channels are (3, H, W)."""
    found = grid_of(np.asarray(values[:3], dtype=np.float64))
    if not found.known.any():
        raise DisplayError(Problem("has no pixel with a point (all are NaN)", file=str(spec.file)))
    return found


def height_shape(spec: Any, metres: Metres) -> Shape:
    """Heights over a rectangle; the corner pixels' centres are its corners."""
    picture = read_numbers(spec.file, 1)
    values = picture.values[0] * (spec.scale * metres(1.0))
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0].tolist()
        words = f"pixel ({column}, {row}) is {values[row, column]:g} (expected heights everywhere)"
        raise DisplayError(Problem(words, file=str(spec.file)))
    width, depth = (metres(side) for side in spec.size)
    grid = grid_of(np.stack([values] * 3))
    rows, columns = values.shape

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        # A height field ends level; s and t from 0 to 1 are its outermost centres.
        u = np.clip((np.asarray(s) * (columns - 1) + 0.5) / columns, 0.5 / columns, 1 - 0.5 / columns)
        v = np.clip((np.asarray(t) * (rows - 1) + 0.5) / rows, 0.5 / rows, 1 - 0.5 / rows)
        return stacked(width * (s - 0.5), grid.at(u, v)[1], depth * (t - 0.5))

    return Smooth(point, (min(1e-3, 0.25 / columns), min(1e-3, 0.25 / rows)))


def mesh_shape(spec: Any, metres: Metres) -> Shape:
    """A mesh drawn over its texture: a point for each pixel.

    Raises:
        DisplayError: it has no texture coordinates, or they fold.
    """
    mesh = read_mesh(spec.file)
    if mesh.uv is None or not np.isfinite(mesh.uv).all():
        words = "has faces without texture coordinates (expected vt for every corner)"
        raise DisplayError(Problem(words, file=str(spec.file)))
    points = mesh.vertices[mesh.corners] * metres(1.0)
    flat = plane_coordinates(points, mesh.corner_start)
    corners, face = triangulate(flat, mesh.corner_start)
    u, v = mesh.uv[:, 0], 1.0 - mesh.uv[:, 1]
    width, height = spec.pixels
    place = np.stack((u * width, v * height), axis=1)[corners]
    p = points[corners]
    normals = _corner_normals(mesh, points, corners, face) if spec.smooth else None
    values, cover = np.full((3, height, width), np.nan), np.zeros((height, width), dtype=np.int32)
    for k, (pixel, weights) in enumerate(drawn_pixels(place, width, height)):
        flat_point = weights @ p[k]
        if normals is not None:
            flat_point = phong_point(weights, p[k], normals[k], flat_point)
        values.reshape(3, -1)[:, pixel] = flat_point.T
        cover.reshape(-1)[pixel] += 1
    _unfolded(cover, mesh.path)
    return grid_shape(map_grid(spec, values))


def _unfolded(cover: IntArray | Any, path: str) -> None:
    """Refuse textures that are used twice."""
    if cover.max(initial=0) > 1:
        row, column = np.argwhere(cover > 1)[0].tolist()
        words = (
            f"its texture is used twice at pixel ({column}, {row}) (expected coordinates that do not fold)"
        )
        raise DisplayError(Problem(words, file=path))


def drawn_pixels(place: FloatArray, width: int, height: int) -> Any:
    """Of triangles (n, 3, 2) in pixels the pixels whose centres they hold, and barycentric weights.

    A centre on an edge belongs to the triangle on whose left or upper side it lies: to one of two.
    """
    for a, b, c in place:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        low = np.maximum(np.ceil(np.min((a, b, c), axis=0) - 0.5), 0).astype(int)
        high = np.minimum(np.floor(np.max((a, b, c), axis=0) - 0.5), (width - 1, height - 1)).astype(int)
        if area == 0 or (high < low).any():
            yield np.zeros(0, dtype=np.int64), np.zeros((0, 3))
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1) + 0.5, np.arange(low[1], high[1] + 1) + 0.5)
        inside, weights = np.ones(x.shape, dtype=np.bool_), []
        for p, q in ((b, c), (c, a), (a, b)):
            # Both triangles of an edge work it out from its same end.
            first, last = (p, q) if tuple(p) <= tuple(q) else (q, p)
            run = last - first
            value = run[0] * (y - first[1]) - run[1] * (x - first[0])
            turn = (1.0 if tuple(p) <= tuple(q) else -1.0) * np.sign(area)
            value = value * turn
            upper = (-run[1] * turn > 0) or (run[1] == 0 and run[0] * turn > 0)
            inside &= (value >= 0) if upper else (value > 0)
            weights.append(value / abs(area))
        rows, columns = np.nonzero(inside)
        pixel = (rows + low[1]) * np.int64(width) + columns + low[0]
        yield pixel, np.stack([weight[rows, columns] for weight in weights], axis=1)


def _corner_normals(mesh: Any, points: FloatArray, corners: IntArray, face: IntArray) -> FloatArray:
    """Unit normals (n, 3, 3) at the corners of triangles: those of the file, or the mean of their faces."""
    if mesh.normals is not None and np.isfinite(mesh.normals).all():
        return normalized(mesh.normals)[corners]
    a, b, c = (points[corners[:, k]] for k in range(3))
    area = cross(b - a, c - a)
    _, vertex = np.unique(points, axis=0, return_inverse=True)
    total = np.zeros((int(vertex.max()) + 1, 3))
    for k in range(3):
        np.add.at(total, vertex.reshape(-1)[corners[:, k]], area)
    return normalized(total)[vertex.reshape(-1)[corners]]


def phong_point(
    weights: FloatArray, corners: FloatArray, normals: FloatArray, flat: FloatArray
) -> FloatArray:
    """Phong tessellation (Boubekeur and Alexa, 2008): points pulled to the planes at the corners, by ¾."""
    pulled = np.zeros_like(flat)
    for k in range(3):
        away = dot(flat - corners[k], np.broadcast_to(normals[k], flat.shape))
        pulled -= weights[:, k : k + 1] * away[:, None] * normals[k]
    return flat + 0.75 * pulled
