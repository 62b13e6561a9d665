"""Lengths as people write them: numbers in the file's unit, or texts with a unit of their own."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, WithJsonSchema

from quiltcli.geometry import FloatArray
from quiltcli.job.model import OneOf, complaint, describe

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
_EXACT = {name: Fraction(str(metres)) for name, metres in UNITS.items()}
_LENGTH = re.compile(r"\s*([-+]?\d{1,9}(?:\.\d{1,9})?)(?:\s*/\s*(\d{1,9}))?\s*(mm|cm|m|in|ft)\s*")
_FARTHEST = 10**9

UpAxis = Annotated[str, OneOf(("y", "z"))]


def read_length(text: str) -> Fraction | None:
    """Metres of a length such as `6 mm`, `-4 m` or `1/6 mm`, exactly; None of any other text."""
    match = _LENGTH.fullmatch(text)
    if match is None or (match[2] is not None and not int(match[2])):
        return None
    return Fraction(match[1]) / Fraction(match[2] or 1) * _EXACT[match[3]]


def exact_metres(value: float | str, unit: float) -> Fraction:
    """Metres of a length as a model holds it, to the last digit of what was written.

    Args:
        value: a number of units, or a text with its own unit that `read_length` can read.
        unit: metres of the file's unit.
    """
    if isinstance(value, str):
        metres = read_length(value)
        assert metres is not None  # the model let it pass
        return metres
    return Fraction(str(value)) * Fraction(str(unit))


def up_matrix(up_axis: str) -> FloatArray:
    """World from what is measured with this axis up (4, 4): with z up, what faces −Y there faces +Z here."""
    matrix = np.eye(4)
    if up_axis == "z":
        matrix[1:3, 1:3] = (0, 1), (-1, 0)
    return matrix


def _reader(low: Fraction, words: str) -> Callable[[Any], float | str]:
    def read(value: Any) -> float | str:
        """The value as it was written, once it is known to be a length."""
        metres = read_length(value) if isinstance(value, str) else None
        if metres is None:
            if isinstance(value, (str, bool)) or not isinstance(value, (int, float)):
                raise complaint(f"expected a length such as 6 mm, 1/6 mm or {words}, got {describe(value)}")
            if not abs(value) < float("inf"):
                raise complaint(f"expected a finite number, got {value}")
            metres = Fraction(value)
        if not low <= metres <= _FARTHEST:
            least = "greater than 0" if low > 0 else "at least -1000000000"
            raise complaint(f"must be {least} and at most 1000000000, got {describe(value)}")
        return value if isinstance(value, str) else float(value)

    return read


_SCHEMA = {"type": ["number", "string"]}
Length = Annotated[
    float | str,
    PlainValidator(_reader(Fraction(1, 10**9), "a number of the file's units")),
    WithJsonSchema({**_SCHEMA, "examples": ["6 mm", "1/6 in"]}),
]
Coordinate = Annotated[
    float | str,
    PlainValidator(_reader(Fraction(-_FARTHEST), "a number of the file's units")),
    WithJsonSchema({**_SCHEMA, "examples": [-4, "2.25 m"]}),
]
