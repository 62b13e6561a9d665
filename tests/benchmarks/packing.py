"""How well and how fast displays pack: the tables of docs/packing.md.

`python -m tests.benchmarks.packing` prints them, `--write docs/packing.md` puts them into the page,
between its marks. Fill is the share of the pages' pixels that lie in facets; seconds are processor time.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from quiltcli.display import Facets, corner_pixels, load_display
from quiltcli.geometry import next_in_row
from quiltcli.job import load_display_file
from quiltcli.layout import fill
from quiltcli.packing import METHODS, STEADY, PackInput, pack
from quiltcli.packing.model import used_height
from quiltcli.packing.shortage import scaled

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
    return sorted(path.stem for path in MODELS.glob("*.yaml"))


def loaded(name: str) -> Facets:
    """A display model."""
    return load_display(load_display_file(MODELS / f"{name}.yaml"))


def own_density(names: Iterable[str]) -> list[list[str]]:
    """A row for every display: fill and seconds of every method on the smallest page it finds."""
    rows = [["display", "facets", "megapixels", *STEADY, "page of auto"]]
    for name in names:
        facets = loaded(name)
        cells, page = [], ""
        for method in STEADY:
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


def strip(names: Iterable[str], seconds: float = 10) -> list[list[str]]:
    """A row for every display: 16 megapixels of facets on a page 4096 wide and as high as it takes."""
    rows = [["display", "best of auto", "seconds", "aim"]]
    for name in names:
        wanted = sixteen_megapixels(loaded(name))
        start = time.process_time()
        attempts = [attempt for part in METHODS["auto"](wanted, seconds) for attempt in part]
        results = [attempt.run(wanted) for attempt in attempts]
        spent = time.process_time() - start
        share = area(wanted) / (4096 * min(used_height(wanted, result) for result in results))
        aim = STRIP[name]
        rows.append([name, f"{100 * share:.1f} %", f"{spent:.1f}", f"{100 * aim:.1f} %" if aim else "–"])
    return rows


def sixteen_megapixels(facets: Facets) -> PackInput:
    """The display's facets, all of them, at the density that makes them 16 megapixels."""
    wanted = PackInput(
        facets.size * 100, facets.corner_start, corner_pixels(facets), (4096, 65536), padding=2
    )
    return replace(scaled(wanted, (16e6 / area(wanted)) ** 0.5), page=(4096, 65536))


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
    }
    text = options.write.read_text(encoding="utf-8") if options.write else ""
    for title, rows in tables.items():
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
