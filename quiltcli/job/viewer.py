"""The viewer of a job: depth range and path."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    WithJsonSchema,
)

from quiltcli.errors import JobError
from quiltcli.job.display import Units
from quiltcli.job.frames import parse_frames
from quiltcli.job.keyframed import Keyframed
from quiltcli.job.lengths import UNITS
from quiltcli.job.model import (
    FARTHEST,
    Complaint,
    Direction,
    ExistingFile,
    FrameNumber,
    Items,
    Listed,
    Model,
    Number,
    OneOf,
    Positive,
    ShortFor,
    Vec3,
    complaint,
    describe,
    exactly_one,
)
from quiltcli.job.recorded import RecordedSpec

Vector = tuple[float, float, float]


def read_range(value: Any) -> Any:
    """Frames as YAML gives them: a range text or one whole number."""
    if isinstance(value, tuple):
        return value
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise complaint(f"expected a frame range such as 1-240, 1-9x2 or 1,5,20-30, got {describe(value)}")
    try:
        return parse_frames(str(value))
    except JobError as error:
        raise complaint(error.problems[0].message) from None


FrameRange = Annotated[
    tuple[int, ...],
    BeforeValidator(read_range),
    WithJsonSchema({"type": ["string", "integer"], "examples": ["1-240", "1-9x2", "1,5,20-30"]}),
]


def pose_complaints(
    eye: Vector, look_at: Vector | None, look: Vector | None, up: Vector
) -> Iterator[Complaint]:
    """What makes a pose impossible."""
    if look_at is not None:
        look = (look_at[0] - eye[0], look_at[1] - eye[1], look_at[2] - eye[2])
        if math.hypot(*look) < 1e-9:
            yield ("look_at",), "is where the viewer is (expected a point to look at)"
            return
    if look is not None and parallel(look, up):
        yield ("look_at" if look_at is not None else "look",), "looks along up (turn up to another direction)"


def parallel(a: Vector, b: Vector) -> bool:
    """Whether two vectors (3,) enclose less than a millionth of a radian, either way round."""
    across = math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return across <= 1e-6 * math.hypot(*a) * math.hypot(*b)


Quaternion = tuple[Number, Number, Number, Number]
AIMS = ("look_at", "look", "orientation")


def _turning(value: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    if math.hypot(*value) < 1e-6:
        raise complaint("must not be 0 (expected a quaternion x, y, z, w)")
    return value


class KeyframeSpec(Model):
    """The pose at one frame."""

    frame: FrameNumber
    """Frame number."""
    position: Vec3
    """Place of the eye, metres."""
    look_at: Vec3 | None = None
    """Point that is looked at, metres."""
    look: Direction | None = None
    """Direction of view, instead of `look_at`."""
    orientation: Annotated[Quaternion, Items(4), AfterValidator(_turning)] | None = None
    """How the head is turned, instead of an aim: quaternion x, y, z, w; unturned it looks along −Z, +Y up."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction that is up in the view."""

    @property
    def aim(self) -> str:
        """The key that says where the viewer looks; empty where none does."""
        return next((name for name in AIMS if getattr(self, name) is not None), "")

    def cross_checks(self) -> Iterator[Complaint]:
        """One aim at most, and a possible one."""
        if sum(getattr(self, name) is not None for name in AIMS) > 1:
            yield from exactly_one(self, *AIMS)
        if self.orientation is not None and "up" in self.model_fields_set:
            yield ("up",), "cannot stand beside orientation, which says what is up"
        yield from pose_complaints(self.position, self.look_at, self.look, self.up)


def _nonzero(value: float) -> float:
    if value == 0:
        raise complaint("must not be 0")
    return value


class OrbitSpec(Model):
    """A circle about the vertical axis through a centre."""

    center: Vec3
    """Centre, metres."""
    radius: Annotated[Positive, Field(le=FARTHEST)]
    """Distance from the centre, or from the vertical axis when `height` is given, metres."""
    height: Number | None = None
    """Height of the eye over the centre, metres."""
    elevation_deg: Annotated[float, Field(allow_inf_nan=False, ge=-90, le=90)] | None = None
    """Angle of the eye over the horizon as seen from the centre, instead of `height`."""
    start_deg: Number = 0.0
    """Angle at the first frame: 0 stands on the +Z side, 90 on the +X side."""
    start_frame: FrameNumber = 1
    """Frame at which the eye is at `start_deg`."""
    frames_per_turn: Annotated[Number, AfterValidator(_nonzero)] | None = None
    """Frames for a whole turn, for ever; negative turns the other way."""
    end_deg: Number | None = None
    """Angle at `end_frame`, instead of whole turns; the eye rests before and after."""
    end_frame: FrameNumber | None = None
    """Frame at which the eye is at `end_deg`."""
    look_at: Vec3 | None = None
    """Point that is looked at, the centre when absent, metres."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction that is up in the view."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Turn or sweep, height or elevation."""
        yield from exactly_one(self, "frames_per_turn", "end_deg")
        if self.height is not None and self.elevation_deg is not None:
            yield ("elevation_deg",), "cannot stand beside height (expected one or the other)"
        if (self.end_deg is None) != (self.end_frame is None):
            missing = "end_deg" if self.end_deg is None else "end_frame"
            yield (missing,), "missing key (end_deg and end_frame go together)"
        if self.end_frame is not None and self.end_frame <= self.start_frame:
            yield ("end_frame",), f"must be after start_frame ({self.start_frame}), got {self.end_frame}"


class CsvSpec(Model):
    """A recorded path: one row a frame."""

    file: Annotated[Path, ExistingFile((".csv", ".txt"), "a CSV file")]
    """CSV file with frame, x, y, z, and if it has them look_at_x … or look_x …, and up_x …; or qx, qy, qz, qw
    or yaw_deg, pitch_deg, roll_deg."""
    units: Units = "m"
    """What positions are measured in: m, cm, mm, in, ft, or a number of metres."""
    fill: bool = False
    """Interpolate linearly over frames that have no row; otherwise they are an error."""
    look_at: Vec3 | None = None
    """Point that is looked at, when the file does not say, metres."""
    look: Direction | None = None
    """Direction of view, when the file does not say."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction that is up in the view, when the file does not say."""

    @property
    def metres(self) -> float:
        """Length of one unit of the file, metres."""
        return UNITS[self.units] if isinstance(self.units, str) else self.units

    def cross_checks(self) -> Iterator[Complaint]:
        """One aim at most."""
        if self.look_at is not None and self.look is not None:
            yield from exactly_one(self, "look_at", "look")


def _csv(value: Any) -> Any:
    return value if isinstance(value, (dict, Model)) else {"file": value}


OR_FILE = ShortFor(_csv, {"type": "string", "format": "path", "minLength": 1})


class PathSpec(Keyframed):
    """Where the viewer is: exactly one kind of path."""

    keyframes: Annotated[tuple[KeyframeSpec, ...], Listed, Field(min_length=1)] | None = None
    """Poses at some frames; the ends are held."""
    interpolation: Annotated[str, OneOf(("linear", "smooth", "hold"))] | None = None
    """Between keyframes: linear (the default), smooth, hold."""
    orbit: OrbitSpec | None = None
    """A circle."""
    csv: Annotated[CsvSpec, OR_FILE] | None = None
    """A recorded path of one row a frame: a file name, or a mapping with `file`."""
    recorded: Annotated[RecordedSpec, OR_FILE] | None = None
    """A take of a tracker or a camera: a file name, or a mapping with `file`."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One kind, keyframes apart in time, all aimed the same way."""
        yield from exactly_one(self, "keyframes", "orbit", "csv", "recorded")
        yield from self.keyframe_checks()
        keyframes = self.keyframes or ()
        for i, key in enumerate(keyframes):
            if key.aim != keyframes[0].aim:
                words = "keyframes[0] aims the other way (use look_at in all keyframes, or look in all)"
                if "orientation" in (key.aim, keyframes[0].aim):
                    words = "keyframes[0] aims otherwise (use orientation in all keyframes, or in none)"
                elif not (key.aim and keyframes[0].aim):
                    words = "keyframes[0] aims otherwise (aim all keyframes, or none)"
                yield ("keyframes", i, key.aim or "position"), words


class StereoSpec(Model):
    """Two eyes."""

    separation: Positive = 0.063
    """Distance between the eyes, metres."""
    eye_time: Annotated[str, OneOf(("same", "own"))] = "same"
    """When the right eye looks: with the left (same), or half a frame later (own), as displays do that show
    one eye after the other."""


def _facets(value: Any) -> Any:
    if value is None or isinstance(value, tuple):
        return value
    if isinstance(value, list) and all(type(one) is int for one in value):
        value = ",".join(map(str, value))
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise complaint(f"expected facets such as 1-3 or 1,5,7-9, got {describe(value)}")
    try:
        ids = parse_frames(str(value))
    except JobError as error:
        raise complaint(error.problems[0].message.replace("frame", "facet")) from None
    if min(ids) < 1:
        raise complaint(f"facets are counted from 1, got {min(ids)}")
    return ids


FacetIds = Annotated[
    tuple[int, ...] | None,
    BeforeValidator(_facets),
    WithJsonSchema({"type": ["string", "integer"], "examples": ["1-3", "1,5,7-9"]}),
]


class ViewerSpec(Model):
    """The viewer."""

    near: Positive
    """Nearest depth that is drawn, from the eye, metres."""
    far: Positive
    """Farthest depth that is drawn, metres."""
    path: PathSpec
    """Where the eye is; where there are two, the place between them."""
    stereo: StereoSpec | None = None
    """Two eyes; one when absent."""
    facets: FacetIds = None
    """Facets that are drawn for this viewer, where there are several."""

    def cross_checks(self) -> Iterator[Complaint]:
        """The depth range is not empty."""
        if self.near >= self.far:
            yield ("far",), f"must be greater than near ({self.near:g}), got {self.far:g}"
