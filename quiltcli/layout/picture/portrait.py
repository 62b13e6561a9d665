"""A little drawing of the display, so that one sees which facet of a layout is where."""

from __future__ import annotations

import math

import numpy as np

from quiltcli.display import Facets
from quiltcli.formats.drawing.shapes import Shape
from quiltcli.geometry import BoolArray, FloatArray, cross, dot, normalized, segments

_DARK = 0.42  # how bright the side is that is not lit
_AZIMUTHS, _ELEVATION = 12, 24.0  # degrees from which the display may be looked at


def facet_colors(facets: Facets) -> list[str]:
    """A colour for every facet by its place on the display: red to the right, green up, blue to the front.

    Facets near each other look alike; which is brighter alternates, so that they can be told apart.
    """
    centre = _centres(facets)
    low, size = centre.min(axis=0), np.ptp(centre, axis=0)
    place = np.where(size > 1e-9, (centre - low) / np.where(size > 1e-9, size, 1), 0.5)
    bright = 1 - 0.16 * ((np.arange(facets.count) * 0.6180339887) % 1)
    return [_hex(color) for color in (0.38 + 0.62 * place) * bright[:, None]]


def _hex(color: FloatArray) -> str:
    red, green, blue = (round(255 * float(part)) for part in color)
    return f"#{red:02x}{green:02x}{blue:02x}"


def _dimmed(color: str) -> str:
    parts = (int(color[at : at + 2], 16) for at in (1, 3, 5))
    return "#" + "".join(f"{round(_DARK * part):02x}" for part in parts)


def draw_display(facets: Facets, corner: FloatArray, size: FloatArray, edge: str) -> list[Shape]:
    """The enabled facets, seen from where most of their lit side shows; sides that are not lit are dark.

    Args:
        facets: the display.
        corner: (2,) top-left of the box to draw in, picture pixels.
        size: (2,) its width and height.
        edge: colour of the outlines.
    """
    right, up, back = _best_view(facets)
    flat = np.stack((facets.corners @ right, -(facets.corners @ up)), axis=1)
    row, _ = segments(facets.corner_start)
    shown = flat[facets.enabled[row]]
    low, extent = shown.min(axis=0), np.ptp(shown, axis=0)
    scale = float((size / np.maximum(extent, 1e-12)).min())
    place = corner + (size - extent * scale) / 2 + (flat - low) * scale
    colors = facet_colors(facets)
    lit = facets.both_sides | (facets.normal @ back > 0)
    width = 1.0 if facets.count < 300 else 0.4
    shapes = []
    for facet in _far_to_near(facets, back):
        polygon = place[facets.corner_start[facet] : facets.corner_start[facet + 1]]
        color = colors[facet] if lit[facet] else _dimmed(colors[facet])
        shapes.append(Shape(polygon, color, edge, width))
    return shapes


def _far_to_near(facets: Facets, back: FloatArray) -> list[int]:
    """Enabled facets in the order to paint them, for an eye far out along `back`."""
    rows = np.flatnonzero(facets.enabled)
    order: list[int] = rows[np.argsort(np.round(_centres(facets)[rows] @ back, 9), kind="stable")].tolist()
    return order


def _centres(facets: Facets) -> FloatArray:
    total = np.add.reduceat(facets.corners, facets.corner_start[:-1], axis=0)
    result: FloatArray = total / np.diff(facets.corner_start)[:, None]
    return result


def _best_view(facets: Facets) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Right, up and back of the view that shows most lit area, the first of nearly equal ones."""
    area = _areas(facets, facets.enabled)
    views = [_view(30 + 360 * k / _AZIMUTHS) for k in range(_AZIMUTHS)]
    facing = [facets.normal @ back for _, _, back in views]
    towards = [np.abs(f) if facets.both_sides else np.maximum(f, 0) for f in facing]
    shown = np.array([float((f * area).sum()) for f in towards])
    return views[int(np.argmax(shown >= 0.98 * shown.max()))]


def _view(azimuth: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes of a view from this azimuth (degrees from +Z towards +X), a little from above."""
    a, e = math.radians(azimuth), math.radians(_ELEVATION)
    back = np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
    right = normalized(cross(np.array([0.0, 1.0, 0.0]), back))
    return right, cross(back, right), back


def _areas(facets: Facets, counted: BoolArray) -> FloatArray:
    row, _ = segments(facets.corner_start)
    local = facets.corners - facets.corners[facets.corner_start[:-1]][row]
    fans = cross(local, np.roll(local, -1, axis=0))
    total = np.add.reduceat(fans, facets.corner_start[:-1], axis=0)
    result: FloatArray = np.sqrt(dot(total, total)) / 2 * counted
    return result
