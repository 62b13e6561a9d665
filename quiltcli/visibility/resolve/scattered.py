"""Planes of surfaces at pixels that lie anywhere, one look-up of a row each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import IntArray


def values_at(
    planes: NDArray[Any],
    which: IntArray,
    x: NDArray[Any],
    y: NDArray[Any],
    x0: NDArray[Any],
    y0: NDArray[Any],
) -> NDArray[Any]:
    """Values (n, G, 1) of n planes (n, 3, S) of surfaces.

    Args:
        planes: the planes, from places of their own.
        which: (G,) which surface each pixel sees.
        x: (G,) columns in the block.
        y: (G,) rows.
        x0: (S,) columns at which the planes begin.
        y0: (S,) rows.
    """
    # One look-up of a row takes as long as one of a single number.
    count = 3 * len(planes)
    table = np.empty((x0.size, count + 2), dtype=planes.dtype)
    table[:, :count] = planes.reshape(count, -1).T
    table[:, count], table[:, count + 1] = x0, y0
    table = table.take(which, axis=0)
    x, y = x - table[:, count], y - table[:, count + 1]
    result = np.empty((len(planes), which.size, 1), dtype=planes.dtype)
    for k in range(len(planes)):
        plane_values(table[:, 3 * k :], x, y, result[k, :, 0])
    return result


def plane_values(rows: NDArray[Any], x: NDArray[Any], y: NDArray[Any], result: NDArray[Any]) -> NDArray[Any]:
    """Put into `result` (G,) the values of planes given in rows (G, 3 or more)."""
    np.multiply(rows[:, 0], x, out=result)
    result += rows[:, 1] * y
    result += rows[:, 2]
    return result
