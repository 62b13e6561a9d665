"""The layout file, and what a job may say instead of naming one."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, PlainValidator, WithJsonSchema, model_validator

from quiltcli.errors import JobError
from quiltcli.job.model import (
    AnyPath,
    Complaint,
    Count,
    Direction,
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
    describe,
)

# Names of the packing stage, which comes later; known here so that a wrong one is shown in its line.
PACKING_METHODS = {
    "auto": "auto",
    "rows": "rows",
    "rects": "rects",
    "maxrects": "rects",
    "nest": "nest",
    "net": "net",
}
"""Names of packing methods, and the method each stands for: `maxrects` is another name of `rects`."""


CANVASES = {"uhd": (3840, 2160), "dci4k": (4096, 2160), "uhd8k": (7680, 4320)}
"""Page sizes that have a name: what LED processors and projectors take."""


def read_aspect(text: str) -> Fraction:
    """The aspect, width / height, written as 16:9, 16x9, 16/9 or 1.85.

    Raises:
        JobError: it is none of these, or not between 1:100 and 100:1.
    """
    aspect = _aspect_of(text)
    if aspect is None:
        raise JobError(f"expected an aspect such as 16:9 or 1.85, got {text!r}")
    return aspect


def _aspect_of(value: object) -> Fraction | None:
    parts = str(value).lower().replace("x", ":").replace("/", ":").split(":")
    try:
        aspect = Fraction(parts[0]) / Fraction(parts[1] if len(parts) > 1 else "1")
    except (ValueError, ZeroDivisionError):
        return None
    return aspect if len(parts) < 3 and Fraction(1, 100) <= aspect <= 100 else None


def _aspect(value: Any) -> Fraction:
    aspect = None if isinstance(value, bool) else _aspect_of(value)
    if aspect is None:
        raise complaint(f"expected an aspect such as 16:9 or 1.85, got {describe(value)}")
    return aspect


Aspect = Annotated[
    Fraction,
    PlainValidator(_aspect),
    WithJsonSchema({"type": ["number", "string"], "examples": ["16:9", 1.85]}),
]


class PackSpec(Model):
    """How to pack the facets of a display onto quilt pages."""

    method: Annotated[str, OneOf(tuple(PACKING_METHODS))] = "auto"
    """Packing method; net takes each facet's raster from the quilt, the others leave it as it is. Another
    name of rects is maxrects."""
    size: Size | None = None
    """Width and height of a page, the smallest that holds everything when absent, pixels."""
    max_pages: Count | None = None
    """Most pages that may be used; any number when absent."""
    padding: Natural = 2
    """Room kept free between facets, pixels."""
    aspect: Aspect | None = None
    """Width to height of a page whose size is not given, such as 16:9 or 1.85; any when absent."""
    align: Count = 1
    """Facets' top-left pixels lie at multiples of this, pixels."""
    mirror: bool = False
    """Whether facets may be mirrored in the quilt."""
    page_facets: Count | None = None
    """Most facets on a page."""
    page_pixels: Count | None = None
    """Most that the facets on a page may take, pixels."""
    pins: AnyPath | None = None
    """A layout file whose facets stay where they are; the others are packed around them."""
    seconds: Positive = 10.0
    """Effort, in seconds on a slow computer; the result does not depend on the computer."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Wishes that exclude each other."""
        limits = [name for name in ("page_facets", "page_pixels") if getattr(self, name) is not None]
        if self.size is not None and self.aspect is not None:
            yield ("aspect",), "a page size and an aspect: give one, since the size has an aspect"
        if limits and self.size is None:
            yield (limits[0],), "limits of a page need a page size"
        if limits and self.pins is not None:
            yield (limits[0],), "limits of a page and pins cannot be combined"
        if self.method == "net" and (self.align > 1 or self.mirror):
            odd = "align" if self.align > 1 else "mirror"
            yield (odd,), "the method net lays facets at any angle, so it can neither align nor mirror them"


class UvLayoutSpec(Model):
    """The layout in the texture coordinates of the display mesh: UV times size is the quilt pixel."""

    from_uv: Literal[True]
    """Always true."""
    size: Size
    """Width and height of the page, pixels."""


class PageSpec(Model):
    """A page of the quilt."""

    size: Size
    """Width and height, pixels."""


Row = Annotated[tuple[Number, Number, Number], Items(3)]
Point = Annotated[tuple[Number, Number], Items(2)]


class PlaceSpec(Model):
    """The place of one facet."""

    id: Count
    """Facet id."""
    page: Count
    """Page, the first being 1."""
    size: Size
    """Width and height of the facet's raster, pixels."""
    quilt_from_facet: Annotated[tuple[Row, Row], Items(2, "rows of 3 numbers")]
    """Affine map from facet pixels to pixels of the page."""
    origin: Vec3
    """World position of the raster's top-left corner, metres."""
    du: Direction
    """World step to the next pixel right, metres."""
    dv: Direction
    """World step to the next pixel down, metres."""
    polygon: Annotated[tuple[Point, ...], Listed, Field(min_length=3)]
    """Corners on the facet's raster, pixels."""
    surface: str | None = None
    """Of a curved facet its name, or kind; origin, du and dv are of a plane that touches it."""


Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class PackedSpec(Model):
    """What a layout was packed from, so that it need not be packed again while that is the same."""

    wishes_sha256: Sha256
    """Hash of how to pack."""
    facets_sha256: Sha256
    """Hash of which of the display's facets are enabled, and of places that its file gives."""
    places_sha256: Sha256
    """Hash of the places that were found; others in the file were changed since."""


class LayoutFile(FileModel):
    """Where each facet's pixels lie in the quilt."""

    model_config = ConfigDict(json_schema_extra=lambda schema: schema["required"].remove("facets"))
    kind: ClassVar[str] = "quilt_layout"

    quilt_layout: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    display: AnyPath | None = None
    """The display file the layout was made for."""
    display_sha256: Sha256 | None = None
    """Hash of that display's geometry."""
    method: str = "manual"
    """Packing method it was made by."""
    padding: Natural = 0
    """Room kept free between facets, pixels."""
    pages: Annotated[tuple[PageSpec, ...], Listed, Field(min_length=1)]
    """Pages of the quilt."""
    facets: Annotated[tuple[PlaceSpec, ...], Listed, Field(min_length=1)] | None
    """Places of the facets."""
    columns: AnyPath | None = None
    """NumPy archive (.npz) with the facets, an array a key, in place of `facets`: for thousands of them."""
    columns_sha256: Sha256 | None = None
    """Hash of that file, which is read only while it is the same."""
    packed: PackedSpec | None = None
    """What it was packed from, as a render notes it; absent in others."""

    @model_validator(mode="before")
    @classmethod
    def _facets_in_columns(cls, data: Any) -> Any:
        """Nothing is missing where columns stand for the facets."""
        if isinstance(data, dict) and "columns" in data and "facets" not in data:
            return {**data, "facets": None}
        return data

    def cross_checks(self) -> Iterator[Complaint]:
        """The facets stand in one place; ids are unique, pages exist, no map flattens its facet."""
        if self.facets is None and self.columns is None:
            yield ("facets",), "no facets (expected a list, or columns with a file that has them)"
        elif self.facets is not None and self.columns is not None:
            yield ("columns",), "facets and columns: give one, since columns has the facets too"
        elif self.columns is None and self.columns_sha256 is not None:
            yield ("columns_sha256",), "a hash of columns, but no columns"
        first: dict[int, int] = {}
        for i, place in enumerate(self.facets or ()):
            if place.id in first:
                yield (
                    ("facets", i, "id"),
                    f"facet {place.id} already has a place, at facets[{first[place.id]}]",
                )
            first.setdefault(place.id, i)
            if place.page > len(self.pages):
                pages = f"{len(self.pages)} page" + "s" * (len(self.pages) > 1)
                yield ("facets", i, "page"), f"there is no page {place.page} (the layout has {pages})"
            (a, b, _), (c, d, _) = place.quilt_from_facet
            if a * d == b * c:
                yield ("facets", i, "quilt_from_facet"), "flattens the facet (its determinant is 0)"
