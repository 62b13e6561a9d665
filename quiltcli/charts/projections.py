"""Projections as shapes: a direction from the eye for each place of the picture, x right, y up, −z ahead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from quiltcli.charts.grids import Grid, grid_of, grid_shape
from quiltcli.charts.shapes import Shape, Smooth, over, stacked, turned
from quiltcli.charts.warps import mesh_directions, offset_directions, st_directions
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import FloatArray, rotation_deg
from quiltcli.job import projections as models

FACES = ("right", "left", "up", "down", "front", "back")
_FACE_AXES = {
    # Ahead, right and up of each face, as one sees it from the middle.
    "right": ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
    "left": ((-1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "up": ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    "down": ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    "front": ((0, 0, -1), (1, 0, 0), (0, 1, 0)),
    "back": ((0, 0, 1), (-1, 0, 0), (0, 1, 0)),
}
_CROSS = {"up": (1, 0), "left": (0, 1), "front": (1, 1), "right": (2, 1), "back": (3, 1), "down": (1, 2)}


def cylinder(spec: models.CylinderProjection) -> Shape:
    """A = hfov (s − ½), and heights in pixels that are square at the horizon."""
    width, height = spec.pixels
    wide = np.radians(spec.hfov_deg)
    half = wide * height / (2 * width)

    def ring(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        a = wide * (s - 0.5)
        return np.sin(a), -np.cos(a)

    def strips(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat strips whose mean distance from the eye is 1."""
        assert spec.pieces is not None
        place = np.asarray(s) * spec.pieces
        piece = np.clip(np.floor(place), 0, spec.pieces - 1)
        (x0, z0), (x1, z1) = ring(piece / spec.pieces), ring((piece + 1) / spec.pieces)
        size = 2.0 / (1.0 + np.cos(wide / spec.pieces / 2))
        share = place - piece
        return size * (x0 + share * (x1 - x0)), size * (z0 + share * (z1 - z0))

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        x, z = ring(s) if spec.pieces is None else strips(s)
        return stacked(x, spec.center + half * (1 - 2 * t), z)

    return Smooth(point)


def equirect(spec: models.EquirectProjection) -> Shape:
    """(cos b sin a, sin b, −cos b cos a)."""
    a_of = over(*spec.longitude_deg)
    b_of = over(spec.latitude_deg[1], spec.latitude_deg[0])

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        a, b = a_of(s), b_of(t)
        ring = np.cos(b)
        return stacked(ring * np.sin(a), np.sin(b), -ring * np.cos(a))

    return Smooth(point)


def fisheye(spec: models.FisheyeProjection) -> Shape:
    """A circle about −z."""
    angle = lens(spec.mapping, spec.fov_deg, spec.polynomial)

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        u, v, cos, sin = _disc(spec.pixels, s, t, angle)
        return stacked(sin * u, sin * v, -cos)

    return Smooth(point)


def dome_master(spec: models.DomeMasterProjection) -> Shape:
    """A circle about the zenith; what is ahead lies at the bottom."""
    angle = lens("equidistant", spec.fov_deg)
    lean = rotation_deg((-spec.tilt_deg, 0.0, 0.0))

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        u, v, cos, sin = _disc(spec.pixels, s, t, angle)
        return turned(lean, stacked(sin * u, cos, sin * v))

    return Smooth(point)


def mirror_ball(spec: models.MirrorBallProjection) -> Shape:
    """Directions that a ball reflects to an eye far away, turned over so that its middle is ahead."""

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        u, v = _square(spec.pixels, s, t)
        depth = np.sqrt(np.where(u * u + v * v <= 1.0, 1.0 - (u * u + v * v), np.nan))
        return stacked(2 * depth * u, 2 * depth * v, 1.0 - 2 * depth * depth)

    return Smooth(point)


def cubemap(spec: models.CubemapProjection) -> Shape:
    """Six faces in one picture."""
    across, down = (4, 3) if spec.layout == "cross" else (6, 1)
    cells = _CROSS if spec.layout == "cross" else {name: (k, 0) for k, name in enumerate(FACES)}

    def point(s: FloatArray, t: FloatArray) -> FloatArray:
        shape = np.broadcast_shapes(np.shape(s), np.shape(t))
        x, y = np.broadcast_to(np.asarray(s) * across, shape), np.broadcast_to(np.asarray(t) * down, shape)
        column = np.clip(np.floor(x), 0, across - 1)
        row = np.clip(np.floor(y), 0, down - 1)
        result = np.full((3, *shape), np.nan)
        for name, (i, j) in cells.items():
            here = (column == i) & (row == j)
            if here.any():
                result[:, here] = face_points(name, x[here] - i, y[here] - j, spec.equiangular)
        return result

    return Smooth(point)


def cube_face(spec: models.CubemapProjection, name: str) -> Shape:
    """One face in a picture of its own."""
    return Smooth(lambda s, t: face_points(name, s, t, spec.equiangular))


def face_points(name: str, s: FloatArray, t: FloatArray, equiangular: bool) -> FloatArray:
    """Directions (3, ...) through the places of a cube's face."""
    u, v = 2 * np.asarray(s) - 1, 1 - 2 * np.asarray(t)
    if equiangular:
        u, v = np.tan(u * (np.pi / 4)), np.tan(v * (np.pi / 4))
    ahead, right, up = _FACE_AXES[name]
    return stacked(*(ahead[k] + right[k] * u + up[k] * v for k in range(3)))


def lens(
    mapping: str, fov_deg: float, polynomial: tuple[float, ...] | None = None
) -> Callable[[FloatArray], FloatArray]:
    """The angle from the axis, radians, by the distance from the middle, 1 being the circle."""
    fov = np.radians(fov_deg)
    if mapping == "equisolid":
        return lambda r: 2 * np.arcsin(r * np.sin(fov / 4))
    if mapping == "stereographic":
        return lambda r: 2 * np.arctan(r * np.tan(fov / 4))
    if mapping == "orthographic":
        return lambda r: np.arcsin(np.minimum(r * np.sin(fov / 2), 1.0))
    if mapping == "polynomial":
        assert polynomial is not None
        return lambda r: _solved(polynomial, r, fov / 2)
    return lambda r: np.asarray(r * (fov / 2))


def _solved(odd: tuple[float, ...], r: FloatArray, most: float) -> FloatArray:
    """The angle θ of r = Σ kᵢ θⁱ over odd i, from 0 to `most`, by Newton's steps inside a bracket."""
    low, high = np.zeros(np.shape(r)), np.full(np.shape(r), most)
    theta = np.minimum(np.asarray(r) * most, most)
    for _ in range(60):
        value, slope = -np.asarray(r), np.zeros(np.shape(r))
        for k, factor in enumerate(odd):
            value = value + factor * theta ** (2 * k + 1)
            slope = slope + factor * (2 * k + 1) * theta ** (2 * k)
        low, high = np.where(value < 0, theta, low), np.where(value < 0, high, theta)
        step = theta - np.divide(value, slope, out=np.full(np.shape(r), np.inf), where=slope > 0)
        theta = np.where((step > low) & (step < high), step, (low + high) / 2)
    return theta


def _square(pixels: tuple[int, int], s: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Right and up from the middle, 1 being the circle that fits the picture."""
    width, height = pixels
    least = min(width, height)
    u, v = (2 * np.asarray(s) - 1) * (width / least), (1 - 2 * np.asarray(t)) * (height / least)
    shape = np.broadcast_shapes(u.shape, v.shape)
    return np.broadcast_to(u, shape), np.broadcast_to(v, shape)


def _disc(
    pixels: tuple[int, int], s: FloatArray, t: FloatArray, angle: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Unit direction in the picture (u, v), cosine and sine of the angle; NaN outside the circle."""
    u, v = _square(pixels, s, t)
    r = np.sqrt(u * u + v * v)
    safe = np.where(r > 0, r, 1.0)
    theta = angle(np.where(r <= 1.0, r, np.nan))
    return u / safe, v / safe, np.cos(theta), np.sin(theta)


def direction_map(spec: models.MapProjection) -> Shape:
    """A direction for each pixel."""
    picture = read_numbers(spec.file, 3, exact=True)
    values = picture.values[:3].copy()
    values[:, (values == 0).all(axis=0)] = np.nan
    return grid_shape(checked(grid_of(values), spec))


def checked(grid: Grid, spec: Any) -> Grid:
    """The grid, once it has the picture's size and something in it."""
    height, width = grid.known.shape
    if (width, height) != tuple(spec.pixels):
        words = (
            f"is {width} × {height} pixels (expected {spec.pixels[0]} × {spec.pixels[1]}, as `pixels` says)"
        )
        raise DisplayError(Problem(words, file=str(spec.file)))
    if not grid.known.any():
        raise DisplayError(Problem("has no pixel with a direction", file=str(spec.file)))
    return grid


def _of_file(read: Callable[[Any], FloatArray]) -> Callable[[Any], Shape]:
    return lambda spec: grid_shape(checked(grid_of(read(spec)), spec))


KINDS: dict[str, Callable[[Any], Shape]] = {
    "cylinder": cylinder,
    "equirect": equirect,
    "fisheye": fisheye,
    "dome_master": dome_master,
    "cubemap": cubemap,
    "mirror_ball": mirror_ball,
    "offset": _of_file(offset_directions),
    "st": _of_file(st_directions),
    "mesh": _of_file(lambda spec: mesh_directions(spec, lens(spec.of.mapping, spec.of.fov_deg))),
    "map": direction_map,
}
"""What makes the shape of a projection by its kind."""
