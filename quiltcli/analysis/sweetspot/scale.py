"""Colours of distortion: blue where it is borne, orange to red where it is not, and the bitmap of a map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.sweetspot.floor import Floor
from quiltcli.geometry import FloatArray

STEPS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Where one colour ends and the next begins, in limits."""
COLOURS = ("#1d4f91", "#3a7ebd", "#72b0d7", "#b5d9ea", "#fde3a7", "#fbb566", "#f17f45", "#d6452f", "#8f1a2b")
"""From none to most: their lightness alone tells them apart on either side of the limit."""
UNSEEN = ("#343a45", "#2a2f38")
"""Stripes of places from which nothing is seen."""


def heat(floor: Floor, values: FloatArray, limit: float, width: int, height: int) -> NDArray[np.uint8]:
    """A map (nz, nx) as a bitmap (height, width, 3) from its least x and z to its greatest.

    Values are bilinear between places. A pixel between places of which one is unseen is as its nearest one.
    """
    row, down = _places(floor.z, height)
    column, right = _places(floor.x, width)
    corners = [values[np.ix_(row + i, column + j)] for i in (0, 1) for j in (0, 1)]
    down, right = down[:, None], right[None, :]
    smooth = (corners[0] * (1 - right) + corners[1] * right) * (1 - down)
    smooth = smooth + (corners[2] * (1 - right) + corners[3] * right) * down
    nearest = values[np.ix_(row + (down[:, 0] >= 0.5), column + (right[0] >= 0.5))]
    value = np.where(np.isnan(smooth), nearest, smooth)
    table = np.array([[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in COLOURS + UNSEEN])
    band = np.searchsorted(np.array(STEPS) * limit, value, side="left")
    stripe = (np.add.outer(np.arange(height), np.arange(width)) // 6) % 2
    band = np.where(np.isnan(value), len(COLOURS) + stripe, np.minimum(band, len(COLOURS) - 1))
    return table[band].astype(np.uint8)


def _places(marks: FloatArray, count: int) -> tuple[NDArray[np.int64], FloatArray]:
    """Cell and place in it, 0 to 1, of the middles of `count` pixels."""
    at = (np.arange(count) + 0.5) / count * (len(marks) - 1)
    cell = np.minimum(at.astype(np.int64), len(marks) - 2)
    return cell, at - cell


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two, `most` at the most, their step 1, 2 or 5 times a power of ten."""
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = next(digit * power for digit in (1, 2, 5, 10) if digit * power >= least * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [k * step for k in range(first, last + 1)]
