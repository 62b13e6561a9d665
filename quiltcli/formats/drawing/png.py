"""A drawing as PNG."""

from __future__ import annotations

from pathlib import Path

from quiltcli.formats.drawing.paint import paint_label, paint_shape, paper, reduced
from quiltcli.formats.drawing.shapes import Drawing, Label
from quiltcli.formats.png import save_png


def write_png(drawing: Drawing, path: Path, color: str) -> None:
    """Write a drawing on paper of this colour, whole or not at all (OutputError)."""
    from PIL import ImageDraw

    image = paper(drawing.width, drawing.height, color)
    pen = ImageDraw.Draw(image)
    for item in drawing.items:
        if isinstance(item, Label):
            paint_label(pen, item)
        else:
            paint_shape(pen, item)
    save_png(path, reduced(image))
