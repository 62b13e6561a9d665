"""Projectors: where their pixels light a screen, and how pictures that overlap are blended."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field

from quiltcli.job.lengths import UNITS
from quiltcli.job.model import (
    Complaint,
    Direction,
    ExistingFile,
    Items,
    Listed,
    Model,
    Number,
    OneOf,
    Positive,
    Size,
    Unit,
    exactly_one,
)
from quiltcli.job.places import PlaceOnPage
from quiltcli.job.surfaces import MAPS, PICTURES, SHEET, Point

LEAST = 6
"""Points that tell where a projector stands."""

MatrixRow = Annotated[tuple[Number, Number, Number, Number], Items(4)]
Pixel = Annotated[tuple[Number, Number], Items(2, "numbers, x and y")]


class LensSpec(Model):
    """A projector that was set up by hand."""

    at: Point
    """Where its lens is: numbers of `units` (metres), or texts such as 2.25 m."""
    look_at: Point
    """What its axis goes through: numbers of `units` (metres), or texts such as 2.25 m."""
    up: Direction = (0.0, 1.0, 0.0)
    """World direction that is up in its picture."""
    throw: Positive
    """Throw ratio: distance from the lens over width of the picture there."""
    shift: Annotated[tuple[Number, Number], Items(2, "shares of the picture, right and up")] = (0.0, 0.0)
    """How far the lens shifts the picture from the axis, right and up, shares of its width and height."""


class LitPointSpec(Model):
    """A point whose place is known, and the pixel that lights it."""

    world: Point
    """Its place: numbers of `units` (metres), or texts such as 2.25 m."""
    pixel: Pixel
    """What lights it, x and y from the top left corner of the picture, pixels."""


class ProjectorSpec(Model):
    """A projector: one facet, whose pixels are the points that they light."""

    name: str = ""
    """A name for messages and tables."""
    pixels: Size | None = None
    """Width and height; those of `map` where there is one, pixels."""
    lens: LensSpec | None = None
    """Where it stands and how wide it throws; or one of the three that follow."""
    matrix: Annotated[tuple[MatrixRow, MatrixRow, MatrixRow], Items(3, "rows of 4 numbers")] | None = None
    """Three rows of four: pixels, times their depth, from points of the world in `units`."""
    points: Annotated[tuple[LitPointSpec, ...], Listed] | None = None
    """Six points or more, not all in one plane, and the pixels that light them."""
    map: Annotated[Path, ExistingFile(MAPS, "a map of points")] | None = None
    """Instead of all that and a screen, a point for each pixel: EXR or PFM; NaN or an alpha of 0 is none."""
    units: Annotated[str, OneOf(tuple(UNITS))] = "m"
    """What the points of `map` are measured in: m, cm, mm, in or ft."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Side of the screen that is seen: front, on which the projector is, or back, for rear projection."""
    mask: Annotated[Path, ExistingFile(PICTURES, "a picture")] | None = None
    """Picture of as many pixels; the projector has none where it is black or transparent."""
    weights: Annotated[Path, ExistingFile(PICTURES, "a picture of weights")] | None = None
    """Picture of as many pixels: share of the light that each gives where pictures overlap."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt; projectors without one are packed around it."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One way of saying where pixels are; enough points in the picture."""
        yield from exactly_one(self, "lens", "matrix", "points", "map")
        if self.pixels is None and self.map is None:
            yield ("pixels",), "missing key (width and height of the projector's picture, pixels)"
        if self.points is None or self.pixels is None:
            return
        if len(self.points) < LEAST:
            yield ("points",), f"expected at least {LEAST} points, got {len(self.points) or 'none'}"
        width, height = self.pixels
        for k, point in enumerate(self.points):
            if not (0 <= point.pixel[0] <= width and 0 <= point.pixel[1] <= height):
                where = f"({point.pixel[0]:g}, {point.pixel[1]:g})"
                yield (
                    ("points", k, "pixel"),
                    f"lies outside the picture of {width} × {height} pixels, at {where}",
                )


class BlendSpec(Model):
    """How pictures of projectors overlap."""

    width: Positive | None = None
    """From its border inwards, where a picture fades; over all of the overlap when absent, pixels."""
    black: Unit = 0.0
    """Light of a black pixel as a share of a white one's: where fewer pictures overlap, black is lifted by
    what is missing."""
    weights_gamma: Annotated[float, Field(allow_inf_nan=False, ge=0.2, le=10)] = 1.0
    """Exponent that makes shares of light of the numbers in `weights`; 2.2 for pictures made for signals."""
