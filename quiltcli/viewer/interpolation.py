"""Values between samples: held, on straight lines, or on smooth curves."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray


def hold(x: FloatArray, y: FloatArray, at: float) -> FloatArray:
    """Value (C,) of the last sample y (K, C) at or before `at`, samples standing at x (K,) ascending."""
    last = int(np.searchsorted(x, at, side="right")) - 1
    result: FloatArray = y[max(last, 0)]
    return result


def linear(x: FloatArray, y: FloatArray, at: float) -> FloatArray:
    """Straight line (C,) between the samples y (K, C) at x (K,), the ends held."""
    return np.array([np.interp(at, x, column) for column in y.T])


def smooth(x: FloatArray, y: FloatArray, at: float) -> FloatArray:
    """Cubic Hermite curve (C,) through the samples y (K, C) at x (K,), the ends held.

    Tangents are those of the parabola through each sample and its two neighbours (parabolic
    blending, A. W. Overhauser 1968; on even samples the Catmull-Rom spline). The curve is C1, and
    exact where the samples lie on a parabola.
    """
    if not x[0] < at < x[-1] or x.size < 3:
        return linear(x, y, at)
    i = int(np.searchsorted(x, at, side="right")) - 1
    h = x[i + 1] - x[i]
    t = (at - x[i]) / h
    m0, m1 = _tangent(x, y, i) * h, _tangent(x, y, i + 1) * h
    a, b = (1 + 2 * t) * (1 - t) ** 2, t * t * (3 - 2 * t)
    result: FloatArray = a * y[i] + b * y[i + 1] + t * (1 - t) ** 2 * m0 - t * t * (1 - t) * m1
    return result


def _tangent(x: FloatArray, y: FloatArray, i: int) -> FloatArray:
    """Slope (C,) at sample i of the parabola through it and its neighbours, or the three at the end."""
    j = min(max(i, 1), x.size - 2)
    h0, h1 = x[j] - x[j - 1], x[j + 1] - x[j]
    s0, s1 = (y[j] - y[j - 1]) / h0, (y[j + 1] - y[j]) / h1
    result: FloatArray = s0 + (s1 - s0) * (h0 + 2 * (x[i] - x[j])) / (h0 + h1)
    return result
