"""The display file: which mesh or panels, how large, and how many pixels the facets have."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field, PlainValidator, WithJsonSchema

from quiltcli import geometry
from quiltcli.job.corrections import CorrectionsSpec
from quiltcli.job.layout import UvLayoutSpec
from quiltcli.job.lengths import UNITS, Coordinate, Length, UpAxis, exact_metres, read_length, up_matrix
from quiltcli.job.model import (
    FARTHEST,
    YAMLS,
    Complaint,
    Count,
    Direction,
    ExistingFile,
    FileModel,
    Items,
    Listed,
    MeshPath,
    Model,
    Number,
    OneOf,
    Positive,
    Size,
    Vec3,
    complaint,
    describe,
    exactly_one,
    one_of,
)
from quiltcli.job.places import PlaceOnPage, Quarter
from quiltcli.job.points import PointsSpec
from quiltcli.job.projections import ProjectionSpec
from quiltcli.job.projectors import BlendSpec, ProjectorSpec
from quiltcli.job.surfaces import SurfaceSpec


def _units(value: Any) -> Any:
    if isinstance(value, str):
        return one_of(UNITS, value, "a number of metres")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise complaint(f"expected m, cm, mm, in, ft or a number of metres, got {describe(value)}")
    if not 0 < value < float("inf"):
        raise complaint(f"must be greater than 0 and finite, got {describe(value)}")
    if not 1 / FARTHEST <= value <= FARTHEST:
        raise complaint(f"must be from 1e-09 to 1e+09 metres, got {describe(value)}")
    return float(value)


def _scale(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (value, value, value)
    if isinstance(value, (list, tuple)) and len(value) == 3:
        return tuple(value)
    raise complaint(f"expected a number or 3 numbers, got {describe(value)}")


_NUMBER_OR_3 = {
    "anyOf": [
        {"type": "number"},
        {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    ]
}
Row = Annotated[tuple[Number, Number, Number, Number], Items(4)]
Units = Annotated[
    str | float,
    PlainValidator(_units),
    WithJsonSchema({"anyOf": [{"enum": list(UNITS)}, {"type": "number", "exclusiveMinimum": 0}]}),
]
Scale = Annotated[tuple[Number, Number, Number], BeforeValidator(_scale), WithJsonSchema(_NUMBER_OR_3)]


class TransformSpec(Model):
    """Scale, then rotate about X, then Y, then Z, then translate; or a matrix that does it all."""

    translate: Vec3 | None = None
    """Shift, metres."""
    rotate_deg: Vec3 | None = None
    """Angles about X, then Y, then Z, degrees."""
    scale: Scale | None = None
    """One factor, or one for each axis."""
    matrix: Annotated[tuple[Row, Row, Row, Row], Items(4, "rows of 4 numbers")] | None = None
    """Four rows of four, for column vectors: the shift stands in the last column."""

    @property
    def array(self) -> geometry.FloatArray:
        """World from local (4, 4), float64."""
        if self.matrix is not None:
            return np.asarray(self.matrix, dtype=np.float64)
        zero, one = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
        return geometry.transform(self.translate or zero, self.rotate_deg or zero, self.scale or one)

    def cross_checks(self) -> Iterator[Complaint]:
        """A matrix stands alone; no transform flattens what it moves."""
        if self.matrix is None:
            if self.scale is not None and 0 in self.scale:
                yield ("scale",), "must not be 0"
            return
        for name in ("translate", "rotate_deg", "scale"):
            if getattr(self, name) is not None:
                yield (name,), "cannot stand beside matrix (expected one or the other)"
        if self.matrix[3] != (0.0, 0.0, 0.0, 1.0):
            yield ("matrix", 3), "the last row of an affine map is [0, 0, 0, 1]"
        elif np.linalg.matrix_rank(self.array[:3, :3]) < 3:
            yield ("matrix",), "flattens space (its determinant is 0)"


def _pitch(value: Any) -> Any:
    metres = read_length(value) if isinstance(value, str) else None
    if metres is None:
        raise complaint(f"expected a length such as 6 mm or 1/6 mm, got {describe(value)}")
    if not Fraction(1, 10**9) <= metres <= 10**9:
        raise complaint(f"must be from 1e-09 to 1e+09 metres, got {describe(value)}")
    return value


class ResolutionSpec(Model):
    """How many pixels the facets have: one of these keys."""

    pixels_per_metre: Positive | None = None
    """How dense the pixels are on every facet, pixels a metre."""
    pitch_mm: Positive | None = None
    """Distance from pixel to pixel, on every facet, millimetres."""
    pitch: Annotated[str, BeforeValidator(_pitch)] | None = None
    """The same as a length: 6 mm, 0.25 in, or a fraction such as 1/6 mm."""
    facet_pixels: Size | None = None
    """Width and height of every facet, for panels, pixels."""

    def cross_checks(self) -> Iterator[Complaint]:
        """One of them."""
        yield from exactly_one(self, *type(self).model_fields)

    @property
    def density(self) -> float | None:
        """Pixels a metre, to the last bit of what was written; None where facets have sizes of their own."""
        if self.pixels_per_metre is not None:
            return self.pixels_per_metre
        if self.pitch_mm is not None:
            return float(1000 / Fraction(str(self.pitch_mm)))
        length = read_length(self.pitch) if self.pitch is not None else None
        return None if length is None else float(1 / length)


class FacetSpec(Model):
    """What is different on one facet."""

    name: str = ""
    """A name for messages and tables."""
    facet_pixels: Size | None = None
    """Width and height of this facet, pixels."""
    up: Direction | None = None
    """World direction that is up in the facet's image."""
    rotate: Quarter = 0
    """Quarter turn of the raster, clockwise as seen from the lit side, degrees."""
    mirror: bool = False
    """Mirror the image, for rear projection."""
    enabled: bool = True
    """Whether the facet is rendered at all."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt; facets without one are packed around it."""


class PanelSpec(Model):
    """A flat rectangle, as a vendor's sheet or a tape measure gives it."""

    name: str = ""
    """A name for messages and tables."""
    pixels: Size
    """Width and height, pixels."""
    pitch: Length | None = None
    """Distance from pixel to pixel: a number of `units` (metres), or a text such as 6 mm or 1/6 mm."""
    size: Annotated[tuple[Length, Length], Items(2, "lengths, width and height")] | None = None
    """Width and height, instead of `pitch`: numbers of `units` (metres), or texts such as 4.5 m."""
    at: Annotated[tuple[Coordinate, Coordinate, Coordinate], Items(3, "lengths, x, y and z")]
    """Middle of the panel: numbers of `units` (metres), or texts such as 2.25 m."""
    yaw_deg: Number = 0.0
    """Turn about the vertical, anticlockwise from above; 0 faces +Z, or -Y where z is up."""
    pitch_deg: Number = 0.0
    """How far it is tilted up, after `yaw_deg`: 90 is a floor, -90 a ceiling, 0 a wall."""
    roll_deg: Number = 0.0
    """Turn in its own plane, after the other two, clockwise as seen from the lit side."""
    mirror: bool = False
    """Mirror the image, for rear projection."""
    enabled: bool = True
    """Whether the panel is rendered at all."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt; panels without one are packed around it."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A pitch or a size."""
        yield from exactly_one(self, "pitch", "size")

    def metres(self, unit: float) -> tuple[Fraction, Fraction]:
        """Width and height, exactly, where the file's unit is so many metres."""
        if self.size is not None:
            return exact_metres(self.size[0], unit), exact_metres(self.size[1], unit)
        assert self.pitch is not None
        step = exact_metres(self.pitch, unit)
        return step * self.pixels[0], step * self.pixels[1]


_NOT_PROJECTED = ("mesh", "panels", "surfaces", "points", "projection", "resolution", "transform", "layout")


class DisplayFile(FileModel):
    """A display: the faces of a mesh, panels, curved surfaces, projectors, or a projection about the eye."""

    kind: ClassVar[str] = "quilt_display"

    quilt_display: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    mesh: MeshPath | None = None
    """Polygon mesh; every face is one facet, in the order of the file."""
    panels: Annotated[tuple[PanelSpec, ...], Listed, Field(min_length=1)] | None = None
    """Flat rectangles instead of a mesh; every panel is one facet, in this order."""
    surfaces: Annotated[tuple[SurfaceSpec, ...], Listed, Field(min_length=1)] | None = None
    """Curved surfaces, instead of a mesh or panels or beside them; each is one facet, after the others."""
    points: PointsSpec | None = None
    """Single lights, instead of a mesh, panels or surfaces; each is a facet of one pixel."""
    projection: ProjectionSpec | None = None
    """A picture around the eye that goes along with it, instead of anything that stands in the world."""
    projectors: Annotated[tuple[ProjectorSpec, ...], Listed, Field(min_length=1)] | None = None
    """Projectors instead of anything that shines itself; each is one facet, in this order."""
    screen: Annotated[Path, ExistingFile(YAMLS, "a display file")] | None = None
    """What the projectors light: a display file with a mesh, panels or surfaces, whatever their pixels."""
    blend: BlendSpec | None = None
    """How pictures of projectors overlap; they add up as they are when absent."""
    units: Units = "m"
    """What the mesh or the panels are measured in: m, cm, mm, in, ft, or a number of metres."""
    up_axis: UpAxis = "y"
    """Axis that is up in the mesh or for the panels; with z up, its -Y faces the world's +Z."""
    viewing_side: Annotated[str, OneOf(("front", "back", "both"))] = "front"
    """Lit side: front, where the winding faces; back, seen from inside; both."""
    resolution: ResolutionSpec | None = None
    """How many pixels the facets of a mesh have; panels have pixels of their own, and where `layout` is given
    the texture coordinates tell."""
    facets: dict[Count, FacetSpec] = Field(default_factory=dict)
    """What is different on single facets, by facet id."""
    transform: TransformSpec | None = None
    """Place of the display in the world."""
    corrections: CorrectionsSpec | None = None
    """What the panels make of their images, which the images make up for."""
    layout: UvLayoutSpec | None = None
    """Take the layout from the texture coordinates of the mesh."""

    @property
    def metres(self) -> float:
        """Length of one mesh unit, metres."""
        return UNITS[self.units] if isinstance(self.units, str) else self.units

    @property
    def world_from_local(self) -> geometry.FloatArray | None:
        """World from the mesh or the panels, both in metres (4, 4); None where they are the same."""
        if self.up_axis == "y":
            return None if self.transform is None else self.transform.array
        upright = up_matrix(self.up_axis)
        return upright if self.transform is None else np.asarray(self.transform.array @ upright)

    def cross_checks(self) -> Iterator[Complaint]:
        """A mesh or panels, each with keys of its own; a mirrored display would be lit on the wrong side."""
        yield from self._of_projectors()
        if self.projectors is not None:
            return
        if self.projection is not None:
            yield from self._beside_projection()
            return
        if self.points is not None:
            yield from self._beside_points()
            return
        if self.mesh is None and self.panels is None and self.surfaces is None:
            words = "missing key (polygon mesh; or panels: flat rectangles; or surfaces; or a projection)"
            yield ("mesh",), words
        elif self.mesh is not None and self.panels is not None:
            yield ("panels",), "cannot stand beside mesh (expected only one of mesh or panels)"
        placed = self.mesh is None and self.surfaces
        if self.panels is None and self.resolution is None and self.layout is None and not placed:
            words = "missing key (how many pixels the facets have; or layout: {from_uv: true, size: [W, H]}"
            yield ("resolution",), f"{words} for a mesh whose texture coordinates tell)"
        if self.panels is not None:
            yield from self._beside_panels()
        elif self.mesh is None and self.surfaces is not None:
            yield from self._surfaces_alone()
        if self.transform is not None and np.linalg.det(self.transform.array[:3, :3]) < 0:
            yield ("transform",), "mirrors the display (its determinant is negative)"

    def _beside_panels(self) -> Iterator[Complaint]:
        """What only a mesh can have."""
        if self.resolution is not None:
            yield ("resolution",), "belongs to a mesh (each of the panels has pixels of its own)"
        if self.facets:
            yield ("facets",), "belongs to a mesh (name, place, mirror and enabled are keys of each panel)"
        if self.layout is not None:
            yield ("layout",), "takes texture coordinates of a mesh (give the panels a place instead)"
        if self.viewing_side == "back":
            yield (
                ("viewing_side",),
                "expected front or both beside panels (turn one by yaw_deg: 180), got back",
            )

    def _of_projectors(self) -> Iterator[Complaint]:
        """Projectors are all of their display, and need a screen; nothing else has one."""
        if self.projectors is None:
            for name in ("screen", "blend"):
                if getattr(self, name) is not None:
                    yield (name,), "belongs to projectors (expected projectors: a list of them)"
            return
        for name in _NOT_PROJECTED:
            if getattr(self, name) is not None:
                yield (name,), "cannot stand beside projectors (the screen's file says where it stands)"
        if self.facets:
            yield ("facets",), "cannot stand beside projectors (name, mask and place are keys of each)"
        for name, default in (("viewing_side", "front"), ("up_axis", "y")):
            if getattr(self, name) != default:
                yield (name,), f"cannot stand beside projectors, got {getattr(self, name)}"
        if self.screen is None and any(one.map is None for one in self.projectors):
            yield ("screen",), "missing key (a display file: what the projectors light)"

    def _beside_projection(self) -> Iterator[Complaint]:
        """A projection is all of its display, and stands nowhere in the world."""
        for name in ("mesh", "panels", "surfaces", "points", "resolution", "transform", "layout"):
            if getattr(self, name) is not None:
                yield (name,), "cannot stand beside projection (a projection is the whole display)"
        if self.facets:
            yield ("facets",), "cannot stand beside projection (a projection is the whole display)"
        if self.viewing_side != "front":
            yield ("viewing_side",), f"cannot stand beside projection, got {self.viewing_side}"

    def _beside_points(self) -> Iterator[Complaint]:
        """Points are all of their display, and are lit to all sides."""
        for name in ("mesh", "panels", "surfaces", "resolution", "layout"):
            if getattr(self, name) is not None:
                yield (name,), "cannot stand beside points (points are the whole display, a pixel each)"
        if self.facets:
            yield ("facets",), "cannot stand beside points (points are the whole display, a pixel each)"
        if self.corrections is not None and self.corrections.brightness is not None:
            words = "belongs to panels, which darken aslant (points have no side that they face)"
            yield ("corrections", "brightness"), words
        if self.viewing_side == "back":
            yield (
                ("viewing_side",),
                "expected no such key beside points (lit to all sides), got back",
            )
        if self.transform is not None and np.linalg.det(self.transform.array[:3, :3]) < 0:
            yield ("transform",), "mirrors the display (its determinant is negative)"

    def _surfaces_alone(self) -> Iterator[Complaint]:
        """What only a mesh or panels can have."""
        if self.resolution is not None:
            yield ("resolution",), "belongs to a mesh (each of the surfaces has pixels of its own)"
        if self.facets:
            yield ("facets",), "belongs to a mesh (name, place and mirror are keys of each surface)"
        if self.layout is not None:
            yield ("layout",), "takes texture coordinates of a mesh (give the surfaces a place instead)"
        if self.viewing_side != "front":
            yield (
                ("viewing_side",),
                f"belongs to a mesh (each surface says where it is lit), got {self.viewing_side}",
            )
