"""Error diffusion over many images at once.

A pixel is lit if its tone, and the error that reached it, come to ½ or more. Its own error is shared among
three neighbours: the next one in the row, the one below, and the one below behind. Rows are walked
alternately in both directions, so a row starts where the last one ended and nothing within an image can be
done at the same time; but the images of a turn can. They stand along the last axis, where numpy is fast,
and a pixel takes four calls for all images together.

The sums are float32 in a fixed order, `(tone + (below + behind)) + next`, so an image has the same bits
alone, among others, and by the definition written out for one pixel at a time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, Float32Array
from quiltcli.halftone.keys import LEVELS

HALF = np.float32(0.5)


def diffuse(tones: NDArray[np.floating], inside: BoolArray, shares: Float32Array) -> BoolArray:
    """Bits of images by error diffusion, row by row in alternate directions.

    Args:
        tones: (N, H, W) linear light from 0 to 1; what lies outside is cut.
        inside: (H, W) or (N, H, W) pixels that may be lit; error that would leave them is dropped.
        shares: (256, 3) by level, for the next pixel, the one below behind and the one below.

    Returns:
        (N, H, W) whether a pixel is lit.
    """
    bits = np.zeros(tones.shape, dtype=np.bool_)
    count, height, _ = tones.shape
    inside = np.broadcast_to(inside, (len(inside) if inside.ndim == 3 else 1, *tones.shape[1:]))
    top, bottom, left, right = _box(inside)
    here = _columns(inside[:, top, left:right]) if bottom > top else None
    below = np.zeros((right - left, count), dtype=np.float32)
    carry = np.empty(count, dtype=np.float32)
    for y in range(top, bottom):
        assert here is not None
        under = _columns(inside[:, y + 1, left:right]) if y + 1 < height else np.zeros_like(here)
        way = slice(None, None, 1 - 2 * (y % 2))
        value, (near, behind, down) = _row(tones[:, y, left:right], here, shares)
        value += below
        lit = np.empty(value.shape, dtype=np.bool_)
        carry[:] = 0
        for v, b, w in zip(value[way], lit[way], near[way], strict=True):
            np.add(v, carry, out=v)
            np.greater_equal(v, HALF, out=b)
            np.subtract(v, b, out=v)
            np.multiply(v, w, out=carry)
        bits[:, y, left:right] = (lit & here).T
        np.multiply(value, down, out=below)
        np.multiply(value, behind, out=behind)
        # What a pixel sends back stands below the one it came from.
        below[way][:-1] += behind[way][1:]
        below *= under
        here = under
    return bits


def wavefront(tone: Float32Array, inside: BoolArray, shares: Float32Array) -> tuple[BoolArray, Float32Array]:
    """Bits of one image by error diffusion, every row from left to right.

    Pixels (x, y) with the same x + 2y do not wait for one another, and are done together.

    Args:
        tone: (H, W) linear light, and what was added to it.
        inside: (H, W) pixels that may be lit; error that would leave them is dropped.
        shares: as for `diffuse`.

    Returns:
        (H, W) whether a pixel is lit, and (H, W) its error.
    """
    height, width = tone.shape
    y, x = np.mgrid[:height, :width]
    at = (x + 2 * y + 2, y + 1)  # two steps and one row before the first
    steps = width + 2 * height + 2
    value, lit, live = (np.zeros((steps, height + 1), kind) for kind in (np.float32, np.bool_, np.bool_))
    value[at], live[at] = tone, inside
    weights = np.zeros((3, steps, height + 1), np.float32)
    weights[(slice(None), *at)] = shares.T[:, _levels(tone)]
    weights *= live
    near, behind, down = weights
    for t in range(2, steps):
        v, now = value[t, 1:], live[t, 1:]
        # The pixel above is two steps back, the one above it to the right, to which this is behind, one.
        v += (down[t - 2, :-1] * value[t - 2, :-1] + behind[t - 1, :-1] * value[t - 1, :-1]) * now
        v += near[t - 1, 1:] * value[t - 1, 1:]
        np.greater_equal(v, HALF, out=lit[t, 1:])
        v -= lit[t, 1:]
    return lit[at] & inside, value[at] * inside


def _row(
    tones: NDArray[np.floating], here: BoolArray, shares: Float32Array
) -> tuple[Float32Array, NDArray[np.float32]]:
    """A row of all images: tones (W, N) from 0 to 1, and shares (3, W, N) of their errors."""
    value = np.ascontiguousarray(tones.T, dtype=np.float32)
    np.clip(value, 0, 1, out=value)
    value = value * here
    weights = shares.T[:, _levels(value)]
    weights *= here
    return value, weights


def _levels(tones: Float32Array) -> NDArray[np.uint8]:
    levels: NDArray[np.uint8] = np.rint(np.clip(tones, 0, 1) * np.float32(LEVELS - 1)).astype(np.uint8)
    return levels


def _columns(row: BoolArray) -> BoolArray:
    return np.ascontiguousarray(row.T)


def _box(inside: BoolArray) -> tuple[int, int, int, int]:
    """First row, row after the last, first column, column after the last of what may be lit."""
    rows, columns = (np.flatnonzero(inside.any(axis=axes)) for axes in ((0, 2), (0, 1)))
    if not rows.size:
        return 0, 0, 0, 0
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
