"""Content templates: pages as pictures that artists and technicians lay under their work."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from quiltcli.calibration.pattern import beside_corner, corner_letter, facet_color, letter_size, roomiest
from quiltcli.calibration.pattern_files import page_pattern, write_png
from quiltcli.display import Facets
from quiltcli.exchange.pixelmaps.naming import facet_label, page_files
from quiltcli.exchange.pixelmaps.placing import placed_rows
from quiltcli.formats.drawing.font import HEIGHT, text_mask, text_width
from quiltcli.formats.drawing.svg import svg_element
from quiltcli.formats.whole import write_text
from quiltcli.layout import Layout, pixel_owners


def write_png_template(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write one picture a page at its exact pixels: the test pattern `id`, transparent between facets."""
    owners = pixel_owners(layout)
    files = page_files(path, len(layout.pages))
    for page, file in enumerate(files):
        write_png(
            file, page_pattern(layout, page, "id", owners, facets.names if facets else (), dtype=np.uint8)
        )
    return files


def write_svg_template(layout: Layout, facets: Facets | None, path: Path) -> list[Path]:
    """Write one drawing a page, a unit being a pixel; every facet is a group in its own pixels."""
    files = page_files(path, len(layout.pages))
    for page, file in enumerate(files):
        write_text(file, svg_template(layout, facets, page))
    return files


def svg_template(layout: Layout, facets: Facets | None, page: int) -> str:
    """The drawing of a page (0-based)."""
    width, height = layout.pages[page]
    names = facets.names if facets else ()
    lines: list[str] = []
    for row in placed_rows(layout):
        if layout.page[row] == page:
            facet = int(layout.facet[row])
            name = names[facet - 1] if facet <= len(names) else ""
            lines += _facet(layout, row, facet_label(facet, names), name)
    return svg_element(width, height, lines) + "\n"


def _facet(layout: Layout, row: int, label: str, name: str) -> list[str]:
    """A facet's group: polygon with a border one pixel wide inside it, id, name, arrow, corner letters."""
    (a, c, e), (b, d, f) = layout.quilt_from_facet[row]
    polygon = layout.outline(row)
    points = " ".join(f"{_short(x)},{_short(y)}" for x, y in polygon)
    fill = "#" + "".join(f"{round(255 * part):02x}" for part in facet_color(int(layout.facet[row])))
    matrix = " ".join(map(_short, (a, b, c, d, e, f)))
    centre, radius = roomiest(polygon)
    x, y = centre
    half = radius * 0.7
    lines = [
        f'<g id="{escape(label)}" transform="matrix({matrix})">',
        f"<title>{escape(f'{layout.facet[row]} {name}'.strip())}</title>",
        f'<clipPath id="{escape(label)}_clip"><polygon points="{points}"/></clipPath>',
        # Half of a line lies outside: two pixels, clipped, are one inside.
        f'<polygon points="{points}" fill="{fill}" stroke="#fff" stroke-width="2"'
        f' clip-path="url(#{escape(label)}_clip)"/>',
        _text(x, y + 0.05 * half, 0.75 * half, str(layout.facet[row]), "#fff"),
    ]
    if name:
        size = min(0.4 * half, 1.7 * half * HEIGHT / text_width(name))
        lines.append(_text(x, y + 0.72 * half, size, name, "#ff0"))
    lines += _flag(x, y, half)
    for at, corner in enumerate(polygon):
        size = letter_size(corner, centre, radius)
        here = beside_corner(polygon, at, size)
        lines.append(_text(here[0], here[1], size, corner_letter(at), "#0f0"))
    return [*lines, "</g>"]


def _flag(x: float, y: float, half: float) -> list[str]:
    """An arrow up, and a red pennant to its right."""
    tip, base, wide = y - half, y - 0.4 * half, 0.14 * half
    pole = [(x - 0.03 * half, tip), (x + 0.03 * half, tip), (x + 0.03 * half, base), (x - 0.03 * half, base)]
    head = [(x, tip), (x + wide, tip + 0.25 * half), (x - wide, tip + 0.25 * half)]
    top = base - 0.16 * half
    pennant = [(x, top), (x + 2 * wide, top), (x + 2 * wide, base), (x, base)]
    return [_polygon(pole, "#fff"), _polygon(head, "#fff"), _polygon(pennant, "#f00")]


def _short(value: float) -> str:
    """A coordinate to a thousandth of a pixel; whole pixels stay whole."""
    return f"{value:.3f}".rstrip("0").rstrip(".").removesuffix("-0") or "0"


def _text(x: float, y: float, size: float, text: str, color: str) -> str:
    """Text of this height as filled dots, centred at (x, y): a font would differ from machine to machine."""
    mask = text_mask(text)
    dot = size / HEIGHT
    runs = []
    for j, line in enumerate(mask):
        change = np.flatnonzero(np.diff(line.astype(np.int8), prepend=0, append=0)).tolist()
        runs += [
            f"M{start},{j}h{stop - start}v1h{start - stop}z"
            for start, stop in zip(change[::2], change[1::2], strict=True)
        ]
    left, top = x - dot * mask.shape[1] / 2, y - dot * HEIGHT / 2
    place = f"translate({_short(left)} {_short(top)}) scale({_short(dot)})"
    return f'<path transform="{place}" d="{"".join(runs)}" fill="{color}"/>'


def _polygon(points: list[tuple[float, float]], color: str) -> str:
    return f'<polygon points="{" ".join(f"{_short(x)},{_short(y)}" for x, y in points)}" fill="{color}"/>'
