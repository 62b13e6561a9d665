"""The lights of a scene file: a model a kind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag

from quiltcli.job.model import (
    Complaint,
    Direction,
    ExistingFile,
    Items,
    Model,
    NotNegative,
    Number,
    Positive,
    Rgb,
    Vec3,
    complaint,
    describe,
    either,
    suggest,
)

MOST_RAYS = 4096
PANORAMAS = (".exr", ".hdr", ".png", ".jpg", ".jpeg", ".tif", ".tiff")
Rays = Annotated[int, Field(ge=1, le=MOST_RAYS)]
HalfAngle = Annotated[float, Field(allow_inf_nan=False, ge=0, le=90)]
Lengths2 = Annotated[tuple[Positive, Positive], Items(2, "metres, width and height")]


class DirectionalLight(Model):
    """Light from infinitely far away."""

    type: Literal["directional"] = "directional"
    """Kind of light."""
    direction: Direction
    """The way the light travels."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Irradiance on a plane that faces the light."""
    shadows: bool = False
    """Whether what stands in its way casts a shadow."""


class PointLight(Model):
    """Light from one point, falling with the square of the distance."""

    type: Literal["point"] = "point"
    """Kind of light."""
    position: Vec3
    """Place, metres."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Radiant intensity."""
    range: Positive | None = None
    """Where its light has faded to nothing, metres; without this key it never ends."""
    shadows: bool = False
    """Whether what stands in its way casts a shadow."""


class SpotLight(Model):
    """Light from one point into a cone."""

    type: Literal["spot"] = "spot"
    """Kind of light."""
    position: Vec3
    """Place, metres."""
    direction: Direction
    """The way it shines, along the middle of the cone."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Radiant intensity in the middle of the cone."""
    inner_deg: HalfAngle = 0.0
    """From the middle of the cone to where it begins to fade, degrees."""
    outer_deg: HalfAngle = 45.0
    """From the middle of the cone to where it is dark, degrees."""
    range: Positive | None = None
    """Where its light has faded to nothing, metres; without this key it never ends."""
    shadows: bool = True
    """Whether what stands in its way casts a shadow."""

    def cross_checks(self) -> Iterator[Complaint]:
        """A cone fades outward."""
        if self.inner_deg > self.outer_deg:
            words = f"must not be more than outer_deg, {self.outer_deg:g}, got {self.inner_deg:g}"
            yield ("inner_deg",), words
        if self.outer_deg == 0:
            yield ("outer_deg",), "must be greater than 0, got 0"


class AreaLight(Model):
    """A rectangle that shines to one side, the same from wherever it is seen."""

    type: Literal["area"] = "area"
    """Kind of light."""
    position: Vec3
    """Its middle, metres."""
    direction: Direction
    """The way it shines: at right angles to the rectangle."""
    size: Lengths2
    """Width, which lies level, and height, metres."""
    roll_deg: Number = 0.0
    """Turn about the way it shines, clockwise as seen from behind, degrees."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Radiance of its surface."""
    shadows: bool = True
    """Whether what stands in its way casts a shadow."""
    rays: Rays = 16
    """Places on it that are looked for from a pixel, a power of two; 16 or more, four times as many in half
    shadow, unless a pixel has several samples, which share them."""


class AmbientLight(Model):
    """The same light from everywhere."""

    type: Literal["ambient"] = "ambient"
    """Kind of light."""
    color: Rgb = (0.1, 0.1, 0.1)
    """Radiance."""
    shadows: bool = False
    """Whether what stands around a place keeps light from it."""
    distance: Positive | None = None
    """How far off that may stand, metres; without this key anywhere."""
    rays: Rays = 32
    """Directions in which it is looked for from a pixel; those below the horizon are not."""


class EnvironmentLight(Model):
    """Light from a picture of all that is around."""

    type: Literal["environment"] = "environment"
    """Kind of light."""
    file: Annotated[Path, ExistingFile(PANORAMAS, "a panorama")]
    """Panorama, twice as wide as high: its middle is towards -Z, +X to its right, +Y at the top."""
    rotate_deg: Number = 0.0
    """Turn of the panorama about the vertical, to the left, degrees."""
    intensity: NotNegative = 1.0
    """Factor of its radiance."""
    shadows: bool = True
    """Whether what stands around a place keeps light from it."""
    distance: Positive | None = None
    """How far off that may stand, metres; without this key anywhere."""
    rays: Rays = 32
    """Directions in which it is looked for from a pixel, more of them towards what is bright."""
    visible: bool = False
    """Whether it is seen where nothing else is, in place of the background."""


class FileLights(Model):
    """The lights in the objects' mesh files (glTF, USD), each where its object is."""

    type: Literal["file"] = "file"
    """Kind of light."""
    scale: NotNegative = 1.0
    """Factor of their strength: 1 takes glTF's lux and candela by 683 lumens a watt, USD's as they are."""
    shadows: bool = False
    """Whether what stands in their way casts a shadow."""


LIGHTS = {
    "directional": DirectionalLight,
    "point": PointLight,
    "spot": SpotLight,
    "area": AreaLight,
    "ambient": AmbientLight,
    "environment": EnvironmentLight,
    "file": FileLights,
}


def _check_type(value: Any) -> Any:
    """A light must say which kind it is before its keys can be judged."""
    if not isinstance(value, (dict, Model)):
        raise complaint(f"expected a light such as {{type: ambient}}, got {describe(value)}")
    kind = value.get("type") if isinstance(value, dict) else value.__dict__["type"]
    if kind is None:
        raise complaint(f"missing key (expected {either(list(LIGHTS))})", "type")
    if kind not in tuple(LIGHTS):
        near = suggest(kind, LIGHTS)
        hint = f" (did you mean {near!r}?)" if near else ""
        raise complaint(f"expected {either(list(LIGHTS))}, got {describe(kind)}{hint}", "type")
    return value


def _light_tag(value: Any) -> str:
    kind = value["type"] if isinstance(value, dict) else value.type
    return f"<{LIGHTS[kind].__name__}>"


LightSpec: TypeAlias = Annotated[
    Annotated[DirectionalLight, Tag("<DirectionalLight>")]
    | Annotated[PointLight, Tag("<PointLight>")]
    | Annotated[SpotLight, Tag("<SpotLight>")]
    | Annotated[AreaLight, Tag("<AreaLight>")]
    | Annotated[AmbientLight, Tag("<AmbientLight>")]
    | Annotated[EnvironmentLight, Tag("<EnvironmentLight>")]
    | Annotated[FileLights, Tag("<FileLights>")],
    Discriminator(_light_tag),
    BeforeValidator(_check_type),
]


def listed_lights(value: Any) -> Any:
    """`lights: file` is short for a list of that one entry."""
    if value == "file":
        return ({"type": "file"},)
    if not isinstance(value, (list, tuple)):
        near = suggest(value, ("file",)) if isinstance(value, str) else ""
        hint = f" (did you mean {near!r}?)" if near else ""
        raise complaint(f"expected file or a list of lights, got {describe(value)}{hint}")
    return tuple(value)
