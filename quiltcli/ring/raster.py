"""Rasterizing in ray space: which triangle every pixel's ray meets first, exactly.

`propose` names pixels, edge functions decide, and of the triangles at a pixel the one whose s is largest is
nearest to the viewer. A pixel keeps one integer: the leading bits of s above the number of the triangle,
lower numbers winning among equals. It only ever grows, so nothing depends on the order of the work.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, segments
from quiltcli.geometry import offsets as starts_of
from quiltcli.ring.cone import viewer_through
from quiltcli.ring.curve import Curve
from quiltcli.ring.forms import Forms, distances, edge_values, forms_of, sides
from quiltcli.ring.plane import pixels_of, through_mirror, viewer_along
from quiltcli.ring.propose import Boxes, bending, propose
from quiltcli.ring.rays import RayTable, Window, window_rays
from quiltcli.ring.rig import Pose
from quiltcli.ring.through import Through, gathered
from quiltcli.visibility.setup.planes import LATTICE

_SIDES = (1, 2, 3, 4, 5, 6, 8, 10, 12)
"""Widths and heights of boxes that are tried together; larger ones are cut into tiles."""
_TILE = 6
_CHUNK = 24576
"""Pairs of pixel and triangle at a time: few enough for a core's cache, many for a call of numpy."""
_VERTICES = 16384


@dataclass(frozen=True)
class Mesh:
    """A scene's triangles as this room draws them.

    Attributes:
        vertices: (3, V) world metres.
        triangles: (3, T) corners.
        square: (T,) squared longest edges, m².
    """

    vertices: FloatArray
    triangles: Int32Array
    square: FloatArray

    @property
    def count(self) -> int:
        """Triangles."""
        return int(self.triangles.shape[1])


@dataclass(frozen=True)
class Limits:
    """Distances from the viewer between which something is seen, metres."""

    near: float
    far: float


@dataclass(frozen=True)
class Visible:
    """What is seen at the samples of a picture.

    Attributes:
        window: the pixels that were looked at.
        rays: theirs, row by row.
        pixel: (P,) those that see something, counted through the window.
        triangle: (P,) what they see.
        corners: (3, V) vertices in the frame from P′.
        candidates: pairs of pixel and triangle that were tried.
        fragments: pairs that hit.
        bend: pixels by which the longest edge may leave a straight line.
        through: the pixels that are seen through something, which are not among `pixel`; None for none.
    """

    window: Window
    rays: RayTable
    pixel: IntArray
    triangle: IntArray
    corners: FloatArray
    candidates: int
    fragments: int
    bend: float
    through: Through | None = None

    def some(self, rows: IntArray) -> Visible:
        """Only some of the pixels that see something."""
        return replace(self, pixel=self.pixel[rows], triangle=self.triangle[rows])


def mesh_of(vertices: FloatArray, triangles: Int32Array) -> Mesh:
    """The mesh of vertices (V, 3) and triangles (T, 3)."""
    points = np.ascontiguousarray(vertices.T)
    corners = np.ascontiguousarray(triangles.T)
    square = np.zeros(len(triangles))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        length = np.zeros(len(triangles))
        for axis in points:
            step = axis.take(corners[j]) - axis.take(corners[i])
            length += step * step
        np.maximum(square, length, out=square)
    return Mesh(points, corners, square)


def see(
    pose: Pose,
    curve: Curve,
    mesh: Mesh,
    size: tuple[int, int],
    backface_culling: bool = False,
    limits: Limits | None = None,
    beside: tuple[float, float] = (0.0, 0.0),
    *,
    straight: bool = False,
    soft: BoolArray | None = None,
) -> Visible:
    """What the pixels of a picture see.

    Args:
        pose: the mirror.
        curve: the viewers.
        mesh: the scene; all of it nearer to the axis than projector and viewers.
        size: width and height of the picture.
        backface_culling: leave out triangles that are seen from behind.
        limits: near and far, where anything may lie beyond them.
        beside: of the samples, pixels from the pixels' centres.
        straight: let edges be straight between the corners' pixels, which they are not.
        soft: (T,) triangles that light may pass; None for none: the nearest is seen, whatever it is.
    """
    corners = in_frame(pose, mesh.vertices)
    least, most = corners.min(axis=1), corners.max(axis=1)
    bend = bending(pose, curve, least, most)
    sample = (LATTICE[0] + beside[0], LATTICE[1] + beside[1])
    x, y = _pixels(pose, curve, corners)
    boxes = propose(x, y, mesh.triangles, mesh.square, bend, size, sample, backface_culling)
    window = boxes.window
    rays = window_rays(pose, curve, window, sample)
    bits = max(int(mesh.count).bit_length(), 1)
    keys = np.zeros(window.size, dtype=np.int64)
    candidates = fragments = 0
    some: list[tuple[IntArray, IntArray]] = []
    for triangle, pixel in _tries(boxes, window):
        forms = forms_of(*(corners.take(corner.take(triangle), axis=1) for corner in mesh.triangles))
        if straight:
            hit = _straight(mesh, x, y, triangle, *_samples(window, pixel, sample), bend.front)
        else:
            hit = _sides(forms, rays, pixel)
        found, s, which = _met(forms, rays, pixel, hit[0] if backface_culling else hit[0] | hit[1])
        which = triangle.take(which)
        candidates += pixel.size
        if limits is not None:
            kept = _within(rays, found, s, limits)
            found, s, which = found[kept], s[kept], which[kept]
        fragments += found.size
        key = s.view(np.int64) >> bits
        key <<= bits
        key |= mesh.count - 1 - which
        if soft is not None:
            passed = soft.take(which)
            some.append((found[passed], key[passed]))
            found, key = found[~passed], key[~passed]
        np.maximum.at(keys, found, key)
    through = gathered(keys, some, bits, mesh.count) if some else None
    seen = np.flatnonzero(keys)
    number = mesh.count - 1 - (keys[seen] & ((1 << bits) - 1))
    longest = float(np.sqrt(mesh.square.max(initial=0.0)))
    return Visible(
        window, rays, seen, number, corners, candidates, fragments, bend.most / 2 * longest**2 / 8, through
    )


def in_frame(pose: Pose, vertices: FloatArray) -> FloatArray:
    """Points (3, V) of the world in the frame from P′, by sums in a fixed order."""
    e, f, _ = pose.axes
    a = e[0] * vertices[0]
    a += e[2] * vertices[2]
    a -= pose.origin[0]
    b = f[0] * vertices[0]
    b += f[2] * vertices[2]
    b -= pose.origin[1]
    return np.stack((a, b, vertices[1] - pose.origin[2]))


def _pixels(pose: Pose, curve: Curve, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The pixels (V,) that show points (3, V): as `forward`, chunk by chunk."""
    x, y = np.empty(corners.shape[1]), np.empty(corners.shape[1])
    for start in range(0, corners.shape[1], _VERTICES):
        part = slice(start, start + _VERTICES)
        points = corners[:, part]
        viewer = (
            viewer_through(pose, curve, points)
            if pose.cone
            else viewer_along(pose, curve, points[1] / points[0])
        )
        x[part], y[part] = pixels_of(pose, through_mirror(pose, viewer, points))
    return x, y


def _tries(boxes: Boxes, window: Window) -> Iterator[tuple[IntArray, IntArray]]:
    """Triangles (N,) and pixels of the window (k, N) to try them at, N·k at most some thousands."""
    large = np.flatnonzero((boxes.width > _SIDES[-1]) | (boxes.height > _SIDES[-1]))
    small = np.ones(boxes.triangle.size, dtype=np.bool_)
    small[large] = False
    sizes = np.array(_SIDES)
    base = (boxes.y - window.y) * window.width + (boxes.x - window.x)
    wide = np.searchsorted(sizes, boxes.width)
    high = np.searchsorted(sizes, boxes.height)
    kind = np.where(small, wide * len(_SIDES) + high, -1).astype(np.int8)
    order = np.argsort(kind, kind="stable")
    bounds = np.searchsorted(kind[order], np.arange(len(_SIDES) ** 2 + 1))
    for number in range(len(_SIDES) ** 2):
        rows = order[bounds[number] : bounds[number + 1]]
        width, height = _SIDES[number // len(_SIDES)], _SIDES[number % len(_SIDES)]
        yield from _chunks(boxes.triangle[rows], base[rows], width, height, window)
    across, down = -(-boxes.width[large] // _TILE), -(-boxes.height[large] // _TILE)
    which, rank = segments(starts_of(across * down))
    column, row = rank % across[which] * _TILE, rank // across[which] * _TILE
    place = base[large][which] + row * window.width + column
    yield from _chunks(boxes.triangle[large][which], place, _TILE, _TILE, window)


def _chunks(
    triangle: IntArray, base: IntArray, width: int, height: int, window: Window
) -> Iterator[tuple[IntArray, IntArray]]:
    """Rectangles of one size, some at a time; what is past the window's end is its last pixel."""
    steps = (np.arange(height)[:, None] * window.width + np.arange(width)).reshape(-1, 1)
    count = max(_CHUNK // steps.size, 1)
    for start in range(0, triangle.size, count):
        pixel = base[start : start + count] + steps
        yield triangle[start : start + count], np.minimum(pixel, window.size - 1, out=pixel)


def _sides(forms: Forms, rays: RayTable, pixel: IntArray) -> tuple[BoolArray, BoolArray]:
    """Which pairs of pixels (k, N) and triangles (N,) meet, seen from in front and from behind."""
    b, m, kappa, omega = (part.take(pixel) for part in (rays.b, rays.m, rays.kappa, rays.omega))
    eta = None if rays.eta is None else rays.eta.take(pixel)
    front = back = np.ones(pixel.shape, dtype=np.bool_)
    for edge in forms.edges:
        before, behind = sides(edge, edge_values(edge, b, m, kappa, omega, eta))
        front, back = front & before, back & behind
    return front, back


def _straight(
    mesh: Mesh,
    x: FloatArray,
    y: FloatArray,
    triangle: IntArray,
    column: FloatArray,
    row: FloatArray,
    turn: float,
) -> tuple[BoolArray, BoolArray]:
    """As `_sides`, of triangles that are straight between their corners' pixels (V,)."""
    corners = [(x.take(corner.take(triangle)), y.take(corner.take(triangle))) for corner in mesh.triangles]
    front = back = np.ones(column.shape, dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        value = turn * ((x1 - x0) * (row - y0) - (y1 - y0) * (column - x0))
        front, back = front & (value > 0), back & (value < 0)
    return front, back


def _samples(window: Window, pixel: IntArray, sample: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Where the samples of a window's pixels lie in the picture."""
    row, column = np.divmod(pixel, window.width)
    return column + (window.x + 0.5 + sample[0]), row + (window.y + 0.5 + sample[1])


def _met(
    forms: Forms, rays: RayTable, pixel: IntArray, hit: BoolArray
) -> tuple[IntArray, FloatArray, IntArray]:
    """Pixels, s and columns of `pixel` (F,) of the pairs (k, N) that meet."""
    place = np.flatnonzero(hit)
    which = place % hit.shape[1]
    found = pixel.reshape(-1).take(place)
    s = distances(
        forms.plane.take(which, axis=1),
        rays.b.take(found),
        rays.m.take(found),
        rays.kappa.take(found),
        None if rays.eta is None else rays.eta.take(found),
    )
    sound = np.isfinite(s) & (s > 0)  # seen edge-on there is no plane to meet
    if not sound.all():
        found, s, which = found[sound], s[sound], which[sound]
    return found, s, which


def _within(rays: RayTable, pixel: IntArray, s: FloatArray, limits: Limits) -> IntArray:
    """Which points (F,) lie between near and far."""
    distance = depth(rays, pixel, s)
    return np.flatnonzero((distance >= limits.near) & (distance <= limits.far))


def depth(rays: RayTable, pixel: IntArray, s: FloatArray) -> FloatArray:
    """Distances (F,) from the viewpoints of pixels to points on their rays, metres."""
    b, m = rays.b.take(pixel), rays.m.take(pixel)
    return np.asarray((rays.end.take(pixel) - s) * np.sqrt(1 + b * b + m * m))
