"""From what a tracker wrote to runs of good samples: doubled stamps merged, gaps found, spikes left out.

A lost sample is never a zero, and nothing is ever extrapolated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from quiltcli.errors import ViewerError
from quiltcli.geometry import BoolArray, FloatArray, IntArray, dot, quaternions
from quiltcli.job import GapsSpec
from quiltcli.viewer.recorded.take import Take, wrong

SAME_STAMP = 1e-9
# Samples so much farther apart than usual have lost ones between them.
_LATE = 1.5
# Two samples of noise σ rarely are farther apart than ten of it.
_NOISE = 10.0


@dataclass(frozen=True)
class Run:
    """Good samples without a gap.

    Attributes:
        times: (n,) seconds, ascending.
        positions: (n, 3) metres.
        rotations: (n, 4), neighbours on one side of the sphere; or None.
    """

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray | None


@dataclass(frozen=True)
class Gap:
    """Seconds between two runs, and whether that is a jump from one sample to the next, not a gap."""

    first: float
    last: float
    is_jump: bool

    @property
    def seconds(self) -> float:
        """Its length."""
        return self.last - self.first


@dataclass(frozen=True)
class Cleaned:
    """The runs of a take, and what was found on the way.

    Attributes:
        runs: in order.
        gaps: between each run and the next.
        filled: gaps inside runs, which interpolation closes.
        step: usual seconds from one sample to the next.
        lost: samples that were not seen.
        doubled: samples merged with another of the same stamp.
        spikes: (S,) seconds of samples that jump away and back, left out.
        noise: standard deviation of a coordinate from one sample to the next, metres.
        turn_noise: the same of an angle, radians; None without rotations.
        turns: (R,) seconds at which the head turns faster than anybody's, and stays so; no gaps.
    """

    runs: tuple[Run, ...]
    gaps: tuple[Gap, ...]
    filled: tuple[Gap, ...]
    step: float
    lost: int
    doubled: int
    spikes: FloatArray
    noise: float
    turn_noise: float | None
    turns: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def jumps(self) -> tuple[Gap, ...]:
        """The gaps that are jumps."""
        return tuple(gap for gap in self.gaps if gap.is_jump)


def clean(take: Take, spec: GapsSpec) -> Cleaned:
    """The runs of good samples of a take.

    Raises:
        ViewerError: stamps go backwards, or no sample is good.
    """
    _check_stamps(take)
    merged, doubled = _merged(take)
    good = ~merged.lost
    if not good.any():
        words = f"every sample of {take.subject} is lost"
        raise wrong(take.path, words)
    step = float(np.median(np.diff(merged.times))) if len(merged.times) > 1 else 0.0
    times, positions = merged.times[good], merged.positions[good]
    rotations = None if merged.rotations is None else quaternions.continuous(merged.rotations[good])
    noise = white_noise(positions)
    turn_noise = None if rotations is None else white_noise(_turn_steps(rotations))
    kept = np.ones(len(times), dtype=np.bool_)
    if not take.is_curve:
        kept = ~_spikes(times, _ways(positions, spec, noise), spec, step)
        if rotations is not None:
            kept &= ~_spikes(times, _turns(rotations, spec, turn_noise or 0.0), spec, step)
    spikes = times[~kept]
    times, positions = times[kept], positions[kept]
    rotations = None if rotations is None else rotations[kept]
    jump = _ways(positions, spec, noise).jumps(times) & (not take.is_curve)
    turned = np.zeros(len(jump), dtype=np.bool_)
    if rotations is not None and not take.is_curve:
        turned = _turns(rotations, spec, turn_noise or 0.0).jumps(times)
    apart = np.diff(times)
    late = (apart > _LATE * step) & (not take.is_curve)
    cuts = np.flatnonzero(jump | (late & (apart > spec.fill + SAME_STAMP)))
    bounds = [0, *(cuts + 1).tolist(), len(times)]
    parts = [slice(a, b) for a, b in pairwise(bounds)]
    runs = tuple(Run(times[p], positions[p], None if rotations is None else rotations[p]) for p in parts)
    filled = np.flatnonzero(late & ~np.isin(np.arange(len(apart)), cuts))
    return Cleaned(
        runs=runs,
        gaps=tuple(Gap(float(times[k]), float(times[k + 1]), not bool(late[k])) for k in cuts),
        filled=tuple(Gap(float(times[k]), float(times[k + 1]), is_jump=False) for k in filled),
        step=step,
        lost=int(np.count_nonzero(take.lost)),
        doubled=doubled,
        spikes=spikes,
        noise=noise,
        turn_noise=turn_noise,
        turns=times[1:][turned],
    )


def white_noise(values: FloatArray) -> float:
    """Standard deviation of the noise of a coordinate, from samples (N, C) of something smooth.

    A head hardly changes its acceleration between two samples, noise does: the third difference of white
    noise has twenty times its variance. The median of its size keeps gaps and jumps out of it.
    """
    if len(values) < 8:
        return 0.0
    third = np.abs(np.diff(values, n=3, axis=0))
    sigma = np.median(third, axis=0) / 0.6744897501960817 / np.sqrt(20)
    return float(np.sqrt(np.mean(sigma * sigma)))


def _turn_steps(rotations: FloatArray) -> FloatArray:
    """Rotation vectors (N, 3), radians, of samples as seen from others nearby, all in one piece."""
    # Twice the vector part, seen from a rotation nearby, is the angle about each axis; over the whole take
    # the sums of small steps do as well.
    steps = quaternions.logarithm(quaternions.product(quaternions.inverse(rotations[:-1]), rotations[1:]))
    return np.cumsum(steps, axis=0)


def _check_stamps(take: Take) -> None:
    back = np.flatnonzero(np.diff(take.times) < -SAME_STAMP)
    if back.size:
        row = int(back[0]) + 1
        words = f"its time goes back from {take.times[row - 1]:.6f} to {take.times[row]:.6f} s"
        raise ViewerError(take.problem(row, words))


def _merged(take: Take) -> tuple[Take, int]:
    """The take with one sample a stamp, the mean of the good ones; and how many that leaves out."""
    starts = np.concatenate(([True], np.diff(take.times) > SAME_STAMP))
    doubled = int(np.count_nonzero(~starts))
    if not doubled:
        return take, 0
    group = np.cumsum(starts) - 1
    good = ~take.lost
    count = np.bincount(group[good], minlength=group[-1] + 1)
    share = 1 / np.where(count > 0, count, np.nan)
    positions = _group_sums(take.positions, group, good) * share[:, None]
    rotations = None
    if take.rotations is not None:
        q = take.rotations.copy()
        q[good] = quaternions.continuous(q[good])
        rotations = quaternions.unit(_group_sums(q, group, good) * share[:, None])
    lines = None if take.lines is None else take.lines[starts]
    lost = count == 0
    times = take.times[starts]
    return replace(
        take, times=times, positions=positions, rotations=rotations, lost=lost, lines=lines
    ), doubled


def _group_sums(values: FloatArray, group: np.ndarray, good: BoolArray) -> FloatArray:
    """Sums (G, C) of the good ones of each group."""
    size = int(group[-1]) + 1
    return np.stack(
        [np.bincount(group[good], weights=column, minlength=size) for column in values[good].T], axis=1
    )


@dataclass(frozen=True)
class _Motion:
    """How far samples are from one another, and how far anybody gets.

    Attributes:
        between: distances (k,) of samples from others, both given by index.
        speed: the greatest that is believed, in distances a second.
        slack: what noise alone may make of a distance.
    """

    between: Callable[[IntArray, IntArray], FloatArray]
    speed: float
    slack: float

    def too_far(self, times: FloatArray, first: IntArray, last: IntArray) -> BoolArray:
        """Whether nobody gets from some samples (k,) to later ones."""
        return np.asarray(self.between(first, last) > self.speed * (times[last] - times[first]) + self.slack)

    def jumps(self, times: FloatArray) -> BoolArray:
        """Whether each sample (N,) is too far from the next (N − 1,) for anybody to get there."""
        first = np.arange(max(len(times) - 1, 0))
        return self.too_far(times, first, first + 1)


def _ways(positions: FloatArray, spec: GapsSpec, noise: float) -> _Motion:
    """Distances of places (N, 3), metres."""

    def between(first: IntArray, last: IntArray) -> FloatArray:
        way = positions[last] - positions[first]
        return np.asarray(np.sqrt(dot(way, way)))

    return _Motion(between, spec.jump, _NOISE * noise)


def _turns(rotations: FloatArray, spec: GapsSpec, noise: float) -> _Motion:
    """Angles between rotations (N, 4), radians."""

    def between(first: IntArray, last: IntArray) -> FloatArray:
        cosine = np.abs((rotations[first] * rotations[last]).sum(axis=1))
        return np.asarray(2 * np.arccos(np.minimum(cosine, 1.0)))

    # An angle gathers the noise of three axes, and the cosine of nothing is 1 to half the digits alone.
    return _Motion(between, math.radians(spec.jump_deg), _NOISE * math.sqrt(3) * noise + 1e-6)


def _spikes(times: FloatArray, motion: _Motion, spec: GapsSpec, step: float) -> BoolArray:
    """Samples (N,) that jump away and come back within what may be filled."""
    out = np.zeros(len(times), dtype=np.bool_)
    edges = np.flatnonzero(motion.jumps(times)) + 1
    at = 0
    while at + 1 < len(edges):
        first, last = edges[at], edges[at + 1]
        before = first - 1
        near = not motion.too_far(times, np.array([before]), np.array([last]))[0]
        if near and times[last] - times[before] <= max(spec.fill, 2 * step) + SAME_STAMP:
            out[first:last] = True
            at += 2
        else:
            at += 1
    return out
