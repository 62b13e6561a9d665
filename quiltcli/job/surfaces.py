"""Curved displays: the surfaces that pixels are glued to, a model a kind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from quiltcli.geometry.formulas import FormulaError, parse
from quiltcli.job.lengths import UNITS, Coordinate, Length
from quiltcli.job.model import (
    Complaint,
    ExistingFile,
    Items,
    Listed,
    Model,
    NotNegative,
    Number,
    OneOf,
    Positive,
    Size,
    Vec3,
)
from quiltcli.job.places import PlaceOnPage
from quiltcli.job.tagged import tagged

MAPS = (".exr", ".pfm")
PICTURES = (".exr", ".pfm", ".png", ".tif", ".tiff", ".jpg")
ROUND = ("outside", "inside")
SHEET = ("front", "back")
LYING = ("front", "back", "above", "below")

Degrees = Annotated[Number, Field(ge=-3600, le=3600)]
Range = Annotated[tuple[Degrees, Degrees], Items(2, "degrees, the first and the last")]
Point = Annotated[tuple[Coordinate, Coordinate, Coordinate], Items(3, "lengths, x, y and z")]
Points = Annotated[tuple[Point, ...], Listed, Field(min_length=2)]
Numbers = Annotated[tuple[Number, ...], Listed, Field(min_length=2)]


class SurfaceBase(Model):
    """What all surfaces have."""

    name: str = ""
    """A name for messages and tables."""
    pixels: Size
    """Width and height, pixels."""
    mirror: bool = False
    """Mirror the image left to right, for rear projection or a surface that runs the other way."""
    mask: Annotated[Path, ExistingFile(PICTURES, "a picture")] | None = None
    """Picture of as many pixels; the surface has none where it is black or transparent."""
    at: Point = (0.0, 0.0, 0.0)
    """Where its own origin lies: numbers of `units` (metres), or texts such as 2.25 m."""
    rotate_deg: Vec3 = (0.0, 0.0, 0.0)
    """Angles about X, then Y, then Z, before it is put there, degrees."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt; surfaces without one are packed around it."""


def not_empty(model: Model, *names: str) -> Iterator[Complaint]:
    """Complain of ranges that hold nothing."""
    for name in names:
        first, last = getattr(model, name)
        if first == last:
            yield (name,), f"the first and the last are both {first:g} (expected a range)"


class PlaneSurface(SurfaceBase):
    """A flat rectangle about its origin that faces +Z."""

    kind: Literal["plane"]
    """Kind of surface."""
    width: Length
    """Width: a number of `units` (metres), or a text such as 4 m."""
    height: Length
    """Height: a number of `units` (metres), or a text such as 4 m."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Lit side: front, where it faces +Z, or back."""


class SphereSurface(SurfaceBase):
    """A sphere, or a part of one: R (sin b sin a, cos b, sin b cos a)."""

    kind: Literal["sphere"]
    """Kind of surface."""
    radius: Length
    """Radius R: a number of `units` (metres), or a text such as 4 m."""
    arc_deg: Range = (-180.0, 180.0)
    """The angle a about the vertical, from +Z towards +X: its first and last value, degrees."""
    zenith_deg: Annotated[tuple[Degrees, Degrees], Items(2, "degrees")] = (0.0, 180.0)
    """The angle b from the zenith: that of the upper edge and that of the lower one, degrees."""
    lit: Annotated[str, OneOf(ROUND)] = "outside"
    """Lit side: outside or inside."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Ranges that are some."""
        yield from not_empty(self, "arc_deg", "zenith_deg")
        yield from in_range(self, "zenith_deg", 0, 180)


def in_range(model: Model, name: str, low: float, high: float) -> Iterator[Complaint]:
    """Complain of angles beyond what the surface has."""
    for k, value in enumerate(getattr(model, name)):
        if not low <= value <= high:
            yield (name, k), f"must be from {low:g} to {high:g} degrees, got {value:g}"


class CylinderSurface(SurfaceBase):
    """An upright cylinder, or a part of one: (r sin a, h(½ − t), r cos a)."""

    kind: Literal["cylinder"]
    """Kind of surface."""
    radius: Length
    """Radius r: a number of `units` (metres), or a text such as 4 m."""
    height: Length
    """Height h: a number of `units` (metres), or a text such as 4 m."""
    arc_deg: Range = (-180.0, 180.0)
    """The angle a about the vertical, from +Z towards +X: its first and last value, degrees."""
    lit: Annotated[str, OneOf(ROUND)] = "outside"
    """Lit side: outside or inside."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A range that is some."""
        yield from not_empty(self, "arc_deg")


class ConeSurface(SurfaceBase):
    """An upright cone, or a frustum of one: (r sin a, h(½ − t), r cos a), r from top to bottom."""

    kind: Literal["cone"]
    """Kind of surface."""
    radius_top: NotNegative
    """Radius at the upper edge, a number of `units` (metres)."""
    radius_bottom: NotNegative
    """Radius at the lower edge, a number of `units` (metres)."""
    height: Length
    """Height h: a number of `units` (metres), or a text such as 4 m."""
    arc_deg: Range = (-180.0, 180.0)
    """The angle a about the vertical, from +Z towards +X: its first and last value, degrees."""
    lit: Annotated[str, OneOf(ROUND)] = "outside"
    """Lit side: outside or inside."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A range that is some, and a radius at one end at least."""
        yield from not_empty(self, "arc_deg")
        if not self.radius_top and not self.radius_bottom:
            yield ("radius_top",), "is 0, and so is radius_bottom (expected a cone)"


class TorusSurface(SurfaceBase):
    """A lying torus, or a part of one: ((R + r cos b) sin a, −r sin b, (R + r cos b) cos a)."""

    kind: Literal["torus"]
    """Kind of surface."""
    radius: Length
    """Radius R of the ring: a number of `units` (metres), or a text such as 4 m."""
    tube: Length
    """Radius r of its tube: a number of `units` (metres), or a text such as 1 m."""
    arc_deg: Range = (-180.0, 180.0)
    """The angle a along the ring, from +Z towards +X: its first and last value, degrees."""
    tube_deg: Range = (-180.0, 180.0)
    """The angle b about the tube, from outside down: its first and last value, degrees."""
    lit: Annotated[str, OneOf(ROUND)] = "outside"
    """Lit side: outside or inside."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Ranges that are some."""
        yield from not_empty(self, "arc_deg", "tube_deg")


class ParaboloidSurface(SurfaceBase):
    """A bowl over a square: x = w(2s − 1), z = w(2t − 1), y = k(x² + z²)."""

    kind: Literal["paraboloid"]
    """Kind of surface."""
    half_width: Length
    """Half the square's width w: a number of `units` (metres), or a text such as 1 m."""
    coefficient: Number = 1.0
    """k, one over a number of `units` (metres)."""
    lit: Annotated[str, OneOf(LYING)] = "above"
    """Lit side: above (front), in the bowl where k is positive, or below (back)."""


class SuperquadricSurface(SurfaceBase):
    """(rx c(b, e₁) c(a, e₂), ry s(b, e₁), rz c(b, e₁) s(a, e₂)), c and s signed powers of cosine and sine."""

    kind: Literal["superquadric"]
    """Kind of surface."""
    radii: Annotated[tuple[Positive, Positive, Positive], Items(3)]
    """Half axes rx, ry and rz, numbers of `units` (metres)."""
    exponents: Annotated[tuple[Positive, Positive], Items(2)] = (1.0, 1.0)
    """e₁ from pole to pole and e₂ around: 1 is round, below 1 a rounded box, 2 an octahedron."""
    arc_deg: Range = (-180.0, 180.0)
    """The angle a about the vertical, from +X towards +Z: its first and last value, degrees."""
    latitude_deg: Annotated[tuple[Degrees, Degrees], Items(2, "degrees")] = (90.0, -90.0)
    """The angle b above the equator: that of the upper edge and that of the lower one, degrees."""
    lit: Annotated[str, OneOf(ROUND)] = "outside"
    """Lit side: outside or inside."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Ranges that are some."""
        yield from not_empty(self, "arc_deg", "latitude_deg")
        yield from in_range(self, "latitude_deg", -90, 90)
        for k, value in enumerate(self.exponents):
            if not 0.05 <= value <= 8:
                yield ("exponents", k), f"must be from 0.05 to 8, got {value:g}"


class BezierSurface(SurfaceBase):
    """A Bézier patch: rows of control points from the upper edge to the lower one."""

    kind: Literal["bezier"]
    """Kind of surface."""
    points: Annotated[tuple[Points, ...], Listed, Field(min_length=2)]
    """Rows of control points, from left to right as seen from the front, numbers of `units` (metres)."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Lit side: front, from where rows run right and follow each other down, or back."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Rows of one length."""
        yield from same_lengths(self.points, "points")


def same_lengths(rows: tuple[tuple[Any, ...], ...], name: str) -> Iterator[Complaint]:
    """Complain of rows that are not as long as the first."""
    for k, row in enumerate(rows):
        if len(row) != len(rows[0]):
            yield (name, k), f"expected {len(rows[0])} items as in the first row, got {len(row)}"
        if len(row) > 64 or len(rows) > 64:
            yield (name, k), "expected at most 64 rows of at most 64"
            return


class NurbsSurface(SurfaceBase):
    """A NURBS patch: rows of control points with weights, degrees and knots."""

    kind: Literal["nurbs"]
    """Kind of surface."""
    file: Annotated[Path, ExistingFile((".obj",), "a free-form surface")] | None = None
    """OBJ with one free-form surface (cstype, deg, surf, parm), whose v runs up, instead of all below."""
    points: Annotated[tuple[Points, ...], Listed, Field(min_length=2)] | None = None
    """Rows of control points, from left to right as seen from the front, numbers of `units` (metres)."""
    weights: Annotated[tuple[Annotated[tuple[Positive, ...], Listed], ...], Listed] | None = None
    """Rows of weights, as many as points; all 1 when absent."""
    degree: Annotated[
        tuple[Annotated[int, Field(ge=1, le=9)], Annotated[int, Field(ge=1, le=9)]], Items(2)
    ] = (3, 3)
    """Degrees along the rows and from row to row, 3 and 3 when absent."""
    knots_s: Numbers | None = None
    """Knots along the rows; evenly spaced and clamped when absent."""
    knots_t: Numbers | None = None
    """Knots from row to row; evenly spaced and clamped when absent."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Lit side: front, from where rows run right and follow each other down, or back."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Rows of one length, and as many knots as points and degrees ask for."""
        if self.points is None or self.file is not None:
            yield from self._of_file()
            return
        yield from same_lengths(self.points, "points")
        rows, columns = len(self.points), len(self.points[0])
        if self.weights is not None and [len(row) for row in self.weights] != [columns] * rows:
            yield ("weights",), f"expected {rows} rows of {columns} numbers, a weight for each point"
        for axis, count in enumerate((columns, rows)):
            name, degree = ("knots_s", "knots_t")[axis], self.degree[axis]
            knots = getattr(self, name)
            if count <= degree:
                yield ("degree", axis), f"expected at most {count - 1} for {count} points, got {degree}"
            elif knots is not None and len(knots) != count + degree + 1:
                words = f"expected {count + degree + 1} knots for {count} points of degree {degree}"
                yield (name,), f"{words}, got {len(knots)}"
            elif knots is not None and (list(knots) != sorted(knots) or not knots[degree] < knots[count]):
                yield (name,), "expected knots that never descend, and some range between them"

    def _of_file(self) -> Iterator[Complaint]:
        """Either a file, or control points."""
        if self.file is None:
            yield ("points",), "missing key (rows of control points, or file with a free-form surface)"
            return
        for key in ("points", "weights", "degree", "knots_s", "knots_t"):
            if key in self.model_fields_set:
                yield (key,), "the file has it (expected no such key beside file)"


class HeightSurface(SurfaceBase):
    """Heights over a rectangle in the floor's plane, between its pixels by cubic curves."""

    kind: Literal["height"]
    """Kind of surface."""
    file: Annotated[Path, ExistingFile(PICTURES, "a picture of heights")]
    """Picture of heights, EXR, PFM or a grey one; its corner pixels lie on the rectangle's corners."""
    size: Annotated[tuple[Length, Length], Items(2, "lengths, width and depth")]
    """Width along X and depth along Z: numbers of `units` (metres), or texts such as 4 m."""
    scale: Number = 1.0
    """Height of a pixel of 1, a number of `units`; grey pictures are from 0 to 1."""
    lit: Annotated[str, OneOf(LYING)] = "above"
    """Lit side: above (front) or below (back)."""


class FormulaBase(SurfaceBase):
    """What surfaces of formulas have."""

    constants: dict[str, Number] = Field(default_factory=dict)
    """Numbers by name, for the formulas."""
    x: str
    """Formula for x of s and t, from 0 to 1: + - * / **, pi, and sin, cos, tan, sqrt, exp, log, abs, atan2,
    min, max."""
    y: str
    """Formula for y."""
    z: str
    """Formula for z."""
    lit: Annotated[str, OneOf(LYING)] = "front"
    """Lit side: front, from where s runs right and t down, or back; above or below."""
    zero: str | None = None
    """Formula of x, y and z that must be 0 on the surface."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Formulas that can be read."""
        for name in self.constants:
            if not name.isidentifier() or name in ("s", "t", "x", "y", "z", "pi"):
                yield (
                    ("constants", name),
                    "is no name for a constant (expected letters; s t x y z pi are taken)",
                )
        for key in ("x", "y", "z", "zero"):
            text = getattr(self, key)
            if text is not None:
                names = ("x", "y", "z") if key == "zero" else ("s", "t")
                try:
                    parse(text, [*names, *self.constants])
                except FormulaError as error:
                    yield (key,), str(error)


class FormulaSurface(FormulaBase):
    """A surface whose points are formulas of s, which runs right, and t, which runs down."""

    kind: Literal["formula"]
    """Kind of surface."""


class ImplicitSurface(FormulaBase):
    """A surface F(x, y, z) = 0 and formulas of its points: the equation alone places no pixels."""

    kind: Literal["implicit"]
    """Kind of surface."""

    def cross_checks(self) -> Iterator[Complaint]:
        """The equation is what this kind is for."""
        if self.zero is None:
            yield ("zero",), "missing key (formula of x, y and z that must be 0 on the surface)"
        yield from super().cross_checks()


class MeshSurface(SurfaceBase):
    """A mesh with texture coordinates, taken for a smooth surface: the texture is the raster."""

    kind: Literal["mesh"]
    """Kind of surface."""
    file: Annotated[Path, ExistingFile((".obj",), "a mesh")]
    """Mesh with texture coordinates, OBJ; they count from the lower left corner."""
    smooth: bool = False
    """Bend its triangles by the normals at their corners (Boubekeur and Alexa, 2008)."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Lit side: front, where the texture is not mirrored, or back."""


class MapSurface(Model):
    """A point of the world for each pixel, as calibrations give it."""

    kind: Literal["map"]
    """Kind of surface."""
    name: str = ""
    """A name for messages and tables."""
    file: Annotated[Path, ExistingFile(MAPS, "a map of points")]
    """EXR (X, Y, Z or R, G, B, and A) or PFM of points, a pixel each; NaN or an alpha of 0 is no display."""
    pixels: Size | None = None
    """Width and height, pixels; those of the file when absent."""
    units: Annotated[str, OneOf(tuple(UNITS))] = "m"
    """What the points are measured in: m, cm, mm, in or ft."""
    lit: Annotated[str, OneOf(SHEET)] = "front"
    """Lit side: front, from where the map is not mirrored, or back."""
    mirror: bool = False
    """Mirror the image left to right, for rear projection or a map that runs the other way."""
    mask: Annotated[Path, ExistingFile(PICTURES, "a picture")] | None = None
    """Picture of as many pixels; the surface has none where it is black or transparent."""
    at: Point = (0.0, 0.0, 0.0)
    """Where the map's origin lies: numbers of the display's `units` (metres), or texts such as 2.25 m."""
    rotate_deg: Vec3 = (0.0, 0.0, 0.0)
    """Angles about X, then Y, then Z, before it is put there, degrees."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt; surfaces without one are packed around it."""


SURFACES: dict[str, type[Model]] = {
    "plane": PlaneSurface,
    "sphere": SphereSurface,
    "cylinder": CylinderSurface,
    "cone": ConeSurface,
    "torus": TorusSurface,
    "paraboloid": ParaboloidSurface,
    "superquadric": SuperquadricSurface,
    "bezier": BezierSurface,
    "nurbs": NurbsSurface,
    "height": HeightSurface,
    "formula": FormulaSurface,
    "implicit": ImplicitSurface,
    "mesh": MeshSurface,
    "map": MapSurface,
}
SurfaceSpec = tagged(SURFACES, "kind", "a surface such as {kind: sphere, radius: 1, pixels: [4096, 2048]}")
