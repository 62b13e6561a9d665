"""Ease of use by equation 6 of Harish & Narayanan, and how sure one can be that displays differ in it.

    EOU = OPL / (PL + Undos) + Motions / Time

(*Designing Perspectively-Correct Multiplanar Displays*, §5): OPL is the length of the shortest path, PL that
of the path chosen. The first term is about perceiving, the second about moving around; each is scaled so that
its greatest value in the log is 0.5.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from quiltcli.analysis.ease.log import RATINGS, StudyLog
from quiltcli.geometry import FloatArray

CONFIDENCE = 0.95
TERMS = ("ease", "perception", "interaction")
"""Ease of use, and the two terms it is the sum of."""


@dataclass(frozen=True)
class Interval:
    """A mean of some persons, with the interval that holds that of all with 95 % confidence.

    Attributes:
        mean: of n persons.
        low: lower end, by Student's t with n − 1 degrees of freedom; not a number for fewer than two.
        high: upper end.
        count: persons.
    """

    mean: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Comparison:
    """Two displays, by the persons who used both: each person's mean over the tasks done on both.

    Attributes:
        first: a display.
        second: another.
        difference: ease of use of the second less that of the first.
        better: persons for whom the second is easier.
        t: of the paired test; not a number for fewer than two persons.
        p: its probability, from both sides, if the displays were alike: by Student's t.
        p_all: the same by Holm's method (1979), where several pairs of displays are compared.
        p_ranks: by Wilcoxon's signed ranks, which ask less of the numbers; not a number if all are alike.
        effect: the mean difference over its standard deviation.
        left_out: persons with no task on both displays.
    """

    first: str
    second: str
    difference: Interval
    better: int
    t: float
    p: float
    p_all: float
    p_ranks: float
    effect: float
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class Ease:
    """What a log says of displays.

    Attributes:
        log: the log.
        persons: P persons.
        tasks: tasks.
        displays: D displays, like the others in the order of the log.
        perception: (N,) first term of each trial, scaled.
        interaction: (N,) second term.
        by_person: by the names of `TERMS`, (P, D) means over the tasks of a person on a display.
        by_display: by the same, D means over persons.
        ratings: by name, (P, D) means of what persons gave; those that anybody gave.
        comparisons: each pair of displays.
    """

    log: StudyLog
    persons: tuple[str, ...]
    tasks: tuple[str, ...]
    displays: tuple[str, ...]
    perception: FloatArray
    interaction: FloatArray
    by_person: dict[str, FloatArray]
    by_display: dict[str, tuple[Interval, ...]]
    ratings: dict[str, FloatArray]
    comparisons: tuple[Comparison, ...]

    @property
    def total(self) -> FloatArray:
        """Ease of use (N,) of each trial, at most 1."""
        return self.perception + self.interaction


def ease_of_use(log: StudyLog) -> Ease:
    """Ease of use of every trial, of persons and displays, and the differences between displays."""
    trials = log.trials
    perception = _scaled([trial.optimal_length / (trial.path_length + trial.undos) for trial in trials])
    interaction = _scaled([trial.motions / trial.seconds for trial in trials])
    persons = tuple(dict.fromkeys(trial.person for trial in trials))
    tasks = tuple(dict.fromkeys(trial.task for trial in trials))
    displays = tuple(dict.fromkeys(trial.display for trial in trials))
    values = dict(zip(TERMS, (perception + interaction, perception, interaction), strict=True))
    cubes = {name: np.full((len(persons), len(displays), len(tasks)), np.nan) for name in (*TERMS, *RATINGS)}
    for k, trial in enumerate(trials):
        at = persons.index(trial.person), displays.index(trial.display), tasks.index(trial.task)
        for name in TERMS:
            cubes[name][at] = values[name][k]
        for name, rating in trial.ratings.items():
            cubes[name][at] = rating
    by_person = {name: _means(cubes[name]) for name in TERMS}
    given = [name for name in RATINGS if np.isfinite(cubes[name]).any()]
    return Ease(
        log=log,
        persons=persons,
        tasks=tasks,
        displays=displays,
        perception=perception,
        interaction=interaction,
        by_person=by_person,
        by_display={name: tuple(map(interval, table.T)) for name, table in by_person.items()},
        ratings={name: _means(cubes[name]) for name in given},
        comparisons=tuple(_corrected(list(_compared(cubes["ease"], persons, displays)))),
    )


def interval(values: FloatArray) -> Interval:
    """Mean and interval of the values (n,) that are numbers."""
    from scipy.stats import t

    values = values[np.isfinite(values)]
    if not values.size:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(values.mean())
    if values.size < 2:
        return Interval(mean, math.nan, math.nan, 1)
    half = float(t.ppf((1 + CONFIDENCE) / 2, values.size - 1) * values.std(ddof=1)) / math.sqrt(values.size)
    return Interval(mean, mean - half, mean + half, int(values.size))


def _scaled(values: Sequence[float]) -> FloatArray:
    """Values as shares of twice their greatest."""
    found = np.array(values, dtype=np.float64)
    most = float(found.max())
    return 0.5 * found / most if most > 0 else np.zeros_like(found)


def _means(cube: FloatArray) -> FloatArray:
    """Means over the last axis of what are numbers."""
    count = np.isfinite(cube).sum(axis=-1)
    total = np.where(np.isfinite(cube), cube, 0.0).sum(axis=-1)
    means: FloatArray = np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)
    return means


def _compared(ease: FloatArray, persons: tuple[str, ...], displays: tuple[str, ...]) -> Iterator[Comparison]:
    """Each pair of displays, from (P, D, K) trials of persons, displays and tasks."""
    for a, b in combinations(range(len(displays)), 2):
        # What was done on one of the two displays alone says nothing of the difference.
        difference = _means(ease[:, b] - ease[:, a])
        lacking = tuple(np.array(persons)[np.isnan(difference)].tolist())
        found = difference[np.isfinite(difference)]
        t, p, effect = _paired(found)
        yield Comparison(
            first=displays[a],
            second=displays[b],
            difference=interval(found),
            better=int(np.count_nonzero(found > 0)),
            t=t,
            p=p,
            p_all=p,
            p_ranks=_ranks(found),
            effect=effect,
            left_out=lacking,
        )


def _paired(difference: FloatArray) -> tuple[float, float, float]:
    """Student's t of paired differences (n,), its probability from both sides, and the size of the effect."""
    from scipy.stats import t

    if difference.size < 2:
        return math.nan, math.nan, math.nan
    mean, spread = float(difference.mean()), float(difference.std(ddof=1))
    if spread <= 1e-12 * max(abs(mean), 1e-300):
        return (
            (math.copysign(math.inf, mean), 0.0, math.copysign(math.inf, mean)) if mean else (0.0, 1.0, 0.0)
        )
    effect = mean / spread
    value = effect * math.sqrt(difference.size)
    return value, float(2 * t.sf(abs(value), difference.size - 1)), effect


def _ranks(difference: FloatArray) -> float:
    """The probability of Wilcoxon's signed ranks, differences of 0 left out."""
    from scipy.stats import wilcoxon

    some = difference[difference != 0]
    return float(wilcoxon(some).pvalue) if some.size else math.nan


def _corrected(found: list[Comparison]) -> Iterator[Comparison]:
    """The comparisons with probabilities by Holm's method."""
    order = sorted(range(len(found)), key=lambda k: (math.isnan(found[k].p), found[k].p))
    count = sum(not math.isnan(one.p) for one in found)
    raised: dict[int, float] = {}
    highest = 0.0
    for rank, k in enumerate(order):
        p = found[k].p
        if not math.isnan(p):
            highest = max(highest, min(1.0, (count - rank) * p))
        raised[k] = p if math.isnan(p) else highest
    for k, one in enumerate(found):
        yield Comparison(**{**vars(one), "p_all": raised[k]})
