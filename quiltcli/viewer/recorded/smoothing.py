"""Filters of evenly spaced samples, and the smoother of Rauch, Tung and Striebel; all without lag."""

from __future__ import annotations

import math

import numpy as np

from quiltcli.geometry import FloatArray


def savitzky_golay(values: FloatArray, step: float, window: float, order: int) -> FloatArray:
    """Each sample (N, C) replaced by the value of a polynomial fitted to those around it.

    A. Savitzky, M. J. E. Golay, Analytical Chemistry 36 (1964). At the ends the last polynomial is kept.

    Args:
        values: samples.
        step: seconds from one to the next.
        window: seconds that are fitted to.
        order: degree of the polynomials.
    """
    from scipy.signal import savgol_filter

    size = max(2 * round((window / step - 1) / 2) + 1, order + 1 + order % 2)
    size = min(size, len(values) - 1 + len(values) % 2)
    if size <= order:
        return values
    return np.asarray(savgol_filter(values, size, order, axis=0, mode="interp"))


def rauch_tung_striebel(times: FloatArray, values: FloatArray, noise: float, jerk: float) -> FloatArray:
    """The likeliest path (N, C) of something whose acceleration wanders, seen with white noise.

    The mean of the smoother of H. E. Rauch, F. Tung and C. T. Striebel, AIAA Journal 3 (1965), for the state
    place, speed, acceleration that white jerk drives. That mean is the solution of block tridiagonal
    normal equations, which a banded Cholesky factor solves in one go, whatever the steps.

    Args:
        times: (N,) seconds, ascending.
        values: (N, C) measured.
        noise: standard deviation of a measured value.
        jerk: square root of the power density of the third derivative.
    """
    from scipy.linalg import solveh_banded

    if len(times) < 3:
        return values
    scale = float(np.median(np.diff(times)))
    t = np.diff(times) / scale  # the states are place, speed·scale and acceleration·scale²
    move = np.zeros((t.size, 3, 3))
    move[:, 0, 0] = move[:, 1, 1] = move[:, 2, 2] = 1
    move[:, 0, 1] = move[:, 1, 2] = t
    move[:, 0, 2] = t * t / 2
    wander = np.empty_like(move)
    for i, j, power, divisor in ((0, 0, 5, 20), (0, 1, 4, 8), (0, 2, 3, 6), (1, 1, 3, 3), (1, 2, 2, 2)):
        wander[:, i, j] = wander[:, j, i] = t**power / divisor
    wander[:, 2, 2] = t
    weight = np.linalg.inv(wander) * (noise * noise / (jerk * jerk * scale**5))
    across = -np.swapaxes(move, 1, 2) @ weight
    blocks = np.zeros((times.size, 3, 3))
    blocks[:, 0, 0] = 1
    blocks[:-1] -= across @ move
    blocks[1:] += weight
    banded = np.zeros((6, 3 * times.size))
    for i in range(3):
        for j in range(3):
            if i <= j:
                banded[5 + i - j, j::3] = blocks[:, i, j]
            banded[2 + i - j, j + 3 :: 3] = across[:, i, j]
    seen = np.zeros((3 * times.size, values.shape[1]))
    seen[::3] = values
    return np.asarray(solveh_banded(banded, seen, check_finite=False)[::3])


def one_euro(
    values: FloatArray, step: float, min_cutoff: float, beta: float, speed_cutoff: float
) -> FloatArray:
    """The 1 € filter run over samples (N, C) forwards, then backwards over what that gave.

    G. Casiez, N. Roussel, D. Vogel, CHI 2012: a first-order low pass whose cutoff, in Hz, is
    min_cutoff + beta · speed. Here the speed is that of the point, not of each coordinate.
    """
    if len(values) < 3:
        return values
    forwards = _one_way(values, step, min_cutoff, beta, speed_cutoff)
    return _one_way(forwards[::-1], step, min_cutoff, beta, speed_cutoff)[::-1]


def _one_way(
    values: FloatArray, step: float, min_cutoff: float, beta: float, speed_cutoff: float
) -> FloatArray:
    from scipy.linalg import solve_banded
    from scipy.signal import lfilter

    rates = np.diff(values, axis=0) / step
    a = _share(speed_cutoff, step)
    smooth, _ = lfilter([a], [1, a - 1], rates, axis=0, zi=(1 - a) * rates[:1])
    speed = np.sqrt((smooth * smooth).sum(axis=1))
    share = np.concatenate(([1.0], _share(min_cutoff + beta * speed, step)))
    # x'[i] = share·x[i] + (1 − share)·x'[i − 1], all at once: a matrix of two diagonals.
    diagonals = np.stack((np.ones_like(share), np.append(share[1:] - 1, 0.0)))
    return np.asarray(solve_banded((1, 0), diagonals, share[:, None] * values))


def _share(cutoff: FloatArray | float, step: float) -> FloatArray | float:
    """What a new sample counts for in a first-order low pass."""
    return 1 / (1 + 1 / (2 * math.pi * np.asarray(cutoff) * step))
