"""A layout made by hand whose facets stand in the quilt with every rotation and every mirror, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from quiltcli.display import Facets
from quiltcli.layout import Layout
from quiltcli.layout.from_uv import MIRROR, QUARTER_TURNS
from tests.helpers.flat_displays import PITCH, flat_display, placed

TURNS = (*QUARTER_TURNS, *(QUARTER_TURNS @ MIRROR))
TURN_NAMES = [f"{mirror}{angle}" for mirror in ("", "mirrored ") for angle in (0, 90, 180, 270)]
# No symmetry: turned or mirrored, it is another polygon.
POLYGON = np.array([[0, 2], [6.5, 0], [13, 4.25], [9, 9], [2, 7.5]])
SIZE = np.array([13, 9])
NAMES = ("a", "", "left wing", "d", "e", "f", "", "h")


def turned_display(turns: Sequence[int] = range(8)) -> Facets:
    """Facets of one shape side by side in the world, a metre apart."""
    facets = flat_display([POLYGON] * len(turns), names=[NAMES[turn] for turn in turns])
    shift = np.zeros((len(turns), 3))
    shift[:, 0] = np.arange(len(turns)) * 1024 * PITCH
    return replace(
        facets,
        corners=facets.corners + np.repeat(shift, len(POLYGON), axis=0),
        origin=facets.origin + shift,
        size=np.tile(SIZE.astype(np.int32), (len(turns), 1)),
    )


def turned_layout(turns: Sequence[int] = range(8)) -> Layout:
    """Facets alternate between two pages of different sizes; one facet alone lies on one page."""
    maps = []
    for at, turn in enumerate(turns):
        corner = np.array([1 + 15 * (at // 2), 2 + 3 * (at // 4)])
        low = np.minimum(TURNS[turn] * SIZE, 0).sum(axis=1)
        maps.append(np.column_stack((TURNS[turn], corner - low)) + 0.0)
    pages = np.array([[64, 24], [72, 27]], dtype=np.int32)
    layout = placed(turned_display(turns), maps, on=[at % 2 for at in range(len(turns))])
    return replace(layout, pages=pages[: min(len(turns), 2)])
