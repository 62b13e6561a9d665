"""What `quilt new` is asked for, and the panels that come of it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from quiltcli.errors import JobError
from quiltcli.exchange.newjob.figures import Grain, Raster, Sided, read_grain, read_metres, read_sides

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Wishes:
    """What was asked for, as it was typed; None where nothing was said."""

    kind: str
    size: str | None = None
    left: str | None = None
    right: str | None = None
    angle: float | None = None
    radius: str | None = None
    columns: int | None = None
    rows: int | None = None
    steps: int | None = None
    preset: str | None = None
    installed: int | None = None
    pitch: str | None = None
    pixels: str | None = None
    cabinet: str | None = None
    base: str | None = None
    inside: bool = False
    ceiling: bool = False
    treads: bool = True
    eye: Point | None = None
    canvas: tuple[int, int] | None = None
    places: tuple[str, ...] = ()
    padding: int = 0
    scene: str | None = None
    frames: str = "1-48"
    fps: int = 24


@dataclass(frozen=True)
class Panel:
    """A panel of the new display: its middle in metres, turned by yaw, then by pitch."""

    name: str
    raster: Raster
    at: Point
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0


@dataclass(frozen=True)
class Ball:
    """A sphere of flat pieces.

    Attributes:
        vertices: places, metres.
        faces: vertex indices, 0-based, wound outwards.
        pitch: metres from pixel to pixel.
    """

    vertices: tuple[Point, ...]
    faces: tuple[tuple[int, ...], ...]
    pitch: Fraction


def grain_of(wishes: Wishes) -> Grain:
    """How many pixels there are (JobError: not said, or twice)."""
    return read_grain(wishes.pitch, wishes.pixels, wishes.cabinet)


def base_of(wishes: Wishes, default: float = 0.0) -> float:
    """Height of the lower edge, metres (JobError: no length)."""
    if wishes.base is None:
        return default
    return float(read_metres(wishes.base, "--base", negative=True))


def sides_of(text: str | None, count: int, option: str) -> tuple[Sided, ...]:
    """Sides as they were typed (JobError: another number of them)."""
    return read_sides(text or "", count, option)


def count_of(value: int | None, least: int, most: int, option: str) -> int:
    """A number in its bounds (JobError: it is not)."""
    if value is None or not least <= value <= most:
        raise JobError(f"{option}: expected {least} to {most}, got {value}")
    return value
