"""Displaced samples: where on its patch's plane the ray of each pixel of a curved facet goes through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.projection.patches import Patched, Patches, alike, patch_grid
from quiltcli.projection.planar import QuiltRays
from quiltcli.visibility.setup.blocks import Canvas
from quiltcli.visibility.setup.planes import DISPLACED

SHIFT = (3.0, 2.0)
"""Steps of their grid by which samples are moved where edges are decided: no vertex sits on a sample."""


@dataclass(frozen=True)
class Samples:
    """The samples of a canvas of patches, microtile by microtile.

    Attributes:
        place: (2, M, 64) columns and rows in the block at which rays go through, counted from centres.
        points: (M, 3, 64) the same on the grid on which edges are decided, and 1.
        lit: (M, 64) pixels that are the facet's or its bleed, and show an image.
        box: (4, M) least and greatest column, least and greatest row of `points` over the lit pixels.
        reach: (K, 2) how far at most samples of each block lie beside their pixels.
    """

    place: FloatArray
    points: FloatArray
    lit: BoolArray
    box: FloatArray
    reach: FloatArray


def samples_of(
    rays: QuiltRays, patches: Patches, canvas: Canvas, which: IntArray, sample: tuple[FloatArray, FloatArray]
) -> Samples:
    """The samples of a batch.

    Args:
        rays: with the patches as the eye sees them.
        patches: the patches.
        canvas: whose blocks are patches.
        which: (K,) which patches these are.
        sample: (K,), (K,) where in their pixels to look, in pixels from the centres.
    """
    seen = rays.patched
    assert seen is not None
    count = canvas.touched.size
    place, points, box = np.empty((2, count, 64)), np.empty((count, 3, 64)), np.empty((4, count))
    lit = np.zeros((count, 64), dtype=np.bool_)
    owned = np.unpackbits(canvas.owned, axis=1).view(np.bool_)
    points[:, 2] = 1.0
    for some in alike(patches, which):
        at = np.searchsorted(which, some)
        number, values, shown = _of_blocks(rays, patches, seen, canvas, some, at, sample)
        # They ascend, mostly one after another: a range is copied to in half the time.
        first, end = int(number[0]), int(number[-1]) + 1
        tiles = slice(first, end) if end - first == number.size else number
        place[:, tiles] = values
        shown &= owned[tiles]
        lit[tiles] = shown
        # Unlit pixels keep the places of their neighbours in the lattice: no number that spreads.
        dark = None if shown.all() else ~shown
        for k in (0, 1):
            decided = _on_grid(values[k], SHIFT[k])
            points[tiles, k] = decided
            for side, least, beyond in ((2 * k, np.minimum, np.inf), (2 * k + 1, np.maximum, -np.inf)):
                if dark is not None:
                    np.copyto(decided, beyond, where=dark)
                box[side, tiles] = least.reduce(decided, axis=1)
    return Samples(place, points, lit, box, seen.reach[which])


def _on_grid(place: FloatArray, shift: float) -> FloatArray:
    """Places on the grid on which edges are decided, `shift` of its steps further."""
    decided: FloatArray = place / DISPLACED.sample
    decided += shift
    np.rint(decided, out=decided)
    decided *= DISPLACED.sample
    return decided


def _of_blocks(
    rays: QuiltRays,
    patches: Patches,
    seen: Patched,
    canvas: Canvas,
    some: IntArray,
    at: IntArray,
    sample: tuple[FloatArray, FloatArray],
) -> tuple[IntArray, FloatArray, BoolArray]:
    """Microtiles, places (2, m, 64) and lit pixels (m, 64) of patches of one facet and size."""
    view = rays.views[int(patches.facet[some[0]])]
    assert view is not None
    across, down = int(canvas.tiles_across[at[0]]), int(canvas.tiles_down[at[0]])
    width, height = 8 * across, 8 * down
    offset = float(sample[0][at[0]]), float(sample[1][at[0]])
    d = view.rays(*patch_grid(patches, some, width, height, offset))
    matrix = seen.patch_from_eye[some]
    q = [_along(matrix[:, k], d) for k in range(3)]
    shown = np.broadcast_to(seen.sure[some][:, None, None], q[0].shape).copy()
    doubtful = np.flatnonzero(~seen.sure[some])
    if doubtful.size:
        centres = patch_grid(patches, some[doubtful], width, height)
        shown[doubtful] = view.lit(*centres)
    lattice = np.stack(np.broadcast_arrays(np.arange(width), np.arange(height)[:, None])).astype(np.float64)
    lattice += np.array(offset)[:, None, None]
    ahead = q[2] > 0
    over = np.divide(1.0, q[2], out=np.ones_like(q[2]), where=ahead)
    values = np.empty((2, *q[0].shape))
    for k in (0, 1):
        np.multiply(q[k], over, out=values[k])
        # Where there is no ray, or none through this side of the plane, whatever is near.
        good = shown & ahead & np.isfinite(values[k])
        values[k] = np.where(good, values[k], lattice[k])
    tiles = canvas.tile_start[at][:, None] + np.arange(across * down)
    values -= np.array(offset)[:, None, None, None]
    shaped = values.reshape(2, some.size, down, 8, across, 8).transpose(0, 1, 2, 4, 3, 5)
    lit = shown.reshape(some.size, down, 8, across, 8).transpose(0, 1, 3, 2, 4)
    return tiles.reshape(-1), shaped.reshape(2, -1, 64), lit.reshape(-1, 64)


def _along(row: FloatArray, d: FloatArray) -> FloatArray:
    """Row vectors (n, 3) times rays (3, n or 1, h, w), every sum in a fixed order."""
    result: FloatArray = row[:, 0, None, None] * d[0]
    term = row[:, 1, None, None] * d[1]
    result += term
    result += np.multiply(row[:, 2, None, None], d[2], out=term)
    return result
