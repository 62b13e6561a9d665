"""A drawing as PNG."""

from __future__ import annotations

from pathlib import Path

from quiltcli.formats.drawing.shapes import Drawing, Label
from quiltcli.formats.whole import whole_file

_FINER = 2  # drawn this much larger, then reduced: smooth edges


def write_png(drawing: Drawing, path: Path, paper: str) -> None:
    """Write a drawing on paper of this colour, whole or not at all (OutputError)."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGB", (drawing.width * _FINER, drawing.height * _FINER), paper)
    pen = ImageDraw.Draw(image)
    for item in drawing.items:
        if isinstance(item, Label):
            font = ImageFont.load_default(item.size * _FINER)
            anchor = "mm" if item.anchor == "middle" else "lm"
            pen.text((item.x * _FINER, item.y * _FINER), item.text, item.color, font, anchor)
            continue
        points = [(x * _FINER, y * _FINER) for x, y in item.points]
        if len(points) > 2:
            pen.polygon(points, fill=item.fill)
        if item.width:
            pen.line([*points, points[0]], item.outline, round(item.width * _FINER), joint="curve")
    small = image.resize((drawing.width, drawing.height), Image.Resampling.BOX)
    with whole_file(path) as temporary:
        small.save(temporary, format="PNG")
