"""The layout file, and what a job may say instead of naming one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

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
)

# Names of the packing stage, which comes later; known here so that a wrong one is shown in its line.
# A method that reads a clock is not among them: machines that share a job would disagree about its layout.
PACKING_METHODS = ("auto", "rows", "rects", "maxrects", "nest", "net")


class PackSpec(Model):
    """How to pack the facets of a display onto quilt pages."""

    method: Annotated[str, OneOf(PACKING_METHODS)] = "auto"
    """Packing method; net takes each facet's raster from the quilt, the others leave it as it is."""
    size: Size | None = None
    """Width and height of a page, the smallest that holds everything when absent, pixels."""
    max_pages: Count | None = None
    """Most pages that may be used; any number when absent."""
    padding: Natural = 2
    """Room kept free between facets, pixels."""
    aspect: Annotated[float, Field(allow_inf_nan=False, ge=0.01, le=100)] | None = None
    """Width divided by height of a page whose size is not given; any when absent."""
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


class LayoutFile(FileModel):
    """Where each facet's pixels lie in the quilt."""

    kind: ClassVar[str] = "quilt_layout"

    quilt_layout: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    display: AnyPath | None = None
    """The display file the layout was made for."""
    display_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """Hash of that display's geometry."""
    method: str = "manual"
    """Packing method it was made by."""
    padding: Natural = 0
    """Room kept free between facets, pixels."""
    pages: Annotated[tuple[PageSpec, ...], Listed, Field(min_length=1)]
    """Pages of the quilt."""
    facets: Annotated[tuple[PlaceSpec, ...], Listed, Field(min_length=1)]
    """Places of the facets."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Ids are unique, pages exist, no map flattens its facet."""
        first: dict[int, int] = {}
        for i, place in enumerate(self.facets):
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
