"""A layout as a list of shapes and labels, for whatever draws them."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from quiltcli.display import Facets
from quiltcli.formats.drawing.shapes import Drawing, Label, Shape
from quiltcli.geometry import FloatArray
from quiltcli.layout.layout import Layout, quilt_polygons
from quiltcli.layout.picture.portrait import draw_display, facet_colors
from quiltcli.layout.spans import Spans, facet_spans

__all__ = ["FAINT", "INK", "PAGE", "PAGE_EDGE", "PAPER", "Drawing", "Label", "Shape", "draw_layout"]

PAPER, PAGE, PAGE_EDGE, INK, FAINT = "#14161b", "#23272f", "#4a515e", "#f2f4f8", "#9aa4b5"
_FACET_INK = "#10131a"
_WIDEST = 2048
_EDGE = "#0c0e12"
_MARGIN, _HEADER, _TITLE, _PORTRAIT = 28, 76, 34, 420


def draw_layout(layout: Layout, names: Sequence[str] = (), facets: Facets | None = None) -> Drawing:
    """Pages side by side with their facets, ids, names (by id, from 1) and fill figures.

    With the display's facets, a little drawing of the display stands to the right of the pages, and
    the facets are coloured by their place on it.
    """
    columns = _columns(layout)
    rows = math.ceil(len(layout.pages) / columns)
    widest, highest = (int(side) for side in layout.pages.max(axis=0))
    aside = _PORTRAIT + _MARGIN if facets is not None else 0
    across = _WIDEST - 1 - _MARGIN * (columns + 1) - aside
    down = _WIDEST - 1 - _HEADER - (_TITLE + _MARGIN) * rows
    scale = min(across / (columns * widest), down / (rows * highest))
    cell = np.array([widest * scale + _MARGIN, highest * scale + _TITLE + _MARGIN])
    width = max(math.ceil(columns * cell[0]) + _MARGIN, 640)
    colors = _plain_colors(layout) if facets is None else facet_colors(facets)
    spans = facet_spans(layout)
    items: list[Shape | Label] = list(_header(layout, spans))
    quilt = quilt_polygons(layout)
    for page in range(len(layout.pages)):
        corner = np.array([page % columns, page // columns]) * cell + (_MARGIN, _HEADER + _TITLE)
        items += _page(layout, page, corner, scale, spans)
        for row in np.flatnonzero(layout.page == page):
            polygon = quilt[layout.corner_start[row] : layout.corner_start[row + 1]]
            color = colors[int(layout.facet[row]) - 1]
            items += _facet(layout, int(row), corner + polygon * scale, color, names)
    height = math.ceil(_HEADER + rows * cell[1])
    if facets is not None:
        items += draw_display(
            facets, np.array([width, _HEADER + _TITLE]), np.array([_PORTRAIT, _PORTRAIT]), _EDGE
        )
        height = max(height, _HEADER + _TITLE + _PORTRAIT + _MARGIN)
    return Drawing(width + aside, height, tuple(items))


def _plain_colors(layout: Layout) -> list[str]:
    """Golden-ratio steps of hue, which keep facets that follow each other apart."""
    hues = [(facet * 0.6180339887) % 1 for facet in range(1, int(layout.facet.max(initial=0)) + 1)]
    return [_color(hue, 0.82, 0.5) for hue in hues]


def _columns(layout: Layout) -> int:
    """Pages in a row of the picture, so that the picture comes out nearly square."""
    widest, highest = layout.pages.max(axis=0)
    return max(1, min(len(layout.pages), round(math.sqrt(len(layout.pages) * highest / widest))))


def _header(layout: Layout, spans: Spans) -> Iterator[Label]:
    pixels = int((spans.stop - spans.start).sum())
    placed = int((layout.page >= 0).sum())
    share = 100 * pixels / int(layout.page_offset[-1])
    yield Label(_MARGIN, 30, 24, f"{Path(layout.display).name}   fill {share:.1f} %", INK, "start")
    counts = f"{_plural(placed, 'facet')} on {_plural(len(layout.pages), 'page')}"
    detail = f"{counts}, {pixels / 1e6:.2f} megapixels used, method {layout.method}, padding {layout.padding}"
    yield Label(_MARGIN, 58, 16, detail, FAINT, "start")


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")


def _page(
    layout: Layout, page: int, corner: FloatArray, scale: float, spans: Spans
) -> Iterator[Shape | Label]:
    width, height = layout.pages[page]
    here = layout.page[spans.row] == page
    share = 100 * int((spans.stop - spans.start)[here].sum()) / (int(width) * int(height))
    title = f"Page {page + 1}:  {width} x {height},  {share:.1f} %"
    yield Label(corner[0], corner[1] - 14, 16, title, INK, "start")
    box = corner + np.array([[0, 0], [width, 0], [width, height], [0, height]]) * scale
    yield Shape(box, PAGE, PAGE_EDGE, 1)


def _facet(
    layout: Layout, row: int, polygon: FloatArray, color: str, names: Sequence[str]
) -> Iterator[Shape | Label]:
    facet = int(layout.facet[row])
    yield Shape(polygon, color, _EDGE, 1)
    centre, radius = _roomiest(polygon)
    name = names[facet - 1] if facet <= len(names) else ""
    # Id and name lie one under the other, inside the circle and clear of the arrow.
    size = min((0.8 if name else 1.05) * radius / max(1.0, 0.45 * len(str(facet))), 64)
    if size < 5:
        return
    small = min(size * 0.5, 2.4 * radius / max(1, len(name))) if name else 0.0
    small = small if small >= 5 else 0.0
    yield Label(centre[0], centre[1] - 0.55 * small, size, str(facet), _FACET_INK, "middle")
    if small:
        yield Label(centre[0], centre[1] + 0.5 * size, small, name, _FACET_INK, "middle")
    up = -layout.quilt_from_facet[row, :, 1]
    up = up / np.linalg.norm(up)
    if radius > 14:  # room for an arrow
        across = np.array([-up[1], up[0]])
        reach, half = radius * 0.94, min(radius * 0.14, 30)
        tip = centre + up * reach
        base = tip - up * half * 1.3
        arrow = np.stack((tip, base + across * half, base - across * half))
        yield Shape(arrow, _FACET_INK, _FACET_INK, 0)


def _color(hue: float, value: float, saturation: float) -> str:
    red, green, blue = (round(255 * part) for part in colorsys.hsv_to_rgb(hue, saturation, value))
    return f"#{red:02x}{green:02x}{blue:02x}"


def _roomiest(polygon: FloatArray) -> tuple[FloatArray, float]:
    """Centre and radius of about the largest circle inside a polygon (n, 2), tried on a small grid."""
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    steps = np.stack(np.meshgrid(np.linspace(0, 1, 13), np.linspace(0, 1, 13)), axis=-1).reshape(-1, 2)
    points = np.concatenate((polygon.mean(axis=0)[None], low + steps * (high - low)))[:, None]
    a, b = polygon, np.roll(polygon, -1, axis=0)
    run, away = b - a, points - a
    length2 = np.maximum((run * run).sum(axis=1), 1e-12)
    t = np.clip((away * run).sum(axis=2) / length2, 0, 1)
    distance = np.sqrt(((away - t[..., None] * run) ** 2).sum(axis=2)).min(axis=1)
    x, y = points[:, :, 0], points[:, :, 1]
    rise = np.where(run[:, 1] == 0, 1.0, run[:, 1])
    passes = (a[:, 1] <= y) != (b[:, 1] <= y)
    inside = (passes & (x >= a[:, 0] + (y - a[:, 1]) / rise * run[:, 0])).sum(axis=1) % 2 == 1
    distance = np.where(inside, distance, 0)
    best = int(np.argmax(np.round(distance, 6)))
    return points[best, 0], float(distance[best])
