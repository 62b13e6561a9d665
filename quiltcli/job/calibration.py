"""The calibration file: where marks on a spinning mirror were seen in the projector's image."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

from pydantic import Field

from quiltcli.job.model import Complaint, FileModel, Items, Listed, Model, Number, OneOf, Positive, Size, Vec3

LEAST = 6
"""Points that a calibration needs."""
UNKNOWNS = ("f", "centre", "rotation", "position")

Pixel = Annotated[tuple[Number, Number], Items(2, "numbers, x and y")]


class ClickSpec(Model):
    """A point whose place is known, and the pixel that lights it."""

    mirror_deg: Number | None = None
    """Angle of the mirror while the mark was lit; 0 serves viewers at +X."""
    at: Annotated[tuple[Number, Number], Items(2, "numbers, across and up the slope")] | None = None
    """Place of the mark on the mirror: to the right as the viewers see it, and up the slope, metres."""
    world: Vec3 | None = None
    """Place of the point in the world, instead of `mirror_deg` and `at`, metres."""
    pixel: Pixel
    """Where the projector's image lights it, x and y from the top left corner, pixels."""
    name: str = ""
    """A name for messages and tables."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A place on the mirror or one in the world."""
        if self.world is None:
            for name in ("mirror_deg", "at"):
                if getattr(self, name) is None:
                    yield (name,), "missing key (expected mirror_deg and at, or world)"
        else:
            for name in ("mirror_deg", "at"):
                if getattr(self, name) is not None:
                    yield (name,), "cannot stand beside world (expected one or the other)"


class CalibrationFile(FileModel):
    """Points by which a projector is calibrated."""

    kind: ClassVar[str] = "quilt_calibration"

    quilt_calibration: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    image: Size
    """Width and height of the projector's image, pixels."""
    points: Annotated[tuple[ClickSpec, ...], Listed]
    """Marks and the pixels that light them: six or more, not all in one plane."""
    tilt_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, lt=90)] = 45.0
    """Tilt of the mirror's normal from the vertical."""
    ridge: Number = 0.0
    """Height of the mirror plane where the axis meets it, for the planes of a tent, metres."""
    free: Annotated[tuple[Annotated[str, OneOf(UNKNOWNS)], ...], Listed] = UNKNOWNS
    """What is to be found: rotation and position always, f and centre unless they are known."""
    f: Positive | None = None
    """Focal length where it is not among `free`, pixels."""
    centre: Pixel | None = None
    """Where the axis meets the image where it is not among `free`, pixels; the image's middle when absent."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Enough points inside the image; what is fixed has a value, and what is free none."""
        if len(self.points) < LEAST:
            have = len(self.points)
            yield ("points",), f"expected at least {LEAST} points, got {have or 'none'}"
        for i, point in enumerate(self.points):
            if not (0 <= point.pixel[0] <= self.image[0] and 0 <= point.pixel[1] <= self.image[1]):
                size = f"{self.image[0]} × {self.image[1]}"
                where = f"({point.pixel[0]:g}, {point.pixel[1]:g})"
                yield ("points", i, "pixel"), f"lies outside the image of {size} pixels, at {where}"
        for name in ("rotation", "position"):
            if name not in self.free:
                yield ("free",), f"{name} is always found (expected it among the names)"
        if "f" not in self.free and self.f is None:
            yield ("f",), "missing key (a focal length that is not free must be given)"
        for name in ("f", "centre"):
            if name in self.free and getattr(self, name) is not None:
                yield (name,), f"is given, but free to change (leave {name} out of free)"
