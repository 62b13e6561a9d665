"""The picture of a sweet spot: a PNG to look at, or an SVG to zoom into."""

from __future__ import annotations

import base64
import io
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.sweetspot.plan import Bitmap, Item, Lines, Plan, draw_plan
from quiltcli.analysis.sweetspot.study import SweetSpot
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.drawing.svg import svg_document, svg_label, svg_points, svg_polygon
from quiltcli.formats.whole import whole_file, write_text
from quiltcli.geometry import FloatArray
from quiltcli.layout.picture.drawing import PAPER, Label, Shape

_FINER = 2  # drawn this much larger, then reduced: smooth edges
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
    with whole_file(path) as temporary:
        _image(plan).save(temporary, format="PNG", optimize=True)


def svg_text(plan: Plan) -> str:
    """The plan as an SVG document; the map's colours are an image inside it."""
    return svg_document(plan.width, plan.height, PAPER, map(_svg, plan.items))


def _svg(item: Item) -> str:
    """One element."""
    if isinstance(item, Bitmap):
        height, width = item.pixels.shape[:2]
        data = base64.b64encode(_png_bytes(item.pixels)).decode()
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


def _png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    memory = io.BytesIO()
    Image.fromarray(pixels).save(memory, format="PNG", optimize=True)
    return memory.getvalue()


def _image(plan: Plan) -> Any:
    """The plan as a PIL image."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (plan.width * _FINER, plan.height * _FINER), PAPER)
    pen = ImageDraw.Draw(image)
    for item in plan.items:
        if isinstance(item, Bitmap):
            bitmap = np.repeat(np.repeat(item.pixels, _FINER, axis=0), _FINER, axis=1)
            image.paste(Image.fromarray(bitmap), (item.x * _FINER, item.y * _FINER))
        elif isinstance(item, Label):
            _write(pen, item)
        elif isinstance(item, Shape):
            corners = [tuple(point) for point in (item.points * _FINER).tolist()]
            pen.polygon(corners, fill=item.fill)
            if item.width:
                pen.line([*corners, corners[0]], item.outline, round(item.width * _FINER), joint="curve")
        else:
            _trace(pen, item)
    return image.resize((plan.width, plan.height), Image.Resampling.BOX)


def _write(pen: Any, item: Label) -> None:
    from PIL import ImageFont

    font = ImageFont.load_default(item.size * _FINER)
    place = (item.x * _FINER, item.y * _FINER)
    anchor = "mm" if item.anchor == "middle" else "lm"
    pen.text(place, item.text, item.color, font, anchor, stroke_width=_HALO, stroke_fill=PAPER)


def _trace(pen: Any, item: Lines) -> None:
    """Lines with round ends, dashed or not."""
    width = item.width * _FINER
    for path in item.paths:
        for piece in dashes(path, item.dash) if item.dash else (path,):
            points = [tuple(point) for point in (piece * _FINER).tolist()]
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
