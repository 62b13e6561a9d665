"""A study as one page of HTML that needs nothing else, and as JSON beside it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np

from quiltcli.analysis.ease.ease import TERMS, Ease, Interval, interval
from quiltcli.analysis.ease.table import (
    DISPLAY_COLUMNS,
    TRIAL_COLUMNS,
    display_rows,
    person_columns,
    person_rows,
    study_data,
    trial_rows,
    words_of,
)
from quiltcli.errors import OutputError, Problem, counted
from quiltcli.formats.drawing.charts import Bars, group_chart
from quiltcli.formats.drawing.pages import html_page, html_table
from quiltcli.formats.whole import make_folder, write_text

_EQUATION = (
    "Ease of use is the length of the shortest path over the sum of the path that was chosen and the steps"
    " taken back (<em>perception</em>), plus motions a second (<em>interaction</em>), each scaled so that its"
    " greatest value in the log is 0.5 (Harish &amp; Narayanan, equation 6). A person's figure for a display"
    " is the mean over tasks; intervals hold the mean of all persons with 95 % confidence, by Student's t."
)


def check_report(path: Path) -> None:
    """Raise unless a report can have this name.

    Raises:
        OutputError: it does not end in .html.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise OutputError(Problem("expected a name that ends in .html", file=str(path)))


def write_report(ease: Ease, path: Path) -> tuple[Path, Path]:
    """Write the page, and the same as JSON beside it, each whole or not at all.

    Returns:
        Their paths.

    Raises:
        OutputError: the name does not end in .html, or they cannot be written.
    """
    check_report(path)
    make_folder(path.parent)
    data = path.with_suffix(".json")
    write_text(path, page_text(ease))
    write_text(data, json.dumps(study_data(ease), indent=1, allow_nan=False, ensure_ascii=False) + "\n")
    return path, data


def page_text(ease: Ease) -> str:
    """The page."""
    return html_page(f"Ease of use: {ease.log.file}", _parts(ease))


def persons_chart(ease: Ease) -> str:
    """Ease of use of every person on every display: the paper's figure 23 (a)."""
    table = ease.by_person["ease"]
    bars = [Bars(name, table[:, k]) for k, name in enumerate(ease.displays)]
    # Room for each person's bars, and for the name below.
    room = max(18 * len(ease.displays), 14 + 7 * max(map(len, ease.persons)))
    width = max(860, 230 + room * len(ease.persons))
    return group_chart(ease.persons, bars, "ease of use", (width, 380))


def displays_chart(ease: Ease) -> str:
    """Means of ease of use and its two terms on every display, with intervals."""
    return group_chart(TERMS, _means(ease, ease.by_display), "mean over persons")


def ratings_chart(ease: Ease) -> str:
    """Means of the persons' ratings on every display, with intervals: the paper's figure 23 (b)."""
    found = {name: tuple(map(interval, table.T)) for name, table in ease.ratings.items()}
    return group_chart(list(found), _means(ease, found), "mean rating")


def _means(ease: Ease, found: dict[str, tuple[Interval, ...]]) -> list[Bars]:
    """A bar a display in each group of `found`."""
    return [
        Bars(
            display,
            np.array([of[k].mean for of in found.values()]),
            np.array([(of[k].low, of[k].high) for of in found.values()]),
        )
        for k, display in enumerate(ease.displays)
    ]


def _parts(ease: Ease) -> Iterator[str]:
    counts = (
        counted(len(ease.persons), "person"),
        counted(len(ease.tasks), "task"),
        counted(len(ease.displays), "display"),
        counted(len(ease.log.trials), "trial"),
    )
    yield f"<p>{', '.join(counts)}.</p><p>{_EQUATION}</p>"
    yield "<h2>Displays</h2>"
    yield _scrolled(html_table(DISPLAY_COLUMNS, display_rows(ease)))
    yield from (f"<p>{escape(words[0].upper() + words[1:])}.</p>" for words in words_of(ease))
    yield _scrolled(displays_chart(ease))
    yield "<h2>Persons</h2>"
    yield _scrolled(persons_chart(ease))
    yield _scrolled(html_table(person_columns(ease), person_rows(ease)))
    if ease.ratings:
        yield "<h2>Ratings</h2><p>As persons gave them, the mean over what each gave for a display.</p>"
        yield _scrolled(ratings_chart(ease))
    yield "<h2>Trials</h2>"
    yield _scrolled(html_table(TRIAL_COLUMNS, trial_rows(ease)))


def _scrolled(content: str) -> str:
    return f'<div class="scroll">{content}</div>'
