"""Noise filters of runs of samples: positions in metres, rotations as quaternions, each on its own."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import FilterSpec
from quiltcli.viewer.recorded import smoothing
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
        rotations = _turned(rotations, turns)
    return Run(run.times, places(run.positions), rotations)


def _turned(q: FloatArray, smoother: Smoother) -> FloatArray:
    """Rotations (N, 4), smoothed: their components, made unit again.

    Where a filter cuts the sphere's corner it falls short along the radius, which making it unit undoes.
    """
    # Twice a unit quaternion moves as fast as what it turns, so filters may think in radians.
    return quaternions.continuous(quaternions.unit(smoother(2 * q)))


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
