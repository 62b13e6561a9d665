"""Poses of a run between its samples, and runs at even times."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, quaternions
from quiltcli.geometry.interpolation import arc, linear, smooth, squad
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
    """Index (M,) of the sample before each time (M,), and the share of the step that has passed."""
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    return k, np.clip((at - times[k]) / (times[k + 1] - times[k]), 0, 1)
