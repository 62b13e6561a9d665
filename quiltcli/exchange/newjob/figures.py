"""Figures as people say them: `8x4.5m`, `500x500mm/128x128px`, `1333x750px`."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

from quiltcli.errors import JobError
from quiltcli.job.lengths import UNITS, read_length

_SIDES = re.compile(r"\s*(\d[\d./]*(?:\s*[x×]\s*\d[\d./]*)*)\s*([a-z]+)\s*", re.IGNORECASE)
_NUMBERS = re.compile(r"\s*[-+\d]")
_MOST_PIXELS = 65536


@dataclass(frozen=True)
class Grain:
    """How many pixels fit on a length.

    Attributes:
        pitch: metres from pixel to pixel, across and down; None where `pixels` rules.
        cabinet: pixels of a cabinet, across and down; lengths are whole numbers of cabinets then.
        pixels: pixels of every panel, whatever its size.
    """

    pitch: tuple[Fraction, Fraction] | None = None
    cabinet: tuple[int, int] | None = None
    pixels: tuple[int, int] | None = None

    def raster(self, name: str, sides: tuple[Sided, Sided]) -> Raster:
        """Pixels of a panel and the size that they really have.

        Raises:
            JobError: less than a pixel or too many, or no whole number of cabinets.
        """
        if self.pitch is None:
            assert self.pixels is not None
            return Raster(self.pixels, (self._metres(name, sides[0], 0), self._metres(name, sides[1], 1)))
        counts = [self._count(name, side, axis) for axis, side in enumerate(sides)]
        size = tuple(count * step for count, step in zip(counts, self.pitch, strict=True))
        return Raster((counts[0], counts[1]), (size[0], size[1]))

    def _count(self, name: str, side: Sided, axis: int) -> int:
        assert self.pitch is not None
        exact = side.amount if side.in_pixels else side.amount / self.pitch[axis]
        count = math.floor(exact + Fraction(1, 2))
        if not 1 <= count <= _MOST_PIXELS:
            raise JobError(f"{name}: {side} makes {count} pixels (expected 1 to {_MOST_PIXELS}): units?")
        unit = self.cabinet[axis] if self.cabinet else 1
        if (exact if self.cabinet else count) % unit:
            wide = unit * self.pitch[axis]
            low = exact // unit * wide
            near = " or ".join(f"{float(length):g} m" for length in (low, low + wide) if length)
            cabinets = f"cabinets of {float(wide):g} m"
            raise JobError(f"{name}: {side} is no whole number of {cabinets} (expected {near})")
        return count

    @staticmethod
    def _metres(name: str, side: Sided, axis: int) -> Fraction:
        if side.in_pixels:
            raise JobError(f"{name}: {side} needs a pitch or a cabinet (expected a length such as 4.5m)")
        return side.amount


@dataclass(frozen=True)
class Sided:
    """One side of something: metres, or pixels."""

    amount: Fraction
    in_pixels: bool = False

    def __str__(self) -> str:
        """`4.5 m` or `750 px`."""
        return f"{float(self.amount):g} {'px' if self.in_pixels else 'm'}"


@dataclass(frozen=True)
class Raster:
    """Pixels, and metres, across and down."""

    pixels: tuple[int, int]
    size: tuple[Fraction, Fraction]


def read_sides(text: str, count: int, option: str) -> tuple[Sided, ...]:
    """Sides such as `8x4.5m`, `1333x750px` or, where one is asked for, `2m`.

    Raises:
        JobError: another number of sides, an unknown unit, or no size at all.
    """
    example = "x".join(("8", "4.5", "3")[:count]) + "m"
    match = _SIDES.fullmatch(text)
    parts = re.split(r"\s*[x×]\s*", match[1], flags=re.IGNORECASE) if match else []
    unit = match[2].lower() if match else ""
    if len(parts) != count or (unit != "px" and unit not in UNITS):
        wrong = f"{option}: expected {_sides_text(count)} such as {example}, got {text!r}"
        known = f" (units: {', '.join(UNITS)} and px)" if _NUMBERS.match(text) else ""
        raise JobError(wrong + known)
    sides = []
    for part in parts:
        metres = read_length(f"{part} m")
        if metres is None or metres <= 0 or (unit == "px" and metres.denominator != 1):
            raise JobError(f"{option}: expected {_sides_text(count)} such as {example}, got {text!r}")
        scale = Fraction(1) if unit == "px" else Fraction(str(UNITS[unit]))
        sides.append(Sided(metres * scale, unit == "px"))
    return tuple(sides)


def _sides_text(count: int) -> str:
    return ("a length", "width x height", "width x height x depth")[count - 1]


def read_metres(text: str, option: str, *, negative: bool = False) -> Fraction:
    """A length such as `6mm`, as metres.

    Raises:
        JobError: no length, or one of nothing or less unless `negative`.
    """
    metres = read_length(text)
    if metres is None or (metres <= 0 and not negative):
        known = f" (units: {', '.join(UNITS)})" if metres is None and _NUMBERS.match(text) else ""
        raise JobError(f"{option}: expected a length such as 6mm or 2.5m, got {text!r}{known}")
    return metres


def read_pixels(text: str, option: str) -> tuple[int, int]:
    """Pixels such as `1920x1080` or `128x128px`.

    Raises:
        JobError: anything else, or none or too many of them.
    """
    match = re.fullmatch(r"\s*(\d{1,6})\s*[x×]\s*(\d{1,6})\s*(?:px)?\s*", text, re.IGNORECASE)
    pixels = (int(match[1]), int(match[2])) if match else (0, 0)
    if not all(1 <= count <= _MOST_PIXELS for count in pixels):
        raise JobError(f"{option}: expected pixels such as 1920x1080, got {text!r}")
    return pixels


def read_grain(pitch: str | None, pixels: str | None, cabinet: str | None) -> Grain:
    """How many pixels there are, by exactly one of the three.

    Raises:
        JobError: none or several of them, or one that cannot be read.
    """
    given = [text for text in (pitch, pixels, cabinet) if text is not None]
    if len(given) != 1:
        raise JobError("expected one of --pitch 6mm, --pixels 1920x1080 and --cabinet 500x500mm/128x128px")
    if pitch is not None:
        step = read_metres(pitch, "--pitch")
        return Grain(pitch=(step, step))
    if pixels is not None:
        return Grain(pixels=read_pixels(pixels, "--pixels"))
    assert cabinet is not None
    size, slash, counts = cabinet.partition("/")
    if not slash:
        raise JobError(f"--cabinet: expected size/pixels such as 500x500mm/128x128px, got {cabinet!r}")
    wide, high = read_sides(size, 2, "--cabinet")
    across, down = read_pixels(counts, "--cabinet")
    if wide.in_pixels:
        raise JobError(f"--cabinet: expected size/pixels such as 500x500mm/128x128px, got {cabinet!r}")
    return Grain(pitch=(wide.amount / across, high.amount / down), cabinet=(across, down))


def length_text(metres: Fraction) -> str:
    """A length that reads back exactly: `6 mm`, `4.5 m` or `1/3 m`."""
    unit = "mm" if abs(metres) < Fraction(1, 10) else "m"
    value = metres / Fraction(str(UNITS[unit]))
    places = next((n for n in range(10) if (value * 10**n).denominator == 1), None)
    if places is None:
        return f"{value.numerator}/{value.denominator} {unit}"
    text = f"{value.numerator * 10**places // value.denominator:0{places + 1}d}"
    return f"{text[:-places]}.{text[-places:]} {unit}" if places else f"{text} {unit}"
