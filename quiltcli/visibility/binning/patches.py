"""Patches of curved facets as cones: a row each behind those of the facets."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.projection.patches import Patched
from quiltcli.visibility.binning.cones import Cones, cone_planes
from quiltcli.visibility.setup.blocks import Blocks

_ROOM = 1.0
"""Pixels around a patch that cover the rounding of the tests."""


def with_patch_cones(cones: Cones, seen: Patched, blocks: Blocks, beside: float) -> Cones:
    """The cones of flat facets, and behind them those of the patches that may be lit.

    Args:
        cones: of flat facets.
        seen: the patches as the eye sees them.
        blocks: all blocks; a patch is the row of its block in `Blocks.start`.
        beside: pixels by which samples lie beside the centres of their pixels, at most.
    """
    which = np.flatnonzero(seen.lit)
    if not which.size:
        return cones
    block = blocks.flat + which
    size = np.stack((blocks.width[block], blocks.height[block]), axis=1).astype(np.float64)
    # Samples are counted from pixels' centres.
    low = np.stack((blocks.margin[block] - 0.5, np.full(which.size, -0.5)), axis=1)
    high = size - 0.5
    grown = seen.reach[which] + (_ROOM + beside)
    corners = _corners(seen.eye_from_patch[which], low, high)
    wide = _corners(seen.eye_from_patch[which], low - grown, high + grown)
    row = blocks.start.size - 1 - seen.lit.size + which
    return Cones(
        facet=np.concatenate((cones.facet, row)).astype(np.int32),
        corners=_together(cones.corners, corners),
        wide=_together(cones.wide, wide),
        planes=_together(cones.planes, cone_planes(wide), repeat=False),
    )


def _corners(matrices: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Directions (K, 4, 3) through the corners of rectangles of pixels."""
    x = np.stack((low[:, 0], high[:, 0], high[:, 0], low[:, 0]), axis=1)[..., None]
    y = np.stack((low[:, 1], low[:, 1], high[:, 1], high[:, 1]), axis=1)[..., None]
    u, v, o = (matrices[:, None, :, k] for k in range(3))
    return np.asarray(u * x + v * y + o)


def _together(first: FloatArray, second: FloatArray, *, repeat: bool = True) -> FloatArray:
    """Polygons (K, n, 3) of two kinds; short ones repeat their last corner, or get planes of nothing."""
    count = max(first.shape[1], second.shape[1]) if len(first) else second.shape[1]
    both = [_padded(part, count, repeat=repeat) for part in (first[:, :count], second)]
    return np.concatenate(both)


def _padded(polygons: FloatArray, count: int, *, repeat: bool) -> FloatArray:
    more = count - polygons.shape[1]
    if more <= 0:
        return polygons
    if not len(polygons):
        return np.zeros((0, count, 3))
    last = np.repeat(polygons[:, -1:], more, axis=1)
    return np.concatenate((polygons, last if repeat else np.zeros_like(last)), axis=1)
