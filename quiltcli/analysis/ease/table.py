"""Ease of use as tables and sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from quiltcli.analysis.ease.ease import TERMS, Comparison, Ease, Interval
from quiltcli.errors import counted

TRIAL_COLUMNS = ("person", "task", "display", "ease", "perception", "interaction")
DISPLAY_COLUMNS = ("display", "persons", *(part for name in TERMS for part in (name, "95 %")))


def person_columns(ease: Ease) -> tuple[str, ...]:
    """Heads of the columns of `person_rows`."""
    return ("person", *ease.displays)


def person_rows(ease: Ease) -> list[tuple[str, ...]]:
    """Each person's ease of use on each display, the mean over tasks."""
    table = ease.by_person["ease"]
    return [
        (name, *(_figure(value) for value in row))
        for name, row in zip(ease.persons, table.tolist(), strict=True)
    ]


def display_rows(ease: Ease) -> list[tuple[str, ...]]:
    """Each display's means over persons, with intervals."""
    rows = []
    for k, name in enumerate(ease.displays):
        of = [ease.by_display[term][k] for term in TERMS]
        cells = [cell for one in of for cell in (_figure(one.mean), _ends(one))]
        rows.append((name, str(of[0].count), *cells))
    return rows


def trial_rows(ease: Ease) -> list[tuple[str, ...]]:
    """Each trial, in the order of the log."""
    return [
        (trial.person, trial.task, trial.display, *(f"{value:.3f}" for value in values))
        for trial, *values in zip(
            ease.log.trials,
            ease.total.tolist(),
            ease.perception.tolist(),
            ease.interaction.tolist(),
            strict=True,
        )
    ]


def words_of(ease: Ease) -> Iterator[str]:
    """What it comes to: how displays differ, and what could not be said."""
    for one in ease.comparisons:
        yield _difference(one, several=len(ease.comparisons) > 1)
        if one.left_out:
            names = ", ".join(one.left_out[:5]) + (" …" if len(one.left_out) > 5 else "")
            yield f"left out there, for no task was done on both displays: {names}"
    if len(ease.displays) < 2:
        yield f"there is one display, {ease.displays[0]}, and nothing to compare it with"
    if not ease.interaction.any():
        yield "nobody moved: the second term is 0 throughout"
    if ease.log.ignored:
        yield f"columns that mean nothing here: {', '.join(ease.log.ignored)}"


def _difference(one: Comparison, *, several: bool) -> str:
    found = one.difference
    if found.count < 2:
        return (
            f"{one.second} and {one.first} cannot be compared:"
            f" {counted(found.count, 'person')} used both, and a test needs two or more"
        )
    share = round(100 * one.better / found.count)
    text = (
        f"{one.second} less {one.first}: {found.mean:+.3f} (95 % {_ends(found)}), {found.count} persons,"
        f" t({found.count - 1}) = {one.t:.2f}, p {_probability(one.p)}"
    )
    if several:
        text += f" (among all pairs p {_probability(one.p_all)})"
    if not math.isnan(one.p_ranks):
        text += f", by ranks p {_probability(one.p_ranks)}"
    return f"{text}; {one.second} is easier for {one.better} of {found.count} ({share} %)"


def study_data(ease: Ease) -> dict[str, object]:
    """Everything, for programs; what is not known is None."""
    trials = [
        dict(zip(TRIAL_COLUMNS, (*row[:3], *map(float, row[3:])), strict=True)) for row in trial_rows(ease)
    ]
    for trial, *values in zip(trials, ease.total, ease.perception, ease.interaction, strict=True):
        trial |= dict(zip(TERMS, map(float, values), strict=True))
    return {
        "log": ease.log.file,
        "persons": list(ease.persons),
        "tasks": list(ease.tasks),
        "displays": list(ease.displays),
        "trials": trials,
        "by_person": {name: _numbers(table) for name, table in ease.by_person.items()},
        "by_display": {name: [_known(vars(one)) for one in found] for name, found in ease.by_display.items()},
        "ratings": {name: _numbers(table) for name, table in ease.ratings.items()},
        "comparisons": [
            _known({**vars(one), "difference": _known(vars(one.difference))}) for one in ease.comparisons
        ],
    }


def _numbers(table: np.ndarray) -> list[list[float | None]]:
    return [[value if math.isfinite(value) else None for value in row] for row in table.tolist()]


def _known(facts: dict[str, object]) -> dict[str, object]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in facts.items()
    }


def _figure(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "–"


def _ends(one: Interval) -> str:
    return f"{one.low:.3f} to {one.high:.3f}" if math.isfinite(one.low) else "–"


def _probability(p: float) -> str:
    return f"= {p:.3f}" if p >= 0.001 else "< 0.001"
