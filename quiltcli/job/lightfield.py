"""The light field file: photographs from a ring around an object, as what a display is to show."""

from __future__ import annotations

import contextlib
import json
import math
import string
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import AfterValidator, Discriminator, Field, Tag

from quiltcli.formats.inputs import name_fault
from quiltcli.job.lengths import UpAxis
from quiltcli.job.model import (
    Complaint,
    Count,
    ExistingFile,
    FileModel,
    Items,
    Listed,
    Model,
    Natural,
    Number,
    OneOf,
    Positive,
    Size,
    Vec3,
    complaint,
)

TURNS = ("clockwise", "anticlockwise")
ENCODINGS = ("srgb", "linear")
FOCUSES = ("mirror", "axis", "depth")
SLICES = ("linear", "nearest", "quads")
FIELDS = ("row", "view", "frame")


def _pattern(text: str) -> str:
    """A pattern of file names, if it can be filled in."""
    try:
        names = [name for _, name, _, _ in string.Formatter().parse(text) if name is not None]
        text.format(row=1, view=1, frame=1)
    except (ValueError, KeyError, IndexError, AttributeError):
        raise complaint(f"expected a name with {{row}}, {{view}} and {{frame}} in it, got {text!r}") from None
    if "view" not in names:
        raise complaint("names the same file for every view (expected {view} or {view:04} in it)")
    return text


Pattern = Annotated[str, AfterValidator(_pattern)]


SUFFIXES = (".png", ".jpg", ".jpeg", ".exr")
"""Suffixes of pictures, which a file of poses may leave out."""


def posed_picture(folder: Path, name: object) -> Path | None:
    """The picture that a file of poses in a folder names, if there is one."""
    if not isinstance(name, str) or not name or name_fault(folder / name):
        return None
    file = folder / name
    candidates = (file, *(file.with_name(file.name + suffix) for suffix in SUFFIXES))
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _posed(path: Path) -> Iterator[Path]:
    """Pictures that a file of poses names; what else is wrong with it is told when it is read."""
    with contextlib.suppress(ValueError, OSError, TypeError, KeyError):
        for entry in json.loads(path.read_bytes())["frames"]:
            picture = posed_picture(path.parent, entry["file_path"])
            if picture is not None:
                yield picture


class HeightsSpec(Model):
    """Heights of rows of cameras that are evenly spaced."""

    first: Number
    """Height of the first row over the middle of the mirror, metres."""
    step: Number
    """From one row to the next, upwards, metres."""
    count: Count
    """Rows."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Rows do not lie upon one another."""
        if self.count > 1 and self.step <= 0:
            yield ("step",), f"must be greater than 0 where there are several rows, got {self.step:g}"


def _heights_tag(value: Any) -> str:
    return "<list>" if isinstance(value, (list, tuple)) else "<HeightsSpec>"


Heights: TypeAlias = Annotated[
    Annotated[tuple[Number, ...], Field(min_length=1), Listed, Tag("<list>")]
    | Annotated[HeightsSpec, Tag("<HeightsSpec>")],
    Discriminator(_heights_tag),
]


class CameraSpec(Model):
    """The camera that took the pictures: its lens, and where it looks."""

    focal: Annotated[tuple[Positive, Positive], Items(2, "numbers, across and down")] | None = None
    """Focal lengths across and down, pixels."""
    centre: Annotated[tuple[Number, Number], Items(2, "numbers, x and y")] | None = None
    """Where the axis of the lens meets the picture; its middle when absent, pixels."""
    size: Size | None = None
    """Width and height of the pictures, pixels."""
    tilt_deg: Annotated[float, Field(allow_inf_nan=False, gt=-90, lt=90)] | None = None
    """How far the camera looks up, below 0 down, from level towards the axis; level when absent."""
    look_at: Vec3 | None = None
    """A point that every camera looks at, instead of `tilt_deg`, metres."""
    transforms: Annotated[Path, ExistingFile((".json",), "a JSON file of poses")] | None = None
    """A transforms.json with lens, poses and pictures, instead of everything else."""
    up_axis: UpAxis = "y"
    """Which axis of `transforms` is up: y or z."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A file of poses, or a lens and where it looks."""
        if self.transforms is not None:
            for name in ("focal", "centre", "size", "tilt_deg", "look_at"):
                if getattr(self, name) is not None:
                    yield (name,), "cannot stand beside transforms, which says it (expected one or the other)"
            return
        if self.up_axis != "y":
            yield ("up_axis",), "is for transforms alone"
        for name in ("focal", "size"):
            if getattr(self, name) is None:
                yield (name,), "missing key (or transforms, a file of lens and poses)"
        if self.tilt_deg is not None and self.look_at is not None:
            yield ("look_at",), "cannot stand beside tilt_deg (expected one or the other)"


class LightfieldFile(FileModel):
    """Pictures of an object from a ring of places around it."""

    kind: ClassVar[str] = "quilt_lightfield"

    quilt_lightfield: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    images: Pattern | None = None
    """Names of the pictures: {view:04} is the number of a view, {row:02} of its row, {frame:04} its frame."""
    depths: Pattern | None = None
    """Names of depth maps in the same way, EXR files with a channel Z: distance ahead of the camera."""
    views: Count | None = None
    """Views a turn, evenly spaced."""
    first_view: Natural = 1
    """Number of the first view in file names."""
    first_row: Natural = 1
    """Number of the first row in file names."""
    camera_turns: Annotated[str, OneOf(TURNS)] = "clockwise"
    """How the camera goes around the object from view to view, as seen from above."""
    first_deg: Number = 0.0
    """Azimuth of the first view: 0 is +X, 90 is +Z."""
    distance: Positive | None = None
    """Distance of the cameras from the axis, metres."""
    heights: Heights | None = None
    """Heights of the rows of cameras, a list from low to high or first, step and count, metres."""
    camera: CameraSpec
    """The camera."""
    encoding: Annotated[str, OneOf(ENCODINGS)] = "srgb"
    """What the pictures' numbers are: srgb, or linear; those of EXR files are linear always."""
    focus: Annotated[str, OneOf(FOCUSES)] = "mirror"
    """Where the cameras beside a ray are made to agree: on the mirror, at the axis, or by depth maps."""
    slices: Annotated[str, OneOf(SLICES)] = "linear"
    """How rows are chosen: blended, the nearest one, or the nearest along straight lines of the picture."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A file of poses says which pictures there are; without one, all of it is here."""
        ring = ("images", "views", "distance", "heights")
        if self.camera.transforms is not None:
            for name in ring:
                if getattr(self, name) is not None:
                    yield (name,), "cannot stand beside camera.transforms, which says it"
        else:
            for name in ring:
                if getattr(self, name) is None:
                    yield (name,), "missing key (or camera.transforms, a file of poses)"
        heights = self.rows
        for i, (low, high) in enumerate(pairwise(heights)):
            if high <= low:
                yield ("heights", i + 1), f"must be above the row before ({low:g}), got {high:g}"
        if len(heights) > 1 and self.images is not None and "{row" not in self.images:
            yield ("images",), "names the same file for every row (expected {row} or {row:02} in it)"
        if self.focus == "depth" and self.depths is None:
            yield ("depths",), "missing key (focus: depth needs depth maps)"

    @property
    def rows(self) -> tuple[float, ...]:
        """Heights of the rows, metres; none where a file of poses says them."""
        if self.heights is None:
            return ()
        if isinstance(self.heights, HeightsSpec):
            first, step = self.heights.first, self.heights.step
            return tuple(first + step * i for i in range(self.heights.count))
        return self.heights

    @property
    def is_animated(self) -> bool:
        """Whether there are pictures for every frame."""
        return self.images is not None and "{frame" in self.images

    def named(self, pattern: str, row: int, view: int, frame: int) -> Path:
        """File of a row and view, both from 0, in a frame."""
        number = {"row": row + self.first_row, "view": view + self.first_view, "frame": frame}
        return (self.source.path or Path()).parent / pattern.format(**number)

    def pictures(self, frames: Iterable[int]) -> Iterator[Path]:
        """All pictures and depth maps of some frames, as far as this file or that of poses names them."""
        if self.camera.transforms is not None:
            yield from _posed(self.camera.transforms)
        patterns = [pattern for pattern in (self.images, self.depths) if pattern is not None]
        for frame in frames if self.is_animated else (1,):
            for row in range(len(self.rows)):
                for view in range(self.views or 0):
                    yield from (self.named(pattern, row, view, frame) for pattern in patterns)

    def azimuths(self) -> tuple[float, ...]:
        """Azimuth of every view, radians."""
        sign = 1 if self.camera_turns == "clockwise" else -1
        count = self.views or 0
        return tuple(math.radians(self.first_deg + sign * 360 * k / count) for k in range(count))
