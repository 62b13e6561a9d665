"""Poses between samples: places on cubic Hermite curves, rotations on Shoemake's spherical quadrangles."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.viewer.interpolation import linear, smooth
from quiltcli.viewer.recorded import quaternions
from quiltcli.viewer.recorded.clean import Run

# Stamps that differ from an even beat by less than this share of a step are even.
_EVEN = 0.02


def pose_at(run: Run, time: float, *, straight: bool = False) -> tuple[FloatArray, FloatArray | None]:
    """Place (3,) and rotation (4,) of a run at a time; its ends are held.

    Args:
        run: good samples.
        time: seconds.
        straight: straight lines and great arcs, for knots of curves that are such.
    """
    position = (linear if straight else smooth)(run.times, run.positions, time)
    if run.rotations is None:
        return position, None
    return position, (arc if straight else squad)(run.times, run.rotations, time)


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


def evenly(run: Run, step: float, *, straight: bool = False) -> Run:
    """A run at even times, itself where it is so already."""
    span = float(run.times[-1] - run.times[0])
    count = max(round(span / step), 1) + 1 if step > 0 else len(run.times)
    even = np.linspace(run.times[0], run.times[-1], count)
    if count == len(run.times) and np.abs(even - run.times).max() <= _EVEN * step:
        return run
    rotations = None
    if run.rotations is not None:
        k, share = _places(run.times, even)
        rotations = quaternions.continuous(quaternions.slerp(run.rotations[k], run.rotations[k + 1], share))
    return Run(even, places_at(run, even, straight=straight), rotations)


def places_at(run: Run, times: FloatArray, *, straight: bool = False) -> FloatArray:
    """Places (M, 3) of a run at many times (M,) within it, on the same curves as `pose_at`."""
    if straight or len(run.times) < 3:
        return np.stack([np.interp(times, run.times, column) for column in run.positions.T], axis=1)
    step = np.diff(run.times)[:, None]
    slope = np.diff(run.positions, axis=0) / step
    # The slope of the parabola through a sample and its neighbours; at the ends, through the last three.
    inner = (slope[:-1] * step[1:] + slope[1:] * step[:-1]) / (step[:-1] + step[1:])
    tangent = np.concatenate((2 * slope[:1] - inner[:1], inner, 2 * slope[-1:] - inner[-1:]))
    k, t = _places(run.times, times)
    t, h = t[:, None], step[k]
    a, b = (1 + 2 * t) * (1 - t) ** 2, t * t * (3 - 2 * t)
    ends = a * run.positions[k] + b * run.positions[k + 1]
    return np.asarray(ends + h * (t * (1 - t) ** 2 * tangent[k] - t * t * (1 - t) * tangent[k + 1]))


def _places(times: FloatArray, at: FloatArray) -> tuple[IntArray, FloatArray]:
    """As `_between`, for many times (M,)."""
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    return k, np.clip((at - times[k]) / (times[k + 1] - times[k]), 0, 1)
