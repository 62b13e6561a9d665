"""A picture of the pages with a mark at every fault."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.verify.images import Images
from quiltcli.analysis.verify.tally import Fault
from quiltcli.formats.png import save_png
from quiltcli.images.facets import page_of
from quiltcli.layout import Layout

MARKS = {
    "crack": (255, 40, 40),
    "extra": (255, 200, 0),
    "stray": (255, 120, 0),
    "triangle": (60, 160, 255),
    "depth": (200, 80, 255),
    "alpha": (255, 255, 255),
    "seam": (0, 230, 120),
}
_SIDE, _RADIUS, _GAP = 1536, 7, 8


def write_picture(path: Path, layout: Layout, images: Images, faults: Sequence[Fault]) -> None:
    """Draw the pages side by side, near bright and far dark, each fault ringed in its kind's colour.

    Raises:
        OutputError: the picture cannot be written.
    """
    from PIL import Image, ImageDraw

    step = max(1, math.ceil(int(layout.pages.max()) / _SIDE))
    pages = [
        _grey(page_of(images.channels["Z"], layout, page)[::step, ::step])
        for page in range(len(layout.pages))
    ]
    width = sum(page.shape[1] + _GAP for page in pages) + _GAP
    height = max(page.shape[0] for page in pages) + 2 * _GAP
    picture = Image.new("RGB", (width, height), (30, 34, 42))
    draw, left = ImageDraw.Draw(picture), _GAP
    for number, page in enumerate(pages, 1):
        picture.paste(Image.fromarray(page), (left, _GAP))
        for fault in faults:
            if fault.page == number:
                x, y = left + fault.x // step, _GAP + fault.y // step
                box = (x - _RADIUS, y - _RADIUS, x + _RADIUS, y + _RADIUS)
                draw.ellipse(box, outline=MARKS[fault.kind], width=2)
        left += page.shape[1] + _GAP
    save_png(path, picture)


def _grey(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Grey levels (h, w) of depths, 0 where there are none."""
    shown = np.isfinite(depth)
    if not shown.any():
        return np.zeros(depth.shape, dtype=np.uint8)
    near, far = float(depth[shown].min()), float(depth[shown].max())
    share = (np.where(shown, depth, far) - near) / max(far - near, 1e-9)
    return np.where(shown, 230 - 170 * share, 0).astype(np.uint8)
