"""The results in docs: tables put between their marks in docs/performance.md, and pictures."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.benchmarks import sorting, tables
from tests.benchmarks.pictures import bars_chart, lines_chart
from tests.benchmarks.race import seconds

DOCS = Path(__file__).parents[2] / "docs"
Rows = Sequence[Mapping[str, Any]]


def write_docs(results: Mapping[str, Any]) -> list[Path]:
    """Bring tables and pictures up to date with what the results hold; returns the files written."""
    curves = results.get("curves", {})
    page = DOCS / "performance.md"
    text = page.read_text(encoding="utf-8")
    for name, content in _tables(results, curves).items():
        text = put(text, name, content)
    page.write_text(text, encoding="utf-8")
    written = [page]
    pictures = _pictures(curves)
    if "sorting" in results:
        pictures["sorting"] = sorting.sorting_picture(results["sorting"])
    for name, picture in pictures.items():
        path = DOCS / "pictures" / f"bench-{name}.svg"
        path.write_text(picture, encoding="utf-8")
        written.append(path)
    return written


def put(text: str, name: str, content: str) -> str:
    """The text with what stands between the marks `<!-- name -->` and `<!-- /name -->` replaced."""
    pattern = re.compile(f"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
    if not pattern.search(text):
        raise KeyError(f"docs/performance.md has no place for {name}")
    return pattern.sub(lambda found: f"{found[1]}{content}\n{found[2]}", text)


def _tables(results: Mapping[str, Any], curves: Mapping[str, Rows]) -> dict[str, str]:
    found = {}
    if "machine" in results:
        found["machine"] = "; ".join(f"{name} {value}" for name, value in results["machine"].items()) + "."
    if "duels" in results:
        found["targets"] = tables.target_table(results)
        found["times"] = tables.time_table(results)
        found["ratios"] = tables.ratio_table(results)
    if "textures" in results:
        found["textures"] = tables.texture_table(results)
    if "shadows" in results:
        found["shadows"] = tables.shadow_table(results)
    if "sorting" in results:
        found["sorting"] = sorting.sorting_table(results["sorting"])
    if "sequences" in results:
        found["sequences"] = tables.sequence_table(results)
    found |= {name: tables.curve_table(rows) for name, rows in curves.items()}
    if "facets" in curves:
        found["stages"] = tables.stage_table(curves["facets"])
    return found


def _pictures(curves: Mapping[str, Rows]) -> dict[str, str]:
    found = {}
    if facets := curves.get("facets"):
        labels = [f"{row['facets']}\n{row['display'].rstrip('0123456789')}" for row in facets]
        names = {"quilt": "frame 2", "GL, sorted": "opengl sorted", "GL, whole mesh": "opengl whole"}
        series = {name: [seconds(row["times"], key) for row in facets] for name, key in names.items()}
        known = {name: line for name, line in series.items() if any(v == v for v in line)}
        found["facets"] = lines_chart("A frame by number of facets", labels, known, caption="facets")
        parts = {s: [row["stages"].get(s, 0.0) for row in facets] for s in tables.STAGES}
        found["stages"] = bars_chart("A frame by stage, one process", labels, parts)
    if pixels := curves.get("pixels"):
        sizes = [row["quilt pixels"] / 1e6 for row in pixels]
        line = {"quilt": [seconds(row["times"], "frame 2") for row in pixels]}
        title = "A frame by pixels of the quilt, 1200 facets"
        found["pixels"] = lines_chart(title, [f"{s:.0f}" for s in sizes], line, sizes, "million pixels")
    if triangles := curves.get("triangles"):
        found["triangles"] = _triangles_picture(triangles)
    return found


def _triangles_picture(rows: Rows) -> str:
    counts = sorted({row["triangles"] for row in rows})
    displays = list(dict.fromkeys((row["display"], row["facets"]) for row in rows))
    series = {
        f"{facets} facets": [seconds(row["times"], "frame 2") for row in rows if row["display"] == name]
        for name, facets in displays
    }
    labels = [f"{count / 1e3:.0f}K" for count in counts]
    return lines_chart("A frame by triangles of the scene", labels, series, counts, "triangles")
