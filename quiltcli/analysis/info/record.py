"""What is told of a file: data for programs, lines and a table for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.geometry import FloatArray

Line = tuple[str, str]


@dataclass(frozen=True)
class Info:
    """What a file is.

    Attributes:
        kind: `display`, `mesh`, `layout`, `scene`, `job` or `image`.
        data: the same and more for programs: dicts, lists, texts, numbers, None; keys do not change.
        lines: (label, text) for people.
        columns: headings of a table; empty when there is none.
        rows: its rows, as many texts as there are columns.
    """

    kind: str
    data: dict[str, Any]
    lines: Sequence[Line]
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()

    def as_json(self) -> dict[str, Any]:
        """The kind and the data; numbers that are not finite are None, as JSON has no others."""
        return {"kind": self.kind, **finite(self.data)}


def finite(value: Any) -> Any:
    """Data with None for every number that is not finite."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def bounds(points: FloatArray) -> dict[str, list[float]]:
    """Least and greatest coordinates of points (N, 3)."""
    return {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}


def bounds_text(box: dict[str, list[float]]) -> str:
    """Bounds in metres, with their extent."""
    extent = (np.array(box["max"]) - np.array(box["min"])).tolist()
    return f"{vector(box['min'])} to {vector(box['max'])} m, {' × '.join(map(number, extent))} m"


def vector(values: Iterable[float]) -> str:
    """Numbers in brackets."""
    return f"[{', '.join(map(number, values))}]"


def number(value: float) -> str:
    """A number to six digits; whole numbers, and zeros, without decoration."""
    return str(value) if isinstance(value, int) else f"{value + 0.0:.6g}"


def size(pair: Iterable[int]) -> str:
    """Width × height."""
    return "×".join(map(str, pair))


def spread(low: float, high: float, unit: str) -> str:
    """`1 to 2 mm`, or `1 mm` when both are the same to the digits shown."""
    return (
        f"{number(low)} {unit}" if number(low) == number(high) else f"{number(low)} to {number(high)} {unit}"
    )


def counted(count: int, noun: str) -> str:
    """`1 page`, `2 pages`."""
    return f"{count:,} {noun}" + ("" if count == 1 else "s")
