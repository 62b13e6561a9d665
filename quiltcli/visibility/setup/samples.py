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
        points: (M, 2, 64) the same on the grid on which edges are decided.
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
    # Every microtile is one of a patch, and is written.
    place, lit = np.empty((2, count, 64)), np.empty((count, 64), dtype=np.bool_)
    owned = np.unpackbits(canvas.owned, axis=1).view(np.bool_)
    for some in alike(patches, which):
        at = np.searchsorted(which, some)
        tiles, values, shown = _of_blocks(rays, patches, seen, canvas, some, at, sample)
        place[:, tiles] = values
        lit[tiles] = shown & owned[tiles]
    # Unlit pixels keep the places of their neighbours in the lattice: no number that spreads.
    points = np.empty((count, 2, 64))
    box = np.empty((4, count))
    partly = np.flatnonzero(~lit.all(axis=1))
    for k in (0, 1):
        decided = place[k] * (1 / DISPLACED.sample)
        decided += SHIFT[k]
        np.rint(decided, out=decided)
        decided *= DISPLACED.sample
        decided.min(axis=1, out=box[2 * k])
        decided.max(axis=1, out=box[2 * k + 1])
        some_lit, some_of = lit[partly], decided[partly]
        box[2 * k, partly] = np.where(some_lit, some_of, np.inf).min(axis=1)
        box[2 * k + 1, partly] = np.where(some_lit, some_of, -np.inf).max(axis=1)
        points[:, k] = decided
    return Samples(place, points, lit, box, seen.reach[which])


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
    shape = np.broadcast_shapes(d.shape[1:], (some.size, height, width))
    q, part = np.empty((3, *shape)), np.empty(shape)
    for k in range(3):
        # Products summed in order, in memory that is there.
        np.multiply(matrix[:, k, 0, None, None], d[0], out=q[k])
        q[k] += np.multiply(matrix[:, k, 1, None, None], d[1], out=part)
        q[k] += np.multiply(matrix[:, k, 2, None, None], d[2], out=part)
    shown = np.broadcast_to(seen.sure[some][:, None, None], shape).copy()
    doubtful = np.flatnonzero(~seen.sure[some])
    if doubtful.size:
        centres = patch_grid(patches, some[doubtful], width, height)
        shown[doubtful] = view.lit(*centres)
    ahead = q[2] > 0
    if not ahead.all():
        part[:] = 1.0
    over = np.divide(1.0, q[2], out=part, where=ahead)
    values = q[:2]
    values *= over
    shown_ahead = shown & ahead
    with np.errstate(all="ignore"):
        finite = bool(np.isfinite(values.sum()))
    if not (finite and shown_ahead.all()):
        # Where there is no ray, or none through this side of the plane, whatever is near.
        columns, rows = np.arange(float(width)), np.arange(float(height))[:, None]
        lattice = np.stack(np.broadcast_arrays(columns, rows))
        lattice += np.array(offset)[:, None, None]
        for k in (0, 1):
            good = shown_ahead & np.isfinite(values[k])
            np.copyto(values[k], lattice[k], where=~good)
    if any(offset):
        values -= np.array(offset)[:, None, None, None]
    tiles = canvas.tile_start[at][:, None] + np.arange(across * down)
    shaped = values.reshape(2, some.size, down, 8, across, 8).transpose(0, 1, 2, 4, 3, 5)
    lit = shown.reshape(some.size, down, 8, across, 8).transpose(0, 1, 3, 2, 4)
    return tiles.reshape(-1), shaped.reshape(2, -1, 64), lit.reshape(-1, 64)
