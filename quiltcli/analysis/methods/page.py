"""A comparison as one page of HTML that needs nothing else, and as JSON beside it."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np

from quiltcli.analysis.methods.findings import REFERENCE
from quiltcli.analysis.methods.study import Study
from quiltcli.analysis.methods.table import COLUMNS, study_json, study_rows, study_words
from quiltcli.formats.drawing.charts import Curve, bar_chart, line_chart
from quiltcli.formats.drawing.pages import html_page, html_table
from quiltcli.formats.png import png_bytes
from quiltcli.formats.whole import make_folder, write_text
from quiltcli.images.preview import Bytes

_WORDS = {
    "figures": (
        "Every pixel inside the lit facets is held against one ray. <em>wrong</em>: pixels that show a"
        " surface although another is nearer; <em>lost</em>: pixels that show nothing because the method's"
        " depth range ends. Depth is what the method's buffer is taken for. A <em>seam jump</em> is a"
        " difference between the depths on both sides of an edge two facets share, carried to the edge"
        " along the surface. <em>light</em> is the error of a quilt pixel's worst channel, <em>seen</em>"
        " that of what the viewer sees of the display against a direct picture of the scene."
    ),
    "profile": (
        "Depth along a line that crosses the edge between facets {0} and {1}, as each method's buffer tells"
        " it. Where a curve jumps at the edge, whatever is composited by that depth breaks there."
    ),
    "near": "The same, as a difference from the ray's depth, for the buffers that mean the viewer's depth.",
    "crops": "What the viewer sees, close to where depth goes most wrong; below, wrong pixels in red.",
    "time": "Seconds for the frame, by stage, on this machine at this moment. Rays are cut short.",
}


def write_comparison(study: Study, folder: Path) -> tuple[Path, Path]:
    """Write `compare.NNNN.html` and `compare.NNNN.json` into a folder, each whole or not at all.

    Returns:
        Their paths.

    Raises:
        OutputError: they cannot be written.
    """
    make_folder(folder)
    name = f"compare.{study.frame:04d}"
    page, data = folder / f"{name}.html", folder / f"{name}.json"
    write_text(page, page_text(study))
    write_text(data, json.dumps(study_json(study), indent=1, allow_nan=False) + "\n")
    return page, data


def page_text(study: Study) -> str:
    """The page."""
    title = f"Render methods at frame {study.frame}"
    parts = [
        f"<p>{study.pixels:,} pixels of {study.lit} lit facets;"
        f" near {study.near:g} m, far {study.far:g} m.</p>",
        *_section("Figures", "figures", html_table(COLUMNS, study_rows(study))),
        *(f"<p>{escape(words[0].upper() + words[1:])}.</p>" for words in study_words(study)),
        *_profile(study),
        *_section("Where depth goes wrong", "crops", _crops(study)),
        *_section("Time", "time", bar_chart(*_times(study))),
    ]
    return html_page(title, parts)


def _section(title: str, words: str, content: str, *names: object) -> Iterator[str]:
    yield f"<h2>{title}</h2>"
    yield f"<p>{_WORDS[words].format(*names)}</p>"
    yield f'<div class="scroll">{content}</div>'


def _profile(study: Study) -> Iterator[str]:
    """Depth across a seam, of one variant a method, and the errors of those near the truth."""
    if study.profile is None:
        return
    along = study.profile.along * 1000
    labels = ("millimetres from the edge, on the facets", "depth, metres")
    finest: dict[str, Curve] = {}
    for found, depths in zip(study.findings, study.depths, strict=True):
        kept = finest.get(found.variant.method)
        if kept is None or found.variant.bits == "24":
            finest[found.variant.method] = Curve(found.variant.name, depths, found.variant == REFERENCE)
    # The truth goes last, in dashes: what follows it shows through.
    curves = sorted(finest.values(), key=lambda curve: curve.dashed)
    chart = line_chart(along, curves, labels, mark=0.0)
    yield from _section("Depth across a seam", "profile", chart, *study.profile.facets)
    truth = study.depths[0]
    near = [
        Curve(found.variant.name, (depths - truth) * 1000)
        for found, depths in zip(study.findings, study.depths, strict=True)
        if found.variant.method in ("homography", "twopass") and np.isfinite(depths - truth).any()
    ]
    if near:
        yield f"<p>{_WORDS['near']}</p>"
        yield line_chart(along, near, (labels[0], "error, millimetres"), mark=0.0)


def _crops(study: Study) -> str:
    figures = []
    for found, picture, mark in zip(study.findings, study.crops, study.marks, strict=True):
        name = escape(found.variant.name)
        images = _image(picture, name) + ("" if mark is None else _image(mark, f"{name}, wrong pixels"))
        count = "" if found.wrong is None else f": {found.wrong + (found.lost or 0):,} wrong"
        figures.append(f"<figure>{images}<figcaption>{name}{count}</figcaption></figure>")
    return f'<div class="grid">{"".join(figures)}</div>'


def _image(pixels: Bytes, name: str) -> str:
    data = base64.b64encode(png_bytes(pixels, optimize=True)).decode("ascii")
    return f'<img alt="{name}" src="data:image/png;base64,{data}">'


def _times(study: Study) -> tuple[list[tuple[str, dict[str, float]]], str, int, float]:
    """Rows, unit, width and longest bar of the chart of times."""
    rows = [(found.variant.name, dict(found.seconds)) for found in study.findings]
    others = [sum(parts.values()) for name, parts in rows if name != REFERENCE.name]
    return rows, "s", 860, max(others, default=0.0) or sum(rows[0][1].values())
