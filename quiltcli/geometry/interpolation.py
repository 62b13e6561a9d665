"""Values and rotations between samples: held, on straight lines or great arcs, or on smooth curves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from quiltcli.geometry import FloatArray, quaternions


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


def _between(times: FloatArray, time: float) -> tuple[int, float]:
    """Index of the sample before a time, and the share of the step that has passed."""
    last = len(times) - 1
    if time <= times[0] or last == 0:
        return 0, 0.0
    if time >= times[-1]:
        return last - 1, 1.0
    k = int(np.searchsorted(times, time, side="right")) - 1
    return k, float((time - times[k]) / (times[k + 1] - times[k]))


def arc(times: FloatArray, q: FloatArray, time: float) -> FloatArray:
    """Rotation (4,) on the great arc between the samples (N, 4) around a time; the ends are held."""
    k, share = _between(times, time)
    if share in (0.0, 1.0):
        end: FloatArray = q[k + int(share)]
        return end
    return quaternions.slerp(q[k], q[k + 1], share)


def squad(times: FloatArray, q: FloatArray, time: float) -> FloatArray:
    """Rotation (4,) on a smooth curve through the samples (N, 4) at a time; the ends are held.

    K. Shoemake, Quaternion Calculus and Fast Animation, SIGGRAPH course notes 10 (1987).
    """
    k, share = _between(times, time)
    if share in (0.0, 1.0):
        end: FloatArray = q[k + int(share)]
        return end
    outer = quaternions.slerp(q[k], q[k + 1], share)
    inner = quaternions.slerp(_handle(q, k), _handle(q, k + 1), share)
    return quaternions.slerp(outer, inner, 2 * share * (1 - share))


def _handle(q: FloatArray, k: int) -> FloatArray:
    """Inner quadrangle point (4,) of a sample; at the ends the sample itself."""
    if k in (0, len(q) - 1):
        result: FloatArray = q[k]
        return result
    back = quaternions.inverse(q[k])
    ways = quaternions.logarithm(quaternions.product(back, q[[k - 1, k + 1]]))
    return quaternions.product(q[k], quaternions.exponential(-ways.sum(axis=0) / 4))


VALUES: dict[str, Callable[[FloatArray, FloatArray, float], FloatArray]] = {
    "linear": linear,
    "smooth": smooth,
    "hold": hold,
}
TURNINGS: dict[str, Callable[[FloatArray, FloatArray, float], FloatArray]] = {
    "linear": arc,
    "smooth": squad,
    "hold": hold,
}
