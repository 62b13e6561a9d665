"""What the panels of a display make of their images, as measured, and how far images may make up for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from quiltcli.job.model import (
    Complaint,
    Count,
    Items,
    Listed,
    Model,
    Number,
    Positive,
    complaint,
    describe,
    exactly_one,
)

_MOST_GAIN = 1000.0


def _three(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (value, value, value)
    if isinstance(value, (list, tuple)) and len(value) == 3:
        return tuple(value)
    raise complaint(f"expected a number or 3 numbers, red, green and blue, got {describe(value)}")


def _row(value: Any) -> Any:
    if isinstance(value, (list, tuple)) and len(value) in (2, 4):
        # One brightness is that of all three primaries.
        return (*value, value[1], value[1]) if len(value) == 2 else tuple(value)
    raise complaint(f"expected [degrees, brightness] or [degrees, red, green, blue], got {describe(value)}")


Factor = Annotated[float, Field(allow_inf_nan=False, ge=0.001, le=_MOST_GAIN)]
Factors = Annotated[
    tuple[Factor, Factor, Factor],
    BeforeValidator(_three),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": 0.001},
                {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
            ]
        }
    ),
]
Row = Annotated[
    tuple[Number, Factor, Factor, Factor],
    BeforeValidator(_row),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 4}),
]
Gamma = Annotated[float, Field(allow_inf_nan=False, ge=0.2, le=10)]


class BrightnessSpec(Model):
    """How panels get darker when they are seen aslant: an exponent or a table."""

    exponent: Annotated[float, Field(allow_inf_nan=False, ge=0, le=20)] | None = None
    """n where a panel is as bright as the cosine to the power n of the angle between its normal and the
    view."""
    table: Annotated[tuple[Row, ...], Listed, Field(min_length=1)] | None = None
    """Instead, as measured: rows of the angle and how bright it is then, alike or for each primary; between
    rows in proportion, beyond the outer ones as there, degrees."""
    limit: Annotated[float, Field(allow_inf_nan=False, ge=1, le=_MOST_GAIN)] = 4.0
    """How many times brighter a pixel is made at most."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One of them; angles that rise from 0 to 90."""
        yield from exactly_one(self, "exponent", "table")
        before = -1.0
        for k, row in enumerate(self.table or ()):
            if not 0 <= row[0] <= 90:
                yield ("table", k, 0), f"must be from 0 to 90 degrees, got {row[0]:g}"
            elif row[0] <= before:
                yield ("table", k, 0), f"must be greater than the angle before, {before:g}, got {row[0]:g}"
            before = max(before, row[0])


class FacetCorrectionSpec(Model):
    """What is different on one facet."""

    gain: Factors = (1.0, 1.0, 1.0)
    """What its light is multiplied by: one number, or red, green and blue."""
    gamma: Gamma | None = None
    """Exponent of the panel's response as measured; `signal_gamma` when absent."""
    white: Annotated[tuple[Positive, Positive], Items(2, "chromaticity coordinates x and y")] | None = None
    """Chromaticity x, y of the panel's white as measured; [0.3127, 0.329] (D65) when absent."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A white that is none."""
        if self.white is not None and sum(self.white) >= 1:
            yield ("white",), f"x + y must be less than 1, got {sum(self.white):g}"


class CorrectionsSpec(Model):
    """What panels make of their images, which the images make up for: in linear light, after shading."""

    brightness: BrightnessSpec | None = None
    """How panels get darker when they are seen aslant."""
    facets: dict[Count, FacetCorrectionSpec] = Field(default_factory=dict)
    """What single facets show too bright, too dark or in another hue, by facet id."""
    level: Annotated[float, Field(allow_inf_nan=False, ge=0.001, le=10)] = 1.0
    """Share of its light that the whole display shows, so that there is room to brighten what is aslant."""
    peak: Positive = 1.0
    """The brightest light that a panel can give, seen straight on."""
    clip: bool = True
    """Write nothing brighter than `peak`."""
    signal_gamma: Gamma = 2.2
    """Exponent by which whoever plays the images makes signals of their light."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Something to correct."""
        if self.brightness is None and not self.facets and self.level == 1:
            yield (), "corrects nothing (expected brightness, facets or level)"
