"""Filters on a take of which the truth is known: 2 mm and 0.5° of white noise at 120 Hz."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quiltcli.job import FilterSpec
from quiltcli.viewer.recorded.clean import Run, white_noise
from quiltcli.viewer.recorded.filters import filtered
from quiltcli.viewer.recorded.smoothing import rauch_tung_striebel

RATE, SECONDS = 120.0, 20.0
KINDS = ("savitzky_golay", "rts", "one_euro")


def truth() -> tuple[np.ndarray, np.ndarray, Rotation]:
    """Somebody who stands before a wall, shifts weight and looks about."""
    t = np.arange(round(RATE * SECONDS)) / RATE
    places = np.stack(
        (
            0.12 * np.sin(2 * np.pi * 0.15 * t),
            1.7 + 0.01 * np.sin(2 * np.pi * 0.6 * t + 1),
            0.08 * np.sin(2 * np.pi * 0.11 * t + 2),
        ),
        axis=1,
    )
    angles = np.stack(
        (
            35 * np.sin(2 * np.pi * 0.1 * t),
            12 * np.sin(2 * np.pi * 0.17 * t),
            5 * np.sin(2 * np.pi * 0.2 * t),
        ),
        axis=1,
    )
    return t, places, Rotation.from_euler("YXZ", angles, degrees=True)


def noisy() -> Run:
    t, places, turns = truth()
    dice = np.random.default_rng(7)
    shaken = Rotation.from_rotvec(np.radians(0.5) * dice.standard_normal(places.shape)) * turns
    return Run(t, places + 0.002 * dice.standard_normal(places.shape), shaken.as_quat())


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values * values)))


def lag(found: np.ndarray, true: np.ndarray) -> int:
    """Samples by which the peak of the cross-correlation of two curves is off, from −30 to 30."""
    middle = slice(60, -60)

    def match(shift: int) -> float:
        late = np.roll(found, -shift, axis=0)[middle]
        parts = [values - values.mean(axis=0) for values in (late, true[middle])]
        return float((parts[0] * parts[1]).sum() / np.sqrt((parts[0] ** 2).sum() * (parts[1] ** 2).sum()))

    return max(range(-30, 31), key=match)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_falls_below_a_third_without_lag(kind: str) -> None:
    _, places, turns = truth()
    raw = noisy()
    assert rms(raw.positions - places) == pytest.approx(0.002, rel=0.05)
    run = filtered(raw, FilterSpec(kind=kind), 1 / RATE)
    assert rms(run.positions - places) < 0.0007
    assert lag(run.positions, places) == 0
    assert run.rotations is not None
    left = (Rotation.from_quat(run.rotations) * turns.inv()).as_rotvec(degrees=True)
    assert rms(left) < 0.35 * 0.5
    assert lag(Rotation.from_quat(run.rotations).as_matrix()[:, 2], turns.as_matrix()[:, 2]) == 0


@pytest.mark.parametrize("kind", KINDS)
def test_filters_run_the_same_forwards_and_backwards_but_for_one_euro(kind: str) -> None:
    raw = noisy()
    back = Run(raw.times, raw.positions[::-1].copy(), None)
    there = filtered(Run(raw.times, raw.positions, None), FilterSpec(kind=kind), 1 / RATE).positions
    again = filtered(back, FilterSpec(kind=kind), 1 / RATE).positions[::-1]
    assert np.abs(there - again)[30:-30].max() < (1e-8 if kind != "one_euro" else 1e-3)


def test_savitzky_golay_leaves_cubics_alone() -> None:
    t = np.arange(100) / 100
    cubic = np.stack((t**3, 1 - t * t, t), axis=1)
    run = filtered(Run(t, cubic, None), FilterSpec(kind="savitzky_golay", window=0.2, order=3), 0.01)
    assert np.abs(run.positions - cubic).max() < 1e-12


def test_rauch_tung_striebel_is_that_of_the_recursions() -> None:
    dice = np.random.default_rng(3)
    times = np.cumsum(dice.uniform(0.005, 0.02, 60))
    values = np.sin(5 * times)[:, None] + 0.01 * dice.standard_normal((60, 1))
    noise, jerk = 0.01, 40.0
    found = rauch_tung_striebel(times, values, noise, jerk)[:, 0]
    assert found == pytest.approx(recursions(times, values[:, 0], noise, jerk), abs=1e-6)


def recursions(times: np.ndarray, values: np.ndarray, noise: float, jerk: float) -> np.ndarray:
    """The Kalman filter and the smoother behind it, step by step, from next to no knowledge of the start."""
    state, spread = np.array([values[0], 0.0, 0.0]), np.diag([1e2, 1e4, 1e6])
    seen = np.array([[1.0, 0.0, 0.0]])
    states, spreads, ahead = [], [], []
    for k, value in enumerate(values):
        if k:
            d = times[k] - times[k - 1]
            move = np.array([[1, d, d * d / 2], [0, 1, d], [0, 0, 1]])
            wander = jerk**2 * np.array(
                [[d**5 / 20, d**4 / 8, d**3 / 6], [d**4 / 8, d**3 / 3, d**2 / 2], [d**3 / 6, d**2 / 2, d]]
            )
            state, spread = move @ state, move @ spread @ move.T + wander
            ahead.append((move, state, spread))
        gain = spread @ seen.T / (seen @ spread @ seen.T + noise**2)
        state = state + gain[:, 0] * (value - state[0])
        keep = np.eye(3) - gain @ seen
        spread = keep @ spread @ keep.T + gain @ gain.T * noise**2
        states.append(state)
        spreads.append(spread)
    best = states[-1]
    found = [best[0]]
    for k in range(len(values) - 2, -1, -1):
        move, guess, wide = ahead[k]
        back = spreads[k] @ move.T @ np.linalg.inv(wide)
        best = states[k] + back @ (best - guess)
        found.append(best[0])
    return np.array(found[::-1])


def test_uneven_stamps_are_made_even_for_filters_that_want_that() -> None:
    t = np.sort(np.random.default_rng(1).uniform(0, 2, 300))
    t[0], t[-1] = 0, 2
    line = np.outer(t, [1.0, -2.0, 0.5])
    run = filtered(Run(t, line, None), FilterSpec(kind="savitzky_golay"), 1 / 150)
    assert np.diff(run.times) == pytest.approx(1 / 150)
    assert np.abs(run.positions - np.outer(run.times, [1.0, -2.0, 0.5])).max() < 1e-9


def test_noise_is_measured_whatever_the_motion() -> None:
    assert white_noise(noisy().positions) == pytest.approx(0.002, rel=0.05)
    assert white_noise(truth()[1]) < 2e-6


@pytest.mark.parametrize("kind", KINDS)
def test_turning_all_the_way_round_is_smooth(kind: str) -> None:
    t = np.arange(600) / RATE
    turns = Rotation.from_rotvec(np.outer(2 * math.pi * t / 2.5, [0, 1, 0]))
    run = filtered(Run(t, np.zeros((600, 3)), turns.as_quat()), FilterSpec(kind=kind), 1 / RATE)
    assert run.rotations is not None
    off = (Rotation.from_quat(run.rotations) * turns.inv()).magnitude()
    assert np.degrees(off[60:-60].max()) < (0.01 if kind != "one_euro" else 2)
