"""Shapes and labels as elements of an SVG document, for every picture that is drawn of them."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape

from quiltcli.formats.drawing.shapes import Label, Shape
from quiltcli.geometry import FloatArray


def svg_document(width: int, height: int, paper: str, items: Iterable[str]) -> str:
    """A document of this size in pixels, on paper of this colour."""
    sheet = f'<rect width="{width}" height="{height}" fill="{paper}"/>'
    return svg_element(width, height, [sheet, *items], ' font-family="sans-serif"') + "\n"


def svg_element(width: int, height: int, items: Iterable[str], more: str = "") -> str:
    """The picture by itself, to stand in a page; `more` are further attributes."""
    size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size}{more}>', *items, "</svg>"])


def svg_polygon(shape: Shape, more: str = "") -> str:
    """A filled polygon, with an outline if that has a width; `more` are further attributes."""
    stroke = f' stroke="{shape.outline}" stroke-width="{shape.width:g}"' if shape.width else ""
    return f'<polygon points="{svg_points(shape.points)}" fill="{shape.fill}"{stroke}{more}/>'


def svg_label(label: Label, more: str = "") -> str:
    """A line of text, centred on its height; `more` are further attributes."""
    place = f'x="{label.x:.2f}" y="{label.y:.2f}" font-size="{label.size:.1f}" fill="{label.color}"{more}'
    return (
        f'<text {place} text-anchor="{label.anchor}" dominant-baseline="central">{escape(label.text)}</text>'
    )


def svg_points(points: FloatArray) -> str:
    """Points (n, 2) as SVG writes them, to a hundredth of a pixel."""
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
