"""`--set KEY=VALUE`: change single values of a job from the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from quiltcli.errors import JobError, Problem
from quiltcli.formats.yaml.source import Key, Source, parse_value, shorten
from quiltcli.job.model import PathText, describe


def apply_sets(data: dict[Any, Any], source: Source, sets: Sequence[str]) -> Source:
    """Put each `KEY=VALUE` into `data`; messages about those values will name the option.

    File names typed on the command line are relative to the working directory, not to the job.

    Raises:
        JobError: a setting is not KEY=VALUE, or its key cannot be reached.
    """
    origins, marks = dict(source.origins), dict(source.marks)
    problems: list[Problem] = []
    for text in sets:
        option = f"--set {shorten(text, 200)}"
        try:
            key = _apply(data, text)
            origins = {path: by for path, by in origins.items() if path[: len(key)] != key} | {key: option}
            marks = {path: mark for path, mark in marks.items() if path[: len(key)] != key}
        except JobError as error:
            problems += [Problem(problem.message, file=option, key=problem.key) for problem in error.problems]
    if problems:
        raise JobError(problems)
    return replace(source, origins=origins, marks=marks)


def _apply(data: dict[Any, Any], text: str) -> Key:
    """Put one setting into `data` and return its key path."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        raise JobError("expected KEY=VALUE, such as render.samples=4")
    key = _key(name.strip())
    place: Any = data
    for end, part in enumerate(key[:-1], 1):
        if isinstance(place, dict) and place.get(part) is None:
            place[part] = {}
        place = _step(place, part, key[: end - 1])
    last = key[-1]
    _step(place, last, key[:-1], new=True)
    place[last] = _as_typed(parse_value(value))
    return key


def _key(name: str) -> Key:
    """`a.b[2].c` or `a.b.2.c` as parts."""
    parts = re.sub(r"\[(-?\d+)\]", r".\1", name).split(".")
    if not all(parts):
        raise JobError(f"cannot read the key {name!r} (expected names with dots between: viewer.near)")
    return tuple(int(part) if re.fullmatch(r"-?\d+", part) else part for part in parts)


def _step(place: Any, part: str | int, above: Key, *, new: bool = False) -> Any:
    """The value one step further down; a `new` key may not be there yet."""
    name = Source().dotted(above)
    if isinstance(place, dict):
        return place.get(part) if new else place[part]
    if not isinstance(place, list):
        raise JobError(Problem(f"holds {describe(place)}, which has no keys", key=name))
    if not isinstance(part, int) or not 0 <= part < len(place):
        items = "1 item" if len(place) == 1 else f"{len(place)} items"
        raise JobError(Problem(f"there is no item {part!r} (the list has {items}, from 0)", key=name))
    return place[part]


def _as_typed(value: Any) -> Any:
    """Mark texts as typed by hand, so that file names are taken from the working directory."""
    if isinstance(value, str):
        return PathText(value)
    if isinstance(value, list):
        return [_as_typed(item) for item in value]
    if isinstance(value, dict):
        return {key: _as_typed(item) for key, item in value.items()}
    return value
