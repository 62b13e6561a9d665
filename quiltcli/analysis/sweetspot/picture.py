"""The picture of a sweet spot: a PNG to look at, or an SVG to zoom into."""

from __future__ import annotations

import base64
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.sweetspot.plan import Bitmap, Item, Lines, Plan, draw_plan
from quiltcli.analysis.sweetspot.study import SweetSpot
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.drawing.paint import FINER, paint_label, paint_shape, paper, reduced
from quiltcli.formats.drawing.svg import svg_document, svg_label, svg_points, svg_polygon
from quiltcli.formats.png import png_bytes, save_png
from quiltcli.formats.whole import write_text
from quiltcli.geometry import FloatArray
from quiltcli.layout.picture.drawing import PAPER, Label, Shape

_HALO = 3  # pixels of paper around letters


def check_picture(path: Path) -> None:
    """Whether a picture can have this name (OutputError)."""
    if path.suffix.lower() not in (".png", ".svg"):
        raise OutputError(Problem("a picture's name must end in .png or .svg", file=str(path)))


def sweet_spot_picture(spot: SweetSpot, path: Path, measure: str = "p95") -> None:
    """Draw the map of one measure over the display's plan, whole or not at all.

    Raises:
        OutputError: the name ends in neither .png nor .svg, or the file cannot be written.
    """
    write_plan(draw_plan(spot, measure), path)


def write_plan(plan: Plan, path: Path) -> None:
    """Write a drawing as .png or .svg, whole or not at all (OutputError)."""
    check_picture(path)
    if path.suffix.lower() == ".svg":
        write_text(path, svg_text(plan))
        return
    save_png(path, _painted(plan), optimize=True)


def svg_text(plan: Plan) -> str:
    """The plan as an SVG document; the map's colours are an image inside it."""
    return svg_document(plan.width, plan.height, PAPER, map(_svg, plan.items))


def _svg(item: Item) -> str:
    """One element."""
    if isinstance(item, Bitmap):
        height, width = item.pixels.shape[:2]
        data = base64.b64encode(png_bytes(item.pixels, optimize=True)).decode()
        place = f'x="{item.x}" y="{item.y}" width="{width}" height="{height}"'
        return f'<image {place} href="data:image/png;base64,{data}"/>'
    if isinstance(item, Label):
        halo = f' stroke="{PAPER}" stroke-width="{_HALO}" stroke-linejoin="round" paint-order="stroke"'
        return svg_label(item, halo)
    if isinstance(item, Shape):
        return svg_polygon(item)
    path = " ".join("M" + " L".join(svg_points(line).split()) for line in item.paths)
    dash = f' stroke-dasharray="{item.dash[0]:g} {item.dash[1]:g}"' if item.dash else ""
    style = f'fill="none" stroke="{item.color}" stroke-width="{item.width:g}" stroke-linecap="round"'
    return f'<path d="{path}" {style} stroke-linejoin="round"{dash}/>'


def _painted(plan: Plan) -> Any:
    """The plan as a picture of Pillow's."""
    from PIL import Image, ImageDraw

    image = paper(plan.width, plan.height, PAPER)
    pen = ImageDraw.Draw(image)
    for item in plan.items:
        if isinstance(item, Bitmap):
            bitmap = np.repeat(np.repeat(item.pixels, FINER, axis=0), FINER, axis=1)
            image.paste(Image.fromarray(bitmap), (item.x * FINER, item.y * FINER))
        elif isinstance(item, Label):
            paint_label(pen, item, _HALO, PAPER)
        elif isinstance(item, Shape):
            paint_shape(pen, item)
        else:
            _trace(pen, item)
    return reduced(image)


def _trace(pen: Any, item: Lines) -> None:
    """Lines with round ends, dashed or not."""
    width = item.width * FINER
    for path in item.paths:
        for piece in dashes(path, item.dash) if item.dash else (path,):
            points = [tuple(point) for point in (piece * FINER).tolist()]
            pen.line(points, item.color, max(1, round(width)), joint="curve")
            for x, y in (points[0], points[-1]):
                pen.ellipse((x - width / 2, y - width / 2, x + width / 2, y + width / 2), fill=item.color)


def dashes(path: FloatArray, dash: tuple[float, float]) -> list[FloatArray]:
    """The drawn pieces (2, 2) of a polyline (n, 2), straight ones; every side begins with a whole dash."""
    pieces = []
    for start, stop in pairwise(path):
        length = float(np.hypot(*(stop - start)))
        if length == 0:
            continue
        begin = np.arange(0, length, sum(dash))
        for first in begin.tolist():
            last = min(first + dash[0], length)
            pieces.append(start + np.outer((first, last), (stop - start) / length))
    return pieces
