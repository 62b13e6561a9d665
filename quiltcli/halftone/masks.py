"""Threshold masks: Bayer's, and blue noise by void and cluster.

A mask of n × n ranks tiles the image; a pixel is lit if its tone is above (rank + ½)/n². From image to image
the mask is shifted, so that what is lit does not always stand at the same places.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, IntArray

BLUE = 64
"""Pixels across the void-and-cluster mask."""
# Pixels. A wider one, as in the paper, leaves half-lit areas with domains of checkers, whose seams show.
_SIGMA = 1.0
# Reciprocals of the plastic number and its square: shifts by them leave no two near one another for long
# (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
_SHIFT = (0.7548776662466927, 0.5698402909980532)


def by_mask(
    tones: NDArray[np.floating], inside: BoolArray, ranks: IntArray, positions: Sequence[int]
) -> BoolArray:
    """Bits of images by a mask of thresholds.

    Args:
        tones: (N, H, W) linear light from 0 to 1.
        inside: (H, W) or (N, H, W) pixels that may be lit.
        ranks: (n, n) each of 0 to n² − 1 once.
        positions: (N) numbers of the images, by which the mask is shifted.

    Returns:
        (N, H, W) whether a pixel is lit.
    """
    size = len(ranks)
    thresholds = ((ranks + 0.5) / ranks.size).astype(np.float32)
    y, x = (np.arange(length) for length in tones.shape[1:])
    bits = np.empty(tones.shape, dtype=np.bool_)
    for image, position, out in zip(tones, positions, bits, strict=True):
        across, down = (int(position * step % 1 * size) for step in _SHIFT)
        np.greater(image, thresholds[np.ix_((y + down) % size, (x + across) % size)], out=out)
    bits &= inside
    return bits


@cache
def bayer(power: int = 3) -> IntArray:
    """Bayer's mask (2ⁿ, 2ⁿ) of ranks (*An optimum method for two-level rendition*, 1973)."""
    ranks = np.zeros((1, 1), dtype=np.int64)
    for _ in range(power):
        ranks = np.block([[4 * ranks, 4 * ranks + 2], [4 * ranks + 3, 4 * ranks + 1]])
    return ranks


@cache
def void_cluster(size: int = BLUE) -> IntArray:
    """Mask (size, size) of ranks whose every threshold is blue noise.

    Ulichney, *The void-and-cluster method for dither array generation* (1993). How crowded a place is comes
    from a Gaussian around each point; in whole numbers, so that the same place wins on every machine.
    """
    kernel = _kernel(size)
    points = _begin(size)
    energy = np.zeros((size, size), dtype=np.int64)
    for y, x in np.argwhere(points):
        energy += np.roll(kernel, (y, x), (0, 1))

    def put(at: int, sign: int) -> None:
        y, x = divmod(at, size)
        points[y, x] = sign > 0
        energy[:] += sign * np.roll(kernel, (y, x), (0, 1))

    def tightest() -> int:
        return int(np.argmax(np.where(points, energy, -1)))

    def emptiest() -> int:
        return int(np.argmin(np.where(points, np.iinfo(np.int64).max, energy)))

    while True:  # until the tightest cluster's point falls back into its own place
        cluster = tightest()
        put(cluster, -1)
        void = emptiest()
        put(void, 1)
        if void == cluster:
            break
    ranks = np.zeros(size * size, dtype=np.int64)
    first, crowded = points.copy(), energy.copy()
    for rank in range(int(points.sum()) - 1, -1, -1):
        at = tightest()
        put(at, -1)
        ranks[at] = rank
    points, energy = first, crowded
    for rank in range(int(points.sum()), size * size):
        at = emptiest()
        put(at, 1)
        ranks[at] = rank
    return ranks.reshape(size, size)


def _kernel(size: int) -> IntArray:
    """A Gaussian around pixel (0, 0) of a torus (size, size), its peak 2²⁰."""
    away = [min(k, size - k) for k in range(size)]
    row = [math.exp(-(d * d) / (2 * _SIGMA**2)) for d in away]
    kernel: IntArray = np.rint(np.outer(row, row) * 2**20).astype(np.int64)
    return kernel


def _begin(size: int) -> BoolArray:
    """A tenth of the pixels (size, size), strewn at random but always the same ones."""
    order = np.random.Generator(np.random.PCG64(1993)).random(size * size)
    chosen: BoolArray = order < np.sort(order)[size * size // 10]
    return chosen.reshape(size, size)
