"""The scene file: objects, lights and background."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag

from quiltcli.job.display import TransformSpec
from quiltcli.job.model import (
    Direction,
    FileModel,
    Listed,
    MeshPath,
    Model,
    OneOf,
    Rgb,
    Unit,
    Vec3,
    complaint,
    describe,
    either,
    suggest,
)


class MaterialSpec(Model):
    """Look of an object; a key that is absent stays as the mesh file says."""

    color: Rgb | None = None
    """Base colour, linear."""
    metallic: Unit | None = None
    """0 for paint, 1 for metal."""
    roughness: Unit | None = None
    """0 for a mirror, 1 for chalk."""
    emission: Rgb | None = None
    """Light given off, linear."""
    unlit: bool | None = None
    """Show exactly `color`, whatever the lights."""
    specular: Unit | None = None
    """1 for a surface that also reflects the lamps themselves, 0 for a matte one; metals always do."""


class ObjectSpec(Model):
    """A mesh in the scene."""

    name: str = ""
    """Name for tables; the mesh file's name when absent."""
    mesh: MeshPath
    """OBJ, PLY, OFF, STL or glTF."""
    transform: TransformSpec | None = None
    """Place of the object in the world."""
    material: MaterialSpec | None = None
    """What to change of the materials in the mesh file."""
    normals: Annotated[str, OneOf(("auto", "flat", "smooth"))] = "auto"
    """Shade each triangle flat, smooth over the vertices, or (auto) as the mesh file says."""


class DirectionalLight(Model):
    """Light from infinitely far away."""

    type: Literal["directional"] = "directional"
    """Kind of light."""
    direction: Direction
    """The way the light travels."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Irradiance on a plane that faces the light."""


class PointLight(Model):
    """Light from one point, falling with the square of the distance."""

    type: Literal["point"] = "point"
    """Kind of light."""
    position: Vec3
    """Place, metres."""
    color: Rgb = (1.0, 1.0, 1.0)
    """Radiant intensity."""


class AmbientLight(Model):
    """The same light from everywhere."""

    type: Literal["ambient"] = "ambient"
    """Kind of light."""
    color: Rgb = (0.1, 0.1, 0.1)
    """Radiance."""


LIGHTS = {"directional": DirectionalLight, "point": PointLight, "ambient": AmbientLight}


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
    | Annotated[AmbientLight, Tag("<AmbientLight>")],
    Discriminator(_light_tag),
    BeforeValidator(_check_type),
]


class SceneFile(FileModel):
    """What is to be seen."""

    kind: ClassVar[str] = "quilt_scene"

    quilt_scene: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    objects: Annotated[tuple[ObjectSpec, ...], Listed, Field(min_length=1)]
    """Meshes."""
    lights: Annotated[tuple[LightSpec, ...], Listed] = ()
    """Lights; a headlight and a dim ambient light when there are none."""
    background: Rgb = (0.0, 0.0, 0.0)
    """Colour where nothing is hit, linear."""
