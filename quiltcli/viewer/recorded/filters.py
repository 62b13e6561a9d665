"""Noise filters of runs of samples: positions in metres, rotations by their logarithms, each on its own."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.job import FilterSpec
from quiltcli.viewer.recorded import quaternions, smoothing
from quiltcli.viewer.recorded.clean import Run
from quiltcli.viewer.recorded.resample import evenly

Smoother = Callable[[FloatArray], FloatArray]


def filtered(run: Run, spec: FilterSpec, step: float, *, straight: bool = False) -> Run:
    """A run with less noise, at the same or evenly spaced times.

    Args:
        run: good samples.
        spec: which filter.
        step: usual seconds from one sample to the next.
        straight: whether the run goes straight from sample to sample.
    """
    if spec.kind == "none" or len(run.times) < 3:
        return run
    if spec.kind != "rts":
        run = evenly(run, step, straight=straight)
        step = float(run.times[-1] - run.times[0]) / (len(run.times) - 1)
    places, turns = FILTERS[spec.kind](spec, run.times, step)
    rotations = run.rotations
    if rotations is not None:
        rotations = _turned(rotations, turns, refine=spec.kind != "one_euro")
    return Run(run.times, places(run.positions), rotations)


def _turned(q: FloatArray, smoother: Smoother, *, refine: bool) -> FloatArray:
    """Rotations (N, 4), smoothed.

    Smoothed components, made unit again, are near the mean rotation but cut the corner of a sphere.
    What is left is a small rotation vector, a matter of flat space, and is smoothed once more.
    """
    # Twice a unit quaternion moves as fast as what it turns, so radians may be thought of.
    near = quaternions.unit(smoother(2 * q))
    if refine:
        left = quaternions.logarithm(quaternions.product(quaternions.inverse(near), q))
        near = quaternions.product(near, quaternions.exponential(smoother(left)))
    return quaternions.continuous(near)


def _savitzky_golay(spec: FilterSpec, times: FloatArray, step: float) -> tuple[Smoother, Smoother]:
    window, order = spec.window or 0.2, 3 if spec.order is None else spec.order

    def smoother(values: FloatArray) -> FloatArray:
        return smoothing.savitzky_golay(values, step, window, order)

    return smoother, smoother


def _rts(spec: FilterSpec, times: FloatArray, step: float) -> tuple[Smoother, Smoother]:
    noise, jerk = spec.position_noise or 0.002, spec.jerk or 3.0
    turn_noise = math.radians(spec.rotation_noise_deg or 0.5)
    turn_jerk = math.radians(spec.turn_jerk_deg or 1000.0)
    return (
        lambda values: smoothing.rauch_tung_striebel(times, values, noise, jerk),
        lambda values: smoothing.rauch_tung_striebel(times, values, turn_noise, turn_jerk),
    )


def _one_euro(spec: FilterSpec, times: FloatArray, step: float) -> tuple[Smoother, Smoother]:
    speed = spec.speed_cutoff or 1.0
    place = spec.min_cutoff or 2.0, 12.0 if spec.beta is None else spec.beta
    turn = spec.rotation_min_cutoff or 2.0, 6.0 if spec.rotation_beta is None else spec.rotation_beta
    return (
        lambda values: smoothing.one_euro(values, step, *place, speed),
        lambda values: smoothing.one_euro(values, step, *turn, speed),
    )


FILTERS: dict[str, Callable[[FilterSpec, FloatArray, float], tuple[Smoother, Smoother]]] = {
    "savitzky_golay": _savitzky_golay,
    "rts": _rts,
    "one_euro": _one_euro,
}


def change_mm(before: Run, after: Run) -> FloatArray:
    """How far (n,) each sample of a run was moved by its filter, millimetres."""
    if after.times is before.times:
        moved = after.positions - before.positions
    else:
        at = np.stack([np.interp(before.times, after.times, column) for column in after.positions.T], axis=1)
        moved = at - before.positions
    return np.asarray(1000 * np.sqrt((moved * moved).sum(axis=1)))
