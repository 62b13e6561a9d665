"""Projections: pictures all around the eye, a model a kind. Each pixel is a direction, not a place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from quiltcli.job.model import (
    Complaint,
    Count,
    ExistingFile,
    Items,
    Listed,
    Model,
    Number,
    OneOf,
    Positive,
    Size,
)
from quiltcli.job.places import PlaceOnPage
from quiltcli.job.surfaces import MAPS, Degrees, in_range, not_empty
from quiltcli.job.tagged import tagged

FISHEYES = ("equidistant", "equisolid", "stereographic", "orthographic", "polynomial")
Fov = Annotated[Number, Field(gt=0, le=360)]
Latitude = Annotated[Number, Field(ge=0, le=90)]
Flat = Annotated[Number, Field(gt=0, lt=180)]


class ProjectionBase(Model):
    """What all projections have."""

    pixels: Size
    """Width and height, pixels."""
    follows: Annotated[str, OneOf(("position", "view"))] = "position"
    """What it goes along with: the eye's position alone, or the direction of view as well."""
    heading_deg: Degrees = 0.0
    """Where ahead is: 0 is -Z (or the direction of view), positive turns to the left, degrees."""
    place: PlaceOnPage | None = None
    """Fixed place in the quilt."""


class CylinderProjection(ProjectionBase):
    """A cylinder about the eye: columns are angles, rows are heights."""

    kind: Literal["cylinder"]
    """Kind of projection."""
    hfov_deg: Fov = 360.0
    """Angle from its left edge to its right one, degrees."""
    center: Number = 0.0
    """Height of the picture's middle row on a cylinder of radius 1."""
    pieces: Count | None = None
    """Cut into so many flat strips, as Lorenz and Döllner do; round when absent."""


class EquirectProjection(ProjectionBase):
    """Columns are longitudes, rows latitudes."""

    kind: Literal["equirect"]
    """Kind of projection."""
    longitude_deg: Annotated[tuple[Degrees, Degrees], Items(2, "degrees, left and right")] = (-180.0, 180.0)
    """Longitudes of the left and the right edge, 0 ahead and positive to the right, degrees."""
    latitude_deg: Annotated[tuple[Degrees, Degrees], Items(2, "degrees, bottom and top")] = (-90.0, 90.0)
    """Latitudes of the lower and the upper edge, degrees."""
    omnistereo: bool = False
    """Give each column an eye of its own, beside the head as for who looks that way; for two eyes."""
    pole_merge_deg: Annotated[tuple[Latitude, Latitude], Items(2, "degrees, from and to")] | None = None
    """Latitudes between which the eyes of omnistereo come together; 60 to 75 when absent, degrees."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Ranges that are some."""
        yield from not_empty(self, "longitude_deg", "latitude_deg")
        yield from in_range(self, "latitude_deg", -90, 90)
        if self.pole_merge_deg is not None and not self.omnistereo:
            yield ("pole_merge_deg",), "belongs to omnistereo: true"
        if self.pole_merge_deg is not None and self.pole_merge_deg[0] > self.pole_merge_deg[1]:
            yield ("pole_merge_deg",), "expected the lower latitude first"


class FisheyeProjection(ProjectionBase):
    """A circle about the direction ahead."""

    kind: Literal["fisheye"]
    """Kind of projection."""
    mapping: Annotated[str, OneOf(FISHEYES)] = "equidistant"
    """How the angle grows with the radius."""
    fov_deg: Fov = 180.0
    """Angle across the circle, degrees."""
    polynomial: Annotated[tuple[Number, ...], Listed, Field(min_length=1, max_length=8)] | None = None
    """k₁, k₃, k₅ … of r = Σ kᵢ θⁱ, θ in radians and r in halves of the circle, for mapping: polynomial."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Angles that the mapping has."""
        widest = {"orthographic": 180.0, "stereographic": 359.0}.get(self.mapping, 360.0)
        if self.fov_deg > widest:
            yield ("fov_deg",), f"must be at most {widest:g} for {self.mapping}, got {self.fov_deg:g}"
        if (self.mapping == "polynomial") != (self.polynomial is not None):
            words = "missing key" if self.polynomial is None else "belongs to mapping: polynomial"
            yield ("polynomial",), words


class DomeMasterProjection(ProjectionBase):
    """A planetarium's picture: the zenith in the middle, what is ahead at the bottom."""

    kind: Literal["dome_master"]
    """Kind of projection."""
    fov_deg: Fov = 180.0
    """Angle across the circle, degrees."""
    tilt_deg: Annotated[Number, Field(ge=-90, le=90)] = 0.0
    """How far the dome leans forward, degrees."""


class CubemapProjection(ProjectionBase):
    """Six faces of a cube about the eye."""

    kind: Literal["cubemap"]
    """Kind of projection."""
    layout: Annotated[str, OneOf(("cross", "row", "pages"))] = "cross"
    """A cross of 4 × 3 faces, a row of 6 (right, left, up, down, front, back), or a page for each."""
    equiangular: bool = False
    """Equal angles for equal lengths on each face."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Square faces."""
        across, down = {"cross": (4, 3), "row": (6, 1), "pages": (1, 1)}[self.layout]
        width, height = self.pixels
        if width * down != height * across or width % across:
            words = f"expected {across} × {down} square faces for layout: {self.layout}"
            yield ("pixels",), f"{words}, got {width} × {height}"
        if self.layout == "pages" and self.place is not None:
            yield ("place",), "cannot stand beside layout: pages (each face has a page)"


class MirrorBallProjection(ProjectionBase):
    """All that a mirror ball shows, seen from afar: ahead in the middle, behind along the rim."""

    kind: Literal["mirror_ball"]
    """Kind of projection."""


class PlanarCamera(Model):
    """The undistorted picture."""

    fov_deg: Flat = 60.0
    """Angle from its upper edge to its lower one, degrees."""
    aspect: Positive | None = None
    """Width by height; that of the pixels when absent."""


class OffsetProjection(ProjectionBase):
    """A camera texture: how far each node of a grid over a plain picture moves (Lorenz and Döllner)."""

    kind: Literal["offset"]
    """Kind of projection."""
    file: Annotated[Path, ExistingFile(MAPS, "a picture of offsets")]
    """EXR or PFM: right and up by parts of the picture's height, in R and G (or X and Y)."""
    camera: PlanarCamera = Field(default_factory=PlanarCamera)
    """The plain picture."""


class StProjection(ProjectionBase):
    """An ST map: which place of a plain picture each pixel shows."""

    kind: Literal["st"]
    """Kind of projection."""
    file: Annotated[Path, ExistingFile(MAPS, "an ST map")]
    """EXR or PFM of as many pixels: x in R and y from the bottom in G, 0 to 1; NaN shows nothing."""
    camera: PlanarCamera | None = None
    """The plain picture; when absent what the file says, as those of quilt export do, else of 60 degrees."""


class FisheyeLens(Model):
    """The fisheye picture that texture coordinates refer to."""

    mapping: Annotated[str, OneOf(FISHEYES[:4])] = "equidistant"
    """How the angle grows with the radius."""
    fov_deg: Fov = 180.0
    """Angle across the circle, degrees."""


class MeshProjection(ProjectionBase):
    """A warp mesh (Bourke's `.data`): places of the picture with coordinates of a fisheye picture."""

    kind: Literal["mesh"]
    """Kind of projection."""
    file: Annotated[Path, ExistingFile((".data", ".txt"), "a warp mesh")]
    """Warp mesh: its type (1 or 2), its numbers of nodes, then x y u v i a node."""
    of: FisheyeLens = Field(default_factory=FisheyeLens)
    """The fisheye picture that u and v refer to."""


class MapProjection(ProjectionBase):
    """A direction for each pixel."""

    kind: Literal["map"]
    """Kind of projection."""
    file: Annotated[Path, ExistingFile(MAPS, "a map of directions")]
    """EXR (X, Y, Z or R, G, B) or PFM of as many pixels: right, up, back; NaN or 0 shows nothing."""


PROJECTIONS: dict[str, type[Model]] = {
    "cylinder": CylinderProjection,
    "equirect": EquirectProjection,
    "fisheye": FisheyeProjection,
    "dome_master": DomeMasterProjection,
    "cubemap": CubemapProjection,
    "mirror_ball": MirrorBallProjection,
    "offset": OffsetProjection,
    "st": StProjection,
    "mesh": MeshProjection,
    "map": MapProjection,
}
ProjectionSpec = tagged(PROJECTIONS, "kind", "a projection such as {kind: dome_master, pixels: [4096, 4096]}")
