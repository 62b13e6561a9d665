"""Which way up a facet's raster lies, where it starts and how large it is.

The raster's axes follow an edge of the polygon. Of all edges the one whose bounding rectangle has
the least area is taken, and of its quarter turns the one whose upper side agrees best with `up`:
no facet is ever mirrored, and a world axis is only a wish, so floors and ceilings work as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import (
    BoolArray,
    FloatArray,
    Int32Array,
    IntArray,
    cross,
    dot,
    next_in_row,
    normalized,
    offsets,
    segments,
    shares,
)

MOST_PIXELS = 65536  # a side
LEVEL = math.sin(math.radians(1))
_TIE = 1e-6
# Pixels a facet may be wider than a whole number of them, for densities and coordinates of six digits.
_ROUNDED = 2e-3
_PAIRS_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Rasters:
    """Rasters of F facets, as in the display record."""

    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    size: Int32Array


def upward(corners: FloatArray, start: IntArray, front: FloatArray) -> FloatArray:
    """Unit directions (F, 3) in the facets' planes that count as up.

    World Y dropped onto the plane; for a facet that is level with the ground within 1°, the
    direction from its first edge into the polygon.

    Args:
        corners: (C, 3) world metres.
        start: (F+1,) offsets.
        front: (F, 3) unit normals on the side the winding faces.
    """
    world = np.array([0.0, 1.0, 0.0])
    raised = into_plane(np.broadcast_to(world, front.shape), front)
    first_edge = corners[start[:-1] + 1] - corners[start[:-1]]
    level = np.sqrt(dot(raised, raised)) < LEVEL
    result: FloatArray = normalized(np.where(level[:, None], cross(front, first_edge), raised))
    return result


def into_plane(directions: FloatArray, normal: FloatArray) -> FloatArray:
    """`directions` (F, 3) less their part along the unit `normal` (F, 3)."""
    result: FloatArray = directions - dot(directions, normal)[:, None] * normal
    return result


def axes(
    corners: FloatArray, start: IntArray, normal: FloatArray, up: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Unit right and down directions (F, 3) of the rasters, seen from the side `normal` points to.

    Ties are broken the same way everywhere: rectangles within 1e-6 of the least area count as
    equal, then directions within 1e-6 of the best agreement with `up`; then the first edge of the
    face wins, and of its turns the first of: polygon above the edge, then turned on by 90° each.

    Args:
        corners: (C, 3) world metres.
        start: (F+1,) offsets.
        normal: (F, 3) unit normals of the lit side.
        up: (F, 3) unit directions in the planes.
    """
    row, _ = segments(start)
    following = corners[next_in_row(start)]
    edge = normalized(into_plane(following - corners, normal[row]))
    side = cross(normal[row], edge)
    area = _rectangle_areas(corners, start, edge, side)
    least = np.minimum.reduceat(area, start[:-1])
    turns = np.stack((side, edge, -side, -edge), axis=1)
    agreement = dot(turns, up[row][:, None, :])
    agreement[area > least[row] * (1 + _TIE)] = -2
    best = np.maximum.reduceat(agreement.max(axis=1), start[:-1])
    good = (agreement >= best[row][:, None] - _TIE).reshape(-1)
    place = np.where(good, np.arange(good.size), good.size)
    chosen = np.minimum.reduceat(place, 4 * start[:-1])
    top = turns.reshape(-1, 3)[chosen]
    return cross(top, normal), -top


def _rectangle_areas(corners: FloatArray, start: IntArray, edge: FloatArray, side: FloatArray) -> FloatArray:
    """Area (C,) of each polygon's bounding rectangle along each of its edges."""
    row, _ = segments(start)
    count = np.diff(start)[row]
    area = np.empty(len(row))
    for part in shares(count, _PAIRS_AT_ONCE):
        own = offsets(count[part])
        which, rank = segments(own)
        facet = row[part][which]
        local = corners[start[facet] + rank] - corners[start[facet]]
        extent = np.ones(own.size - 1)
        for axis in (edge[part], side[part]):
            along = dot(local, axis[which])
            extent = extent * (np.maximum.reduceat(along, own[:-1]) - np.minimum.reduceat(along, own[:-1]))
        area[part] = extent
    return area


def turned(right: FloatArray, down: FloatArray, quarter_turns: IntArray) -> tuple[FloatArray, FloatArray]:
    """Turn axes (F, 3) clockwise, as the viewer sees them, by (F,) quarter turns.

    After one turn the raster's top row runs down the facet's right side: a panel hung portrait with
    its upper edge to the right.
    """
    k = (quarter_turns % 4)[:, None]
    new_right = np.select([k == 0, k == 1, k == 2], [right, down, -right], -down)
    new_down = np.select([k == 0, k == 1, k == 2], [down, -right, -down], right)
    return new_right, new_down


def rasters(
    corners: FloatArray,
    start: IntArray,
    right: FloatArray,
    down: FloatArray,
    pixels_per_metre: FloatArray,
    facet_pixels: Int32Array,
    *,
    a_pixel_at_least: bool = False,
) -> Rasters:
    """Rasters that bound the polygons, starting at their top-left.

    Square pixels have a pitch of exactly 1 / `pixels_per_metre`, and the last row and column may
    reach past the polygon. Where `facet_pixels` is positive the rectangle is divided into that many.

    Args:
        corners: (C, 3) world metres.
        start: (F+1,) offsets.
        right: (F, 3) unit directions.
        down: (F, 3) unit directions.
        pixels_per_metre: (F,) density where `facet_pixels` is 0.
        facet_pixels: (F, 2) width and height, or 0.
        a_pixel_at_least: whether the density is raised where a facet would be narrower than a pixel.

    Returns:
        Rasters; a size is clipped to 0 .. MOST_PIXELS + 1, 0 meaning less than one pixel.
    """
    row, _ = segments(start)
    anchor = corners[start[:-1]]
    local = corners - anchor[row]
    low, extent = [], []
    for axis in (right, down):
        along = dot(local, axis[row])
        low.append(np.minimum.reduceat(along, start[:-1]))
        extent.append(np.maximum.reduceat(along, start[:-1]) - low[-1])
    spans = np.stack(extent, axis=1)
    given: BoolArray = facet_pixels > 0
    if a_pixel_at_least:
        pixels_per_metre = np.maximum(pixels_per_metre, 1 / spans.min(axis=1))
    exact = spans * pixels_per_metre[:, None]
    # A hair over a whole number is rounding, not another pixel.
    counted = np.where(exact < 1 - _TIE, 0, np.clip(np.ceil(exact - _ROUNDED), 1, MOST_PIXELS + 1))
    size = np.where(given, facet_pixels, counted)
    pitch = np.where(given, spans / np.maximum(size, 1), 1 / pixels_per_metre[:, None])
    return Rasters(
        origin=anchor + low[0][:, None] * right + low[1][:, None] * down,
        du=pitch[:, :1] * right + 0.0,  # no −0, for people who read layouts
        dv=pitch[:, 1:] * down + 0.0,
        size=size.astype(np.int32),
    )
