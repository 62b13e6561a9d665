"""How well and how fast displays pack: the tables of docs/packing.md.

`python -m tests.benchmarks.packing` prints them, `--write docs/packing.md` puts them into the page,
between its marks. Fill is the share of the pages' pixels that lie in facets; seconds are processor time.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh

from quiltcli.display import Facets, corner_pixels, load_display
from quiltcli.geometry import FloatArray, next_in_row
from quiltcli.job import load_display_file
from quiltcli.layout import fill
from quiltcli.layout.packing import METHODS, PackInput
from quiltcli.layout.packing.model import used_height
from quiltcli.layout.packing.shortage import scaled
from tests.helpers.packed_layouts import pack

MODELS = Path(__file__).parents[2] / "display_models"
STRIP = {
    "cylinder216": 0.91,
    "desk816": 0.83,
    "knot1200": 0.86,
    "sphere840": 0.86,
    "sphere1620": 0.86,
    "teapot1024": 0.86,
    "icosahedron": 0.731,
    "dodecahedron": 0.673,
    "cube5": None,
    "spring902": None,
}
"""Displays for the strip, and what was to be reached on displays of their kind."""


def models() -> list[str]:
    """Names of all display models."""
    return sorted(path.stem for path in MODELS.glob("*.yaml") if "\nkind:" not in path.read_text())


def loaded(name: str) -> Facets:
    """A display model."""
    return load_display(load_display_file(MODELS / f"{name}.yaml"))


def own_density(names: Iterable[str]) -> list[list[str]]:
    """A row for every display: fill and seconds of every method on the smallest page it finds."""
    rows = [["display", "facets", "megapixels", *METHODS, "page of auto"]]
    for name in names:
        facets = loaded(name)
        cells, page = [], ""
        for method in METHODS:
            start = time.process_time()
            layout = pack(facets, method)
            seconds = time.process_time() - start
            cells.append(f"{100 * fill(layout):.1f} % ({seconds:.1f} s)")
            if len(layout.pages) > 1:
                cells[-1] += f" {len(layout.pages)} pages"
            if method == "auto":
                page = "×".join(map(str, layout.pages[0]))
                pixels = fill(layout) * float(layout.page_offset[-1]) / 1e6
        rows.append([name, str(facets.count), f"{pixels:.2f}", *cells, page])
    return rows


def canvases(names: Iterable[str]) -> list[list[str]]:
    """A row for every display: pages of two fixed canvases by the default method."""
    rows = [["display", "3840×2160", "7680×4320"]]
    for name in names:
        facets = loaded(name)
        layouts = [pack(facets, size=size) for size in ((3840, 2160), (7680, 4320))]
        rows.append([name, *(f"{len(layout.pages)} ({100 * fill(layout):.1f} %)" for layout in layouts)])
    return rows


def strip(names: Iterable[str]) -> list[list[str]]:
    """A row for every display: 16 megapixels of facets on a page 4096 wide and as high as it takes."""
    rows = [["display", "best of auto", "seconds", "aim"]]
    for name in names:
        share, seconds = best_share(sixteen_megapixels(loaded(name)), "auto", 10)
        rows.append([name, percent(share), f"{seconds:.1f}", percent(STRIP[name])])
    return rows


def best_share(wanted: PackInput, method: str, seconds: float) -> tuple[float, float]:
    """Fill, and seconds it took, of the best that a method tries with so many seconds of effort."""
    results = []
    start = time.process_time()
    for attempts in METHODS[method](wanted, seconds):
        left = seconds
        for number, attempt in enumerate(attempts):
            left -= attempt.seconds
            if number and left < 0:
                break
            results.append(attempt.run(wanted))
    spent = time.process_time() - start
    return area(wanted) / (wanted.page[0] * min(used_height(wanted, result) for result in results)), spent


def percent(share: float | None) -> str:
    """A share to a tenth of a percent."""
    return "–" if share is None else f"{100 * share:.1f} %"


def sixteen_megapixels(facets: Facets) -> PackInput:
    """The display's facets, all of them, at the density that makes them 16 megapixels."""
    wanted = PackInput(
        facets.size * 100, facets.corner_start, corner_pixels(facets), (4096, 65536), padding=2
    )
    return replace(scaled(wanted, (16e6 / area(wanted)) ** 0.5), page=(4096, 65536))


def on_strip(polygons: Sequence[FloatArray], width: int, megapixels: float = 0) -> PackInput:
    """Polygons for a page of this width and any height, scaled to so many megapixels if any are given."""
    polygons = [polygon - polygon.min(axis=0) for polygon in polygons]
    start = np.concatenate(([0], np.cumsum([len(polygon) for polygon in polygons])))
    size = np.array([np.ceil(polygon.max(axis=0) - 1e-6) for polygon in polygons], dtype=np.int32)
    wanted = PackInput(size, start, np.concatenate(polygons), (width, 1 << 16), padding=2)
    if not megapixels:
        return wanted
    factor = (megapixels * 1e6 / area(wanted)) ** 0.5
    return scaled(replace(wanted, size=np.full_like(size, 1 << 16)), factor)


def own_frames(triangles: FloatArray) -> list[FloatArray]:
    """Triangles (n, 3, 3) laid flat with their longest edge along x."""
    result = []
    for corners in triangles:
        longest = int(np.argmax(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)))
        a, b, c = np.roll(corners, -longest, axis=0)
        along, apex = b - a, c - a
        length = float(np.linalg.norm(along))
        foot = float(apex @ along) / length
        height = float(np.linalg.norm(apex - along * foot / length))
        result.append(np.array([[0, height], [length, height], [foot, 0]]))
    return result


def round_polygon(rng: np.random.Generator, radius: float) -> FloatArray:
    """3 to 8 corners on a circle."""
    n = int(rng.integers(3, 9))
    angle = np.sort((np.arange(n) + rng.uniform(-0.35, 0.35, n)) * 2 * np.pi / n)
    result: FloatArray = np.column_stack((np.cos(angle), np.sin(angle))) * radius
    return result


def some_polygon(rng: np.random.Generator, angular: bool) -> FloatArray:
    """A round polygon, or an L."""
    side = rng.uniform(350, 900)
    if not angular:
        return round_polygon(rng, side / 2)
    a, b = rng.uniform(0.3, 0.6, 2)
    return np.array([[0, 0], [1, 0], [1, a], [b, a], [b, 1], [0, 1]]) * side


def led_panels(count: int, megapixels: float) -> PackInput:
    """Rectangles of whole modules."""
    sizes = np.random.default_rng(1).choice(np.arange(128, 513, 64), (count, 2))
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return on_strip([square * size for size in sizes], 4096, megapixels)


def some_of(name: str, count: int, width: int) -> PackInput:
    """Some facets of a display at the density that makes all of them 16 megapixels."""
    whole = sixteen_megapixels(loaded(name))
    rows = np.sort(np.random.default_rng(count).choice(len(whole.size), count, replace=False))
    polygons = np.split(whole.polygon, whole.corner_start[1:-1])
    return on_strip([polygons[row] for row in rows], width)


def round_polygons() -> PackInput:
    """5,000 of radii from 20 to 90 pixels."""
    rng = np.random.default_rng(11)
    return on_strip([round_polygon(rng, rng.uniform(20, 90)) for _ in range(5000)], 7000)


def mixed_polygons() -> PackInput:
    """40, every fourth an L."""
    rng = np.random.default_rng(3)
    return on_strip([some_polygon(rng, angular=at % 4 == 3) for at in range(40)], 4096, 16)


def equilateral() -> PackInput:
    """20 triangles of 1200 pixels a side."""
    return on_strip([np.array([[0, 3**0.5], [2, 3**0.5], [1, 0]]) * 600] * 20, 4096)


def sphere_triangles() -> PackInput:
    """5,120 that are nearly equilateral."""
    return on_strip(own_frames(trimesh.creation.icosphere(subdivisions=4).triangles), 8192, 60)


Build: TypeAlias = Callable[[], PackInput]

ASIDE: dict[str, tuple[Build, float | None]] = {
    "50 LED panels, 5.45 megapixels": (lambda: led_panels(50, 5.45), 0.92),
    "300 LED panels, 34.07 megapixels": (lambda: led_panels(300, 34.07), 0.95),
    "5,120 triangles of a sphere, 60 megapixels": (sphere_triangles, 0.88),
    "5,000 random convex polygons of 3 to 8 corners": (round_polygons, None),
    "50 facets of desk816": (lambda: some_of("desk816", 50, 1400), 0.84),
    "100 facets of desk816": (lambda: some_of("desk816", 100, 1600), 0.84),
    "200 facets of desk816": (lambda: some_of("desk816", 200, 1842), 0.84),
    "100 facets of teapot1024": (lambda: some_of("teapot1024", 100, 1600), None),
    "20 equilateral triangles": (equilateral, None),
    "40 polygons, every fourth an L": (mixed_polygons, None),
}
"""Other sets, and what was to be reached on displays of their kind."""


def aside() -> list[list[str]]:
    """A row for every other set, on a page as wide as it says and as high as it takes."""
    rows = [["facets", "page width", "auto", "seconds", "aim"]]
    for name, (build, aim) in ASIDE.items():
        wanted = build()
        share, seconds = best_share(wanted, "auto", 10)
        rows.append([name, str(wanted.page[0]), percent(share), f"{seconds:.1f}", percent(aim)])
    return rows


def area(wanted: PackInput) -> float:
    """Pixels of all facets, exactly."""
    here, there = wanted.polygon, wanted.polygon[next_in_row(wanted.corner_start)]
    twice = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    return float(np.abs(np.add.reduceat(twice, wanted.corner_start[:-1])).sum() / 2)


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """Rows as a table, the first being its head."""
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + " --- |" * len(rows[0]), *lines[1:]])


def main() -> None:
    """Print the tables, or write them into a page between its marks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="page to write the tables into")
    parser.add_argument("names", nargs="*", help="displays; all of them by default")
    options = parser.parse_args()
    names = options.names or models()
    tables = {
        "own density": own_density(names),
        "canvases": canvases(names),
        "strip": strip([name for name in names if name in STRIP]),
        "other sets": aside() if not options.names else [],
    }
    text = options.write.read_text(encoding="utf-8") if options.write else ""
    for title, rows in tables.items():
        if not rows:
            continue
        if not options.write:
            print(f"{title}\n\n{markdown(rows)}\n")
            continue
        begin, end = f"<!-- table: {title} -->\n", "<!-- end -->"
        head, rest = text.split(begin)
        text = head + begin + markdown(rows) + "\n" + end + rest.split(end, 1)[1]
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
