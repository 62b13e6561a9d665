"""Shapes and labels as pixels, for every picture that is drawn of them."""

from __future__ import annotations

from typing import Any

from quiltcli.formats.drawing.shapes import Label, Shape

FINER = 2
"""Pictures are painted this much larger, then reduced: smooth edges."""


def paper(width: int, height: int, color: str) -> Any:
    """An empty picture of Pillow's, to be painted on and then `reduced`."""
    from PIL import Image

    return Image.new("RGB", (width * FINER, height * FINER), color)


def reduced(image: Any) -> Any:
    """The painted picture at its own size."""
    from PIL import Image

    return image.resize((image.width // FINER, image.height // FINER), Image.Resampling.BOX)


def paint_shape(pen: Any, shape: Shape) -> None:
    """A filled polygon, with an outline if that has a width; `pen` is Pillow's `ImageDraw`."""
    points = [(float(x) * FINER, float(y) * FINER) for x, y in shape.points]
    if len(points) > 2:
        pen.polygon(points, fill=shape.fill)
    if shape.width:
        pen.line([*points, points[0]], shape.outline, round(shape.width * FINER), joint="curve")


def paint_label(pen: Any, label: Label, halo: int = 0, color: str = "") -> None:
    """A line of text, with a halo of so many pixels of a colour."""
    from PIL import ImageFont

    font = ImageFont.load_default(label.size * FINER)
    anchor = "mm" if label.anchor == "middle" else "lm"
    around = {"stroke_width": halo, "stroke_fill": color} if halo else {}
    pen.text((label.x * FINER, label.y * FINER), label.text, label.color, font, anchor, **around)
