"""What a layout is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import Info, counted, size
from quiltcli.layout import Layout, fill, read_layout, whole_pixel


def layout_info(path: Path) -> Info:
    """Pages, fill, method and transforms of a layout.

    Raises:
        JobError, LayoutError: the layout is wrong.
    """
    layout = read_layout(path)
    table = _place_table(layout)
    pixels = layout.size.astype(np.int64).prod(axis=1)
    data: dict[str, Any] = {
        "path": str(path),
        "display": layout.display,
        "display_sha256": layout.display_sha256,
        "method": layout.method,
        "padding": layout.padding,
        "pages": [{"size": page, "facets": _on(layout, i)} for i, page in enumerate(layout.pages.tolist())],
        "facets": int(layout.facet.size),
        "pixels": int(pixels.sum()),
        "quilt_pixels": int(layout.page_offset[-1]),
        "fill": fill(layout),
        "transforms": {kind: sum(kind == entry["transform"] for entry in table) for kind in _KINDS},
        "places": table,
    }
    columns = ("facet", "page", "pixels", "x", "y", "transform")
    return Info("layout", data, _lines(data), columns, [_row(entry) for entry in table])


_KINDS = ("upright", "turned", "mirrored", "resampled")


def _on(layout: Layout, page: int) -> int:
    return int(np.count_nonzero(layout.page == page))


def _lines(data: dict[str, Any]) -> list[tuple[str, str]]:
    sizes = dict.fromkeys(size(page["size"]) for page in data["pages"])
    kinds = [f"{count:,} {kind}" for kind, count in data["transforms"].items() if count]
    lines = [
        ("display", data["display"] or "not said"),
        ("method", data["method"]),
        ("pages", f"{counted(len(data['pages']), 'page')} of {', '.join(sizes)} pixels"),
        ("facets", f"{data['facets']:,}, {data['pixels']:,} pixels"),
        ("fill", f"{100 * data['fill']:.1f} %"),
        ("padding", counted(data["padding"], "pixel")),
        ("transforms", ", ".join(kinds)),
    ]
    return lines + [("geometry", data["display_sha256"])] * bool(data["display_sha256"])


def _place_table(layout: Layout) -> list[dict[str, Any]]:
    copied = whole_pixel(layout)
    linear = layout.quilt_from_facet[:, :, :2]
    mirrored = linear[:, 0, 0] * linear[:, 1, 1] < linear[:, 0, 1] * linear[:, 1, 0]
    upright = (linear == np.eye(2)).all(axis=(1, 2))
    kind = np.where(~copied, 3, np.where(mirrored, 2, np.where(upright, 0, 1)))
    return [
        {
            "id": int(layout.facet[row]),
            "page": int(layout.page[row]) + 1,
            "size": layout.size[row].tolist(),
            "corner": _corner(layout, row),
            "transform": _KINDS[kind[row]],
            "quilt_from_facet": layout.quilt_from_facet[row].tolist(),
        }
        for row in range(layout.facet.size)
    ]


def _corner(layout: Layout, row: int) -> list[float]:
    """Least coordinates of a facet's raster on its page."""
    width, height = layout.size[row]
    raster = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]])
    least: list[float] = (raster @ layout.quilt_from_facet[row].T).min(axis=0).tolist()
    return least


def _row(entry: dict[str, Any]) -> list[str]:
    x, y = entry["corner"]
    return [str(entry["id"]), str(entry["page"]), size(entry["size"]), f"{x:g}", f"{y:g}", entry["transform"]]
