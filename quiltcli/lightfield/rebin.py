"""The light along rays between the pictures of a light field.

A ray from a viewer towards the mirror crosses the ring of cameras between four of them, two of the row
below and two of the row above. Each sees a point of the ray; where the light comes from that point, all see
the same, and so the point should be near the surface. Jones et al., *Rendering for an Interactive 360° Light
Field Display* (SIGGRAPH 2007), section 6; light field rendering is Levoy's and Hanrahan's (SIGGRAPH 1996).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray
from quiltcli.lightfield.cameras import Lens
from quiltcli.lightfield.field import Field

_ROUNDS = 6


@dataclass(frozen=True)
class Rays:
    """Rays that a display's pixels show at one position of the mirror.

    Attributes:
        viewer: (P, 3) where they are seen from, world metres.
        mirror: (P, 3) where they meet the mirror.
        served: (3,) the viewer that the mirror's middle serves.
    """

    viewer: FloatArray
    mirror: FloatArray
    served: FloatArray


def rebin(field: Field, rays: Rays, frame: int = 1) -> Float32Array:
    """Linear light (P, 3) along rays; black where no camera sees them.

    Raises:
        JobError: a picture cannot be read.
    """
    crossing = _crossing(rays.viewer, rays.mirror, field.cameras.distance)
    azimuth = np.arctan2(crossing[:, 2], crossing[:, 0])
    total, weight = np.zeros((len(azimuth), 3)), np.zeros(len(azimuth))
    for row, view, share in _corners(field, rays, crossing, azimuth):
        places = _focused(field, rays, row, view, frame)
        colour, seen = _looked_up(field, places, row, view, frame)
        share = np.where(seen, share, 0)
        total += share[:, None] * colour
        weight += share
    return np.divide(total, weight[:, None], out=np.zeros_like(total), where=weight[:, None] > 1e-9).astype(
        np.float32
    )


def _crossing(viewer: FloatArray, mirror: FloatArray, distance: float) -> FloatArray:
    """Where lines (P) from the mirror towards the viewer cross the cylinder of the cameras, (P, 3)."""
    way = viewer - mirror
    a = way[:, 0] ** 2 + way[:, 2] ** 2
    b = mirror[:, 0] * way[:, 0] + mirror[:, 2] * way[:, 2]
    c = mirror[:, 0] ** 2 + mirror[:, 2] ** 2 - distance**2
    t = (-b + np.sqrt(np.maximum(b * b - a * c, 0))) / a
    return mirror + t[:, None] * way


def _corners(
    field: Field, rays: Rays, crossing: FloatArray, azimuth: FloatArray
) -> Iterator[tuple[IntArray, IntArray, FloatArray]]:
    """Row, camera of the row and share of the cameras around every ray."""
    for row, vertical in _rows(field, rays, crossing):
        around = np.empty((2, len(azimuth)), dtype=np.int64)
        across = np.empty(len(azimuth))
        for r in np.unique(row).tolist():
            there = row == r
            around[0, there], around[1, there], across[there] = field.cameras.rows[r].around(azimuth[there])
        if field.copied:
            yield row, np.where(across < 0.5, around[0], around[1]), vertical
            continue
        yield row, around[0], vertical * (1 - across)
        yield row, around[1], vertical * across


def _rows(field: Field, rays: Rays, crossing: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """Rows of cameras for every ray, and their shares."""
    cameras, slices = field.cameras, field.file.slices
    height = crossing[:, 1]
    if slices == "quads":
        # Along straight lines of the picture: by the mirror's height alone, from the viewer in the middle.
        middle = _middle(rays)
        height = _crossing(np.broadcast_to(rays.served, middle.shape), middle, cameras.distance)[:, 1]
    low, high, share = cameras.levels(height)
    if slices == "linear" and not field.copied:
        yield low, 1 - share
        if len(cameras.rows) > 1:
            yield high, share
    else:
        yield np.where(share < 0.5, low, high), np.ones(len(share))


def _middle(rays: Rays) -> FloatArray:
    """Places on the mirror (P, 3), moved level to the plane of the axis and the viewer that is served."""
    e = rays.served[[0, 2]] / np.hypot(rays.served[0], rays.served[2])
    along = rays.mirror[:, 0] * e[0] + rays.mirror[:, 2] * e[1]
    return np.stack((along * e[0], rays.mirror[:, 1], along * e[1]), axis=-1)


def _focused(field: Field, rays: Rays, row: IntArray, view: IntArray, frame: int) -> FloatArray:
    """The point (P, 3) of every ray at which cameras are to agree."""
    if field.file.focus == "mirror":
        return rays.mirror
    way = rays.mirror - rays.viewer
    flat = way[:, 0] ** 2 + way[:, 2] ** 2
    along = -(rays.viewer[:, 0] * way[:, 0] + rays.viewer[:, 2] * way[:, 2]) / flat
    places = rays.viewer + along[:, None] * way
    if field.file.focus == "axis":
        return places
    for _ in range(_ROUNDS):
        # The point of the ray as far ahead of the camera as what it sees there.
        depth, seen, offset, slope = _depths(field, places, rays.viewer, way, row, view, frame)
        known = seen & np.isfinite(depth) & (slope > 0)
        along = np.where(known, (depth - offset) / np.where(known, slope, 1), along)
        places = rays.viewer + along[:, None] * way
    return places


def _depths(
    field: Field,
    places: FloatArray,
    start: FloatArray,
    way: FloatArray,
    row: IntArray,
    view: IntArray,
    frame: int,
) -> tuple[FloatArray, BoolArray, FloatArray, FloatArray]:
    """Depth that cameras see at places, whether they do, and their depths of a ray's start and of its way."""
    depth, offset, slope = np.full((3, len(places)), np.nan)
    seen = np.zeros(len(places), dtype=np.bool_)
    for r, v, chosen in _by_camera(row, view):
        camera = field.cameras.rows[r]
        ahead = camera.rotation[v, 2]
        offset[chosen], slope[chosen] = (start[chosen] - camera.position[v]) @ ahead, way[chosen] @ ahead
        x, y, ahead_of = _pixels(field.cameras.lens, camera.position[v], camera.rotation[v], places[chosen])
        path = field.depth(r, int(camera.view[v]), frame)
        # The nearest pixel: between a thing and what is behind it nothing is.
        values = field.depths[path][..., 0]
        inside = ahead_of & (x >= 0) & (y >= 0) & (x < values.shape[1]) & (y < values.shape[0])
        column, line = (np.where(inside, q, 0).astype(np.int64) for q in (x, y))
        depth[chosen], seen[chosen] = values[line, column], inside
    return depth, seen, offset, slope


def _looked_up(
    field: Field, places: FloatArray, row: IntArray, view: IntArray, frame: int
) -> tuple[FloatArray, BoolArray]:
    """Linear light (P, 3) that cameras see at places, and whether they see them."""
    colour, seen = np.zeros((len(places), 3)), np.zeros(len(places), dtype=np.bool_)
    for r, v, chosen in _by_camera(row, view):
        camera = field.cameras.rows[r]
        x, y, ahead = _pixels(field.cameras.lens, camera.position[v], camera.rotation[v], places[chosen])
        values = field.pictures[field.picture(r, int(camera.view[v]), frame)]
        look_up = nearest if field.copied else bilinear
        colour[chosen], seen[chosen] = look_up(values, x, y, field.curve)
        seen[chosen] &= ahead
    return colour, seen


def _by_camera(row: IntArray, view: IntArray) -> Iterator[tuple[int, int, IntArray]]:
    """Rays that ask the same camera: its row, its place in it, and the rays' indices."""
    most = int(view.max(initial=0)) + 1
    code = row * most + view
    order = np.argsort(code, kind="stable")
    found = code[order]
    starts = np.flatnonzero(np.concatenate(([True], found[1:] != found[:-1]))) if found.size else found
    for chosen in np.split(order, starts[1:]) if found.size else ():
        r, v = divmod(int(code[chosen[0]]), most)
        yield r, v, chosen


def _pixels(
    lens: Lens, position: FloatArray, rotation: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Pixels (n) across and down at which a camera sees places (n, 3), and whether they are ahead of it."""
    x, y, z = (places[:, k] - position[k] for k in range(3))
    # Written out: a matrix product sums in another order on another machine.
    right, down, ahead = (row[0] * x + row[1] * y + row[2] * z for row in rotation.tolist())
    good = ahead > 0
    scale = 1 / np.where(good, ahead, 1)
    across = lens.centre[0] + lens.focal[0] * right * scale
    below = lens.centre[1] + lens.focal[1] * down * scale
    return across, below, good


def bilinear(
    values: NDArray[Any], x: FloatArray, y: FloatArray, curve: Float32Array
) -> tuple[FloatArray, BoolArray]:
    """Linear light (n, 3) between the pixels of a picture, and whether it is inside it.

    Args:
        values: (H, W, 3) bytes, or linear floats.
        x: (n,) pixels from the left; the first one's centre is at 0.5.
        y: (n,) from the top.
        curve: (256,) linear light of bytes; they are decoded before they are blended.
    """
    height, width = values.shape[:2]
    inside = (x >= 0) & (y >= 0) & (x <= width) & (y <= height)
    u, v = np.where(inside, x, 0) - 0.5, np.where(inside, y, 0) - 0.5
    column, line = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    total, pixels = np.zeros((len(x), 3)), values.reshape(-1, values.shape[2])
    u -= column
    v -= line
    rows = [np.clip(line + down, 0, height - 1) * width for down in (0, 1)]
    columns = [np.clip(column + right, 0, width - 1) for right in (0, 1)]
    for row, near in zip(rows, (1 - v, v), strict=True):
        for place, beside in zip(columns, (1 - u, u), strict=True):
            picked = pixels.take(row + place, axis=0)
            total += (near * beside)[:, None] * (curve.take(picked) if values.dtype == np.uint8 else picked)
    return total, inside


def nearest(
    values: NDArray[Any], x: FloatArray, y: FloatArray, curve: Float32Array
) -> tuple[FloatArray, BoolArray]:
    """As `bilinear`, of the pixel that places lie in."""
    height, width = values.shape[:2]
    inside = (x >= 0) & (y >= 0) & (x <= width) & (y <= height)
    column, line = (
        np.minimum(np.where(inside, place, 0).astype(np.int64), size - 1)
        for place, size in ((x, width), (y, height))
    )
    picked = values[line, column]
    found = curve.take(picked) if values.dtype == np.uint8 else picked
    return np.broadcast_to(found, (len(x), 3)).astype(np.float64), inside
