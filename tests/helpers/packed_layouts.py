"""Packed layouts, and what every one must keep, counted pixel by pixel."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from quiltcli.display import Facets, corner_pixels, load_display
from quiltcli.job import load_display_file, pack_spec
from quiltcli.layout import Layout, packing, pixel_owners, write_layout
from quiltcli.layout.packing import PackInput
from quiltcli.layout.spans import facet_spans

MODELS = Path(__file__).parents[2] / "display_models"


def model(name: str) -> Facets:
    """A display of display_models/."""
    return load_display(load_display_file(MODELS / f"{name}.yaml"))


def pack(
    facets: Facets,
    method: str = "auto",
    size: tuple[int, int] | None = None,
    padding: int = 2,
    *,
    pins: Layout | None = None,
    **wishes: Any,
) -> Layout:
    """A display packed as asked; `pins` is a layout instead of its file."""
    with TemporaryDirectory() as folder:
        if pins is not None:
            wishes["pins"] = Path(folder) / "pins.yaml"
            write_layout(pins, wishes["pins"])
        return packing.pack(facets, pack_spec(method=method, size=size, padding=padding, **wishes))


def collisions(layout: Layout, padding: int) -> int:
    """Pairs of pixels of different facets with fewer than `padding` pixels between them, each way."""
    owners = pixel_owners(layout)
    found = 0
    for page, (width, height) in enumerate(layout.pages.tolist()):
        start, stop = layout.page_offset[page : page + 2]
        pixels = owners[start:stop].reshape(height, width)
        for dy in range(padding + 1):
            for dx in range(-padding if dy else 1, padding + 1):
                a = pixels[: height - dy, max(-dx, 0) : width - max(dx, 0)]
                b = pixels[dy:, max(dx, 0) : width - max(-dx, 0)]
                found += int(np.count_nonzero((a != b) & (a > 0) & (b > 0)))
    return found


def claimed(layout: Layout) -> int:
    """Pixels inside facets, counted facet by facet: one that two claim counts twice."""
    spans = facet_spans(layout)
    return int((spans.stop - spans.start).sum())


def wanted_of(facets: Facets, page: tuple[int, int], padding: int, align: int = 1, **more: Any) -> PackInput:
    """What a packing method is given for all facets of a display."""
    polygon = corner_pixels(facets)
    return PackInput(facets.size, facets.corner_start, polygon, page, padding, align, **more)
