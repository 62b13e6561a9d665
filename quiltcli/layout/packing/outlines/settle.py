"""Settle a packing: push every facet up and to the left as far as its neighbours let it.

Shelves have straight ends and mosaics have cells; what those leave between facets is closed here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.layout.packing.model import PackInput, PackResult
from quiltcli.layout.packing.outlines.heap import Heap
from quiltcli.layout.packing.outlines.shapes import Shapes


def settle(wanted: PackInput, shapes: Shapes, result: PackResult, passes: int = 3) -> PackResult:
    """The same packing with facets pushed together, on every page that had nothing on it before."""
    heap = Heap(wanted, shapes)
    where = result.turn + 4 * result.mirror
    fresh = np.flatnonzero(result.page >= wanted.begun).tolist()
    for facet in fresh:
        x, y = result.corner[facet].tolist()
        heap.put(facet, int(result.page[facet]), int(where[facet]), (x, y))
    for _ in range(passes):
        highest_first = sorted(fresh, key=lambda facet: (*heap.corner[facet, ::-1].tolist(), facet))
        if not sum(heap.push(facet) for facet in highest_first):
            break
    corner = np.where((result.page >= wanted.begun)[:, None], heap.corner, result.corner)
    return replace(result, corner=corner.astype(np.int32))
