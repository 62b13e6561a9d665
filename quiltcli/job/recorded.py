"""A recorded head or camera: the file of a tracker, and how it becomes a path in the world."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from quiltcli.geometry import FloatArray
from quiltcli.job.display import TransformSpec, Units
from quiltcli.job.lengths import UNITS
from quiltcli.job.model import (
    Complaint,
    Direction,
    ExistingFile,
    Items,
    Listed,
    Model,
    Natural,
    NotNegative,
    OneOf,
    Positive,
    Seconds,
    ShortFor,
    Vec3,
    complaint,
    exactly_one,
)

TAKE_FORMATS = (
    *("csv", "tum", "motive", "vicon", "trc", "opentrack", "freed", "chan", "touchdesigner"),
    *("arkit", "hfcs", "gltf", "usd"),
)
ROTATION_ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "vector")
FILTERS = ("none", "savitzky_golay", "rts", "one_euro")
_AXES = ("x", "y", "z", "-x", "-y", "-z")


def _three_axes(value: tuple[str, str, str]) -> tuple[str, str, str]:
    if len({name[-1] for name in value}) < 3:
        raise complaint("names one axis twice (expected x, y and z once each, with or without a minus)")
    return value


_SAVITZKY_GOLAY = ("window", "order")
_RTS = ("position_noise", "rotation_noise_deg", "jerk", "turn_jerk_deg")
_ONE_EURO = ("min_cutoff", "beta", "rotation_min_cutoff", "rotation_beta", "speed_cutoff")
_OWNERS = {
    key: kind
    for kind, keys in (("savitzky_golay", _SAVITZKY_GOLAY), ("rts", _RTS), ("one_euro", _ONE_EURO))
    for key in keys
}


class FilterSpec(Model):
    """A filter without lag; keys that are absent have the defaults said here."""

    kind: Annotated[str, OneOf(FILTERS)]
    """savitzky_golay, rts (Rauch-Tung-Striebel), one_euro (forwards and backwards) or none."""
    window: Positive | None = None
    """savitzky_golay: seconds that each polynomial is fitted to; 0.2."""
    order: Annotated[Natural, Field(le=9)] | None = None
    """savitzky_golay: degree of the polynomials; 3."""
    position_noise: Positive | None = None
    """rts: standard deviation of a measured coordinate, metres; 0.002."""
    rotation_noise_deg: Positive | None = None
    """rts: standard deviation of a measured angle, degrees; 0.5."""
    jerk: Positive | None = None
    """rts: how freely acceleration may change, m/s³ over a second; 3."""
    turn_jerk_deg: Positive | None = None
    """rts: the same of turning, °/s³ over a second; 1000."""
    min_cutoff: Positive | None = None
    """one_euro: cutoff at rest, Hz; 2."""
    beta: NotNegative | None = None
    """one_euro: how much the cutoff grows, Hz for each m/s; 12."""
    rotation_min_cutoff: Positive | None = None
    """one_euro: cutoff of rotations at rest, Hz; 2."""
    rotation_beta: NotNegative | None = None
    """one_euro: how much the cutoff of rotations grows, Hz for each rad/s; 6."""
    speed_cutoff: Positive | None = None
    """one_euro: cutoff of the speed that the cutoff follows, Hz; 1."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Every key belongs to the filter."""
        for key, kind in _OWNERS.items():
            if getattr(self, key) is not None and kind != self.kind:
                yield (key,), f"belongs to {kind}, and the filter is {self.kind}"


class GapsSpec(Model):
    """What becomes of times at which nothing was recorded."""

    fill: NotNegative = 0.1
    """Longest gap that is filled by interpolation, seconds."""
    then: Annotated[str, OneOf(("error", "hold"))] = "error"
    """Longer gaps: an error where a frame falls into one, or the last pose held."""
    jump: Positive = 3.0
    """Speed above which two neighbouring samples are a jump, m/s; one that comes back is a lost sample."""
    jump_deg: Positive = 2000.0
    """The same of turning: a sample turned away faster that comes back is a lost sample, degrees a second."""


class MarkerSpec(Model):
    """Where the eye, or the place between the eyes, is on the marker; rigid, so it turns with it."""

    translate: Vec3 = (0.0, 0.0, 0.0)
    """Place in the marker's axes (x right, y up, z back), metres."""
    rotate_deg: Vec3 = (0.0, 0.0, 0.0)
    """How the head is turned in the marker's axes: about X, then Y, then Z, degrees."""


_PLACE = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}


def _marker(value: Any) -> Any:
    return {"translate": value} if isinstance(value, (list, tuple)) else value


def _filter(value: Any) -> Any:
    return {"kind": value} if isinstance(value, str) else value


class RecordedSpec(Model):
    """A take of a tracker, a camera's or an animator's."""

    file: Annotated[Path, ExistingFile((), "a take")]
    """The file."""
    format: Annotated[str, OneOf(("auto", *TAKE_FORMATS))] = "auto"
    """What wrote it; auto looks at its name and first lines."""
    subject: str | None = None
    """Rigid body, marker, node, camera or prim, where the file has several."""
    units: Units | None = None
    """What positions are measured in, where the file does not say: m, cm, mm, in, ft or metres."""
    up_axis: Annotated[str, OneOf(("y", "z"))] | None = None
    """The axis that is up in the file; where that is z, an unturned head looks along +Y."""
    axes: (
        Annotated[
            tuple[Annotated[str, OneOf(_AXES)], Annotated[str, OneOf(_AXES)], Annotated[str, OneOf(_AXES)]],
            Items(3, "axes"),
            AfterValidator(_three_axes),
        ]
        | None
    ) = None
    """Instead of up_axis: the file's axes that go right, up and back, such as [x, z, -y]."""
    rotation_order: Annotated[str, OneOf(ROTATION_ORDERS)] | None = None
    """What three angles mean, where the format does not say: the fixed axes turned about, first to last; or
    vector, the axis times the angle."""
    columns: Annotated[tuple[str, ...], Listed, Field(min_length=1)] | None = None
    """Names of the columns of a file that has none; `-` leaves one out."""
    rate: Positive | None = None
    """Samples a second, where the file has no times."""
    world_from_tracker: TransformSpec | None = None
    """Place of the tracker's axes in the world: rigid, or scaled alike in all directions."""
    eye_from_marker: Annotated[MarkerSpec, ShortFor(_marker, _PLACE)] | None = None
    """Place of the eye in the marker's axes, metres; or a mapping with translate and rotate_deg."""
    time_offset: Seconds = 0.0
    """Seconds added to every stamp."""
    time_scale: Positive = 1.0
    """Seconds of the world in a second of the take's clock, from the take's first stamp on."""
    start: Seconds = 0.0
    """Second of the take that `start_frame` shows."""
    start_frame: int = 1
    """Frame that shows second `start`."""
    gaps: GapsSpec = GapsSpec()
    """What becomes of times at which nothing was recorded."""
    filter: Annotated[FilterSpec, ShortFor(_filter, {"type": "string"})] = FilterSpec(kind="none")
    """Noise filter: its name, or a mapping with `kind` and its parameters."""
    look_at: Vec3 | None = None
    """Point that is looked at (metres), whatever the take says."""
    look: Direction | None = None
    """Direction of view, whatever the take says."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction that is up in the view, for takes without rotations."""

    @property
    def metres(self) -> float | None:
        """Length of one unit as stated, metres; None where nothing is."""
        return UNITS[self.units] if isinstance(self.units, str) else self.units

    @property
    def axis_map(self) -> FloatArray | None:
        """Rows (3, 3) that make x right, y up, z back of the file's axes; None where they are not stated."""
        names = self.axes or {"y": ("x", "y", "z"), "z": ("x", "z", "-y")}.get(self.up_axis or "")
        if names is None:
            return None
        rows = np.zeros((3, 3))
        for row, name in enumerate(names):
            rows[row, "xyz".index(name[-1])] = -1 if name[0] == "-" else 1
        return rows

    def cross_checks(self) -> Iterator[Complaint]:
        """One aim at most, one statement of axes, and a placement that keeps shapes."""
        if self.look_at is not None and self.look is not None:
            yield from exactly_one(self, "look_at", "look")
        if self.axes is not None and self.up_axis is not None:
            yield from exactly_one(self, "axes", "up_axis")
        if self.world_from_tracker is not None:
            turn = self.world_from_tracker.array[:3, :3]
            size = float(np.cbrt(np.linalg.det(turn)))
            if size <= 0:
                yield ("world_from_tracker",), "mirrors the take (its determinant is negative)"
            elif np.abs(turn.T @ turn / size**2 - np.eye(3)).max() > 1e-6:
                yield (
                    ("world_from_tracker",),
                    "bends the take (expected one scale for all axes, and no shear)",
                )
