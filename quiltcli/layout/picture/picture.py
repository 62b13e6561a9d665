"""The picture of a layout: a PNG to look at, or an SVG to zoom into."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from quiltcli.display import Facets
from quiltcli.errors import OutputError, Problem
from quiltcli.formats.drawing.png import write_png
from quiltcli.formats.drawing.shapes import Drawing, Shape
from quiltcli.formats.drawing.svg import svg_document, svg_label, svg_polygon
from quiltcli.formats.whole import write_text
from quiltcli.layout.layout import Layout
from quiltcli.layout.picture.drawing import PAPER, draw_layout


def layout_picture(
    layout: Layout, path: str | Path, names: Sequence[str] = (), facets: Facets | None = None
) -> None:
    """Draw the layout with facet ids, names and fill figures, at most 2048 pixels wide and high.

    The small triangle in a facet points to where its image's top is.

    Args:
        layout: a layout that `check_layout` accepts.
        path: a file name that ends in .png or .svg.
        names: names of the facets by id; empty strings are not drawn.
        facets: the display, to draw it beside the pages and to take names from.

    Raises:
        OutputError: another ending, or the file cannot be written.
    """
    path = Path(path)
    drawing = draw_layout(layout, names or (facets.names if facets is not None else ()), facets)
    if path.suffix.lower() == ".svg":
        write_text(path, svg_text(drawing))
    elif path.suffix.lower() == ".png":
        write_png(drawing, path, PAPER)
    else:
        raise OutputError(Problem("a picture's name must end in .png or .svg", file=str(path)))


def svg_text(drawing: Drawing) -> str:
    """The drawing as an SVG document."""
    items = (
        svg_polygon(item, ' stroke-linejoin="round"') if isinstance(item, Shape) else svg_label(item)
        for item in drawing.items
    )
    return svg_document(drawing.width, drawing.height, PAPER, items)
