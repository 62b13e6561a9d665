"""The display file of a 360° light field display: a projector above a spinning mirror."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from quiltcli.geometry import FloatArray
from quiltcli.job.model import (
    YAMLS,
    Complaint,
    ExistingFile,
    FileModel,
    Items,
    Listed,
    Model,
    Number,
    OneOf,
    Positive,
    Size,
    complaint,
    exactly_one,
)
from quiltcli.job.timing import Timing

KIND = "lightfield360"
"""What `kind` says in such a display file."""
_MOST_PIXELS = 8192
Row = Annotated[tuple[Number, Number, Number, Number], Items(4)]
PixelFromWorld = Annotated[tuple[Row, Row, Row], Items(3, "rows of 4 numbers")]
ClicksPath = Annotated[Path, ExistingFile(YAMLS, "a calibration file")]
Shade = Annotated[float, Field(allow_inf_nan=False, ge=0, le=1)]
Filter = Annotated[tuple[Shade, Shade, Shade], Items(3)]


class ProjectorSpec(Model):
    """Where the projector is, and how it sees the world: ideal, measured as a matrix, or calibrated."""

    height: Positive | None = None
    """Height over the mirror's middle of a projector that looks straight down the axis, metres."""
    diameter: Positive | None = None
    """What the picture's width covers at the mirror's middle, beside `height`, metres."""
    matrix: PixelFromWorld | None = None
    """Pixels from world metres, K[R | −RP]: three rows of four."""
    calibration: ClicksPath | None = None
    """A calibration file, whose points say what the matrix is."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One way to say it; a matrix that is a camera's, above the mirror."""
        yield from exactly_one(self, "height", "matrix", "calibration")
        if self.height is not None and self.diameter is None:
            yield (
                ("diameter",),
                "missing key (what the picture's width covers at the mirror's middle, metres)",
            )
        if self.height is None and self.diameter is not None:
            yield ("diameter",), "belongs to height (expected no such key beside matrix or calibration)"
        if self.matrix is not None:
            yield from self._of_matrix(np.array(self.matrix))

    @staticmethod
    def _of_matrix(matrix: FloatArray) -> Iterator[Complaint]:
        singular = np.linalg.svd(matrix[:, :3], compute_uv=False)
        if not singular[-1] > 1e-9 * singular[0]:
            yield ("matrix",), "is no camera's (its left three columns have no inverse)"
            return
        eye = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
        if not eye[1] > 0:
            yield ("matrix",), f"puts the projector {-eye[1]:g} m below the mirror's middle (expected above)"
        elif not matrix[2, 3] > 0:
            yield ("matrix",), "has the mirror behind the projector (turn the sign of all numbers)"


class OutlineSpec(Model):
    """What of the mirror is lit: a disk as seen from above, or a rectangle."""

    disk: Positive | None = None
    """Diameter as seen from above, metres."""
    rectangle: Annotated[tuple[Positive, Positive], Items(2, "lengths, across and up the slope")] | None = (
        None
    )
    """Size across and up the slope, each plane of a tent its own, metres."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One of the two."""
        yield from exactly_one(self, "disk", "rectangle")


class MirrorSpec(Model):
    """The mirror."""

    tilt_deg: Annotated[float, Field(allow_inf_nan=False, ge=20, le=70)] = 45.0
    """Angle of the mirror's normal from the vertical."""
    outline: OutlineSpec
    """What of it is lit."""


class RotationSpec(Model):
    """How the mirror turns, and how often it is lit in a turn."""

    positions: Annotated[int, Field(ge=1, le=10_000)] = 288
    """Pictures a turn."""
    direction: Annotated[str, OneOf(("increasing", "decreasing"))] = "increasing"
    """Increasing turns from +X towards +Z: clockwise as seen from above."""
    first_deg: Number = 0.0
    """Angle of the side that the middle of the first picture serves: 0 is +X, 90 is +Z."""


class DiffuserSpec(Model):
    """How the mirror spreads light."""

    horizontal_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=30)] = 1.25
    """Width to the sides, of a lobe that falls to 0 evenly within as much to either side."""
    reflection: Annotated[str, OneOf(("plane", "cone"))] = "plane"
    """Light leaves in vertical planes, as nearly for viewers low over the mirror, or in cones, as it does."""


class PackingSpec(Model):
    """How pictures of one bit are sent to the projector."""

    images: Annotated[int, Field(ge=24, le=24)] = 24
    """Pictures in one that is sent."""
    order: Annotated[str, OneOf(("rgb", "rbg", "grb", "gbr", "brg", "bgr"))] = "rgb"
    """Order in which the channels are shown."""
    bits: Annotated[str, OneOf(("lsb", "msb"))] = "lsb"
    """Which bit of a channel is shown first: the least or the most significant."""
    refresh: Positive = 200.0
    """Pictures that are sent in a second, Hz."""
    rpm: Positive | None = None
    """Turns of the mirror a minute; checked against the other numbers where it is given."""


def _whole_turn(value: float) -> float:
    if not -360 <= value <= 360:
        raise complaint(f"must be from -360 to 360, got {value:g}")
    return value


class SideSpec(Model):
    """One plane of a tent of two mirrors."""

    azimuth_deg: Annotated[Number, AfterValidator(_whole_turn)]
    """Azimuth it serves, from that of the rotation."""
    ridge: Number = 0.0
    """Height at which its plane meets the axis, metres."""
    filter: Filter = (1.0, 1.0, 1.0)
    """Colour of what it returns of white light, linear."""
    matrix: PixelFromWorld | None = None
    """Its own calibration of the projector: pixels from world metres, three rows of four."""


class MirrorDisplayFile(FileModel):
    """A 360° light field display: pictures of one bit on a spinning mirror with a diffuser."""

    kind: ClassVar[str] = "quilt_display"

    quilt_display: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    display: Annotated[str, OneOf((KIND,)), Field(alias="kind")]
    """Kind of the display."""
    image: Size = (768, 768)
    """Width and height of a picture, pixels."""
    projector: ProjectorSpec
    """The projector."""
    mirror: MirrorSpec
    """The mirror."""
    rotation: RotationSpec = RotationSpec()
    """How the mirror turns."""
    diffuser: DiffuserSpec = DiffuserSpec()
    """How it spreads light."""
    packing: PackingSpec = PackingSpec()
    """How pictures are sent."""
    sides: Annotated[tuple[SideSpec, ...], Listed, Field(min_length=2, max_length=2)] | None = None
    """Two planes back to back; one mirror through the middle when absent."""
    filters: Annotated[str, OneOf(("rgb",))] | None = None
    """`rgb` for a projector of three chips with pictures of their own; one stream of pictures when absent."""

    def cross_checks(self) -> Iterator[Complaint]:
        """No projector has so many pixels; sides look away from one another; light reaches the mirror."""
        if max(self.image) > _MOST_PIXELS:
            yield ("image",), f"expected at most {_MOST_PIXELS} a side, got {self.image[0]} × {self.image[1]}"
        if self.sides is not None:
            apart = (self.sides[1].azimuth_deg - self.sides[0].azimuth_deg) % 360
            if abs(apart - 180) > 1e-9:
                yield ("sides", 1, "azimuth_deg"), f"must be 180 from the first side's, got {apart:g}"
            tinted = [side.filter for side in self.sides if side.filter != (1.0, 1.0, 1.0)]
            if self.filters and tinted:
                yield ("filters",), "cannot stand beside filters of sides (expected one or the other)"
        if wrong := self.timing.fault(self.packing.rpm):
            yield ("packing", "rpm"), wrong
        height = self.projector.height
        reach = self.reach
        if height is not None and reach >= height:
            yield (
                ("mirror", "outline"),
                f"reaches {reach:g} m, as far as the projector is high ({height:g} m)",
            )

    @property
    def timing(self) -> Timing:
        """How fast projector, pictures and mirror go."""
        lobe = self.diffuser.horizontal_deg
        return Timing(self.packing.refresh, self.rotation.positions, lobe, self.packing.images)

    @property
    def reach(self) -> float:
        """How far the mirror reaches from the axis in plan, metres."""
        outline = self.mirror.outline
        if outline.disk is not None:
            return outline.disk / 2
        assert outline.rectangle is not None
        across, up = outline.rectangle
        return math.hypot(
            across / 2, up * math.cos(math.radians(self.mirror.tilt_deg)) / (2 - bool(self.sides))
        )


def is_mirror(data: Any) -> bool:
    """Whether the data of a display file are those of such a display."""
    return isinstance(data, dict) and data.get("kind") == KIND
