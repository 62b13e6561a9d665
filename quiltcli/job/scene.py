"""The scene file: objects, lights and background."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field

from quiltcli.geometry import FloatArray
from quiltcli.job.display import Units
from quiltcli.job.lengths import UNITS, UpAxis, up_matrix
from quiltcli.job.lights import LightSpec, listed_lights
from quiltcli.job.model import (
    Complaint,
    ExistingFile,
    FileModel,
    Listed,
    Model,
    NotNegative,
    Number,
    OneOf,
    Rgb,
    Unit,
    Vec2,
    complaint,
    describe,
)
from quiltcli.job.placement import PlacementSpec
from quiltcli.job.sequence import MeshOrSequence, MeshSequence, is_pattern
from quiltcli.job.viewer import FrameRange

Picture: TypeAlias = Annotated[Path, ExistingFile((), "a picture")]


class TexturesSpec(Model):
    """Pictures that vary a material, laid out by the mesh's texture coordinates."""

    color: Picture | None = None
    """Picture that base colours are multiplied with, in sRGB unless it is a float file."""
    emission: Picture | None = None
    """Picture of the light given off, likewise."""
    metallic: Picture | None = None
    """Picture of 0 to 1 for paint to metal, of which red counts."""
    roughness: Picture | None = None
    """Picture of 0 to 1 for a mirror to chalk, of which red counts."""
    normal: Picture | None = None
    """Normal map: red to the picture's right, green to its upper edge, blue out of the surface."""
    occlusion: Picture | None = None
    """Picture of how much of the ambient light arrives, of which red counts."""
    scale: Vec2 = (1.0, 1.0)
    """How many times the pictures are there in the mesh's texture coordinates from 0 to 1, along u and v."""
    offset: Vec2 = (0.0, 0.0)
    """Added to texture coordinates after that; v is up."""
    wrap: Annotated[str, OneOf(("repeat", "clamp", "mirror"))] = "repeat"
    """What is beyond a picture's edges: itself again, its edge, or its mirror image."""
    uv_set: Annotated[int, Field(ge=0, le=1)] = 0
    """Which of the mesh's texture coordinates, the number of the set."""
    strength: Number = 1.0
    """Strength of the normal map: how many times its slopes; 0 is flat."""

    def pictures(self) -> dict[str, Path]:
        """The pictures by what they vary."""
        roles = ("color", "emission", "metallic", "roughness", "normal", "occlusion")
        return {role: path for role in roles if (path := getattr(self, role)) is not None}

    def cross_checks(self) -> Iterator[Complaint]:
        """There is a picture."""
        if not self.pictures():
            yield (), "names no picture (expected color, emission, metallic, roughness, normal or occlusion)"


_UNDER_PICTURES = {"color": (1.0, 1.0, 1.0), "emission": (1.0, 1.0, 1.0), "metallic": 1.0, "roughness": 1.0}
"""What pictures of a scene file multiply unless it says something else."""


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
    opacity: Unit | None = None
    """How much light the surface holds up: 1 all, 0 none."""
    alpha: Annotated[str, OneOf(("opaque", "mask", "blend"))] | None = None
    """What opacity means: nothing (opaque), there or not (mask), or a share of light (blend)."""
    cutoff: NotNegative | None = None
    """The least opacity that a mask shows; 0.5 when neither this nor the mesh file says."""
    double_sided: bool | None = None
    """Whether its back is seen, in jobs with `render.double_sided: file`."""
    textures: TexturesSpec | None = None
    """Pictures that vary the material; they multiply `color`, `emission`, `metallic` and `roughness`."""

    def changes(self) -> dict[str, Any]:
        """Values to change by name; under a picture they are 1 where nothing else is said."""
        under = {} if self.textures is None else self.textures.pictures()
        values = {key: value for key, value in _UNDER_PICTURES.items() if key in under}
        return values | self.model_dump(exclude_none=True, exclude={"textures"})


def _clip_names(value: Any) -> Any:
    """`all`, a name, or names: as text or a tuple of texts."""
    if isinstance(value, (list, tuple)):
        for index, name in enumerate(value):
            if not isinstance(name, str) or not name:
                raise complaint(f"expected the name of an animation, got {describe(name)}", index)
        if not value:
            raise complaint("expected all, a name or a list of names, got a list of 0")
        return tuple(value)
    if not isinstance(value, str) or not value:
        raise complaint(f"expected all, a name or a list of names, got {describe(value)}")
    return value


class AnimationSpec(Model):
    """How the animation in a mesh file is played.

    The time of a frame is speed · (frame − start_frame) / fps + offset, in seconds.
    """

    start_frame: int = 0
    """Frame at which the animation begins."""
    offset: Number = 0.0
    """Seconds into the animation at that frame."""
    speed: Number = 1.0
    """Seconds of the animation a second; below 0 it runs backwards."""
    clip: Annotated[str | tuple[str, ...], BeforeValidator(_clip_names)] = "all"
    """Name of the animation, or a list of names; all of them together when absent."""
    after: Annotated[str, OneOf(("hold", "loop", "bounce"))] = "hold"
    """At its end: stay there, begin anew, or run back and forth."""

    def seconds(self, frame: float, fps: float) -> float:
        """Time within the animation at a frame."""
        return self.speed * (frame - self.start_frame) / fps + self.offset


class ObjectSpec(Model):
    """A mesh in the scene."""

    name: str = ""
    """Name for tables; the mesh file's name when absent."""
    mesh: Annotated[Path, MeshOrSequence()]
    """OBJ, PLY, OFF, STL, glTF, USD or Alembic; with # for a number, such as boat.####.ply, one a frame."""
    frames: FrameRange | None = None
    """Numbers of the files of a sequence, one a frame."""
    hold: Annotated[str, OneOf(("nearest", "last"))] | None = None
    """What a sequence shows where it has no file of the frame's number; without this key that is an error."""
    units: Units = "m"
    """What the mesh is measured in: m, cm, mm, in, ft, or a number of metres."""
    up_axis: UpAxis = "y"
    """Axis that is up in the mesh; with z up, its -Y faces the world's +Z."""
    transform: PlacementSpec | None = None
    """Place of the object in the world, or places at keyframes."""
    material: MaterialSpec | None = None
    """What to change of the materials in the mesh file."""
    normals: Annotated[str, OneOf(("auto", "flat", "smooth"))] = "auto"
    """Shade each triangle flat, smooth over the vertices, or (auto) as the mesh file says."""
    subdivision: Annotated[int, Field(ge=0, le=5)] = 0
    """Number of times subdivision surfaces (of USD) are refined, into 4 times the faces; 0 for cages."""
    animation: AnimationSpec | None = None
    """Play the animation in the mesh file; without this key it rests."""
    casts_shadows: bool = True
    """Whether it stands in the way of lights that have shadows."""

    def world_from_mesh(self, frame: float | None = None) -> FloatArray | None:
        """World from mesh (4, 4) at a frame, or at its start: units, up axis, transform.

        None where both are the same.
        """
        place = self.transform
        world = None if place is None else place.at(place.start if frame is None else frame)
        if self.units == "m" and self.up_axis == "y":
            return world
        unit = UNITS[self.units] if isinstance(self.units, str) else self.units
        local = up_matrix(self.up_axis) * (unit, unit, unit, 1)
        return local if world is None else np.asarray(world @ local)

    @property
    def sequence(self) -> MeshSequence | None:
        """The files of the object, where it is one a frame."""
        return None if self.frames is None else MeshSequence(self.mesh, self.frames, self.hold)

    @property
    def moves(self) -> bool:
        """Whether it may look otherwise in another frame."""
        carried = self.transform is not None and self.transform.moves
        return carried or self.animation is not None or self.frames is not None

    def cross_checks(self) -> Iterator[Complaint]:
        """Numbered files have numbers, and others have none."""
        if self.frames is None:
            if is_pattern(self.mesh) and not self.mesh.exists():
                words = f"is a sequence (expected frames, the numbers of {self.mesh.name}), got no frames"
                yield ("mesh",), words
            if self.hold is not None:
                yield ("hold",), "belongs to a sequence of meshes (expected frames beside it)"
            return
        if not is_pattern(self.mesh):
            words = f"belongs to a sequence (expected a mesh such as boat.####.ply), got {self.mesh.name!r}"
            yield ("frames",), words
        if self.animation is not None:
            yield ("animation",), "cannot stand beside frames (a sequence has one pose a file)"


class SceneFile(FileModel):
    """What is to be seen."""

    kind: ClassVar[str] = "quilt_scene"

    quilt_scene: Annotated[int, Field(ge=1, le=1)] = 1
    """Version of the format."""
    objects: Annotated[tuple[ObjectSpec, ...], Listed, Field(min_length=1)]
    """Meshes."""
    lights: Annotated[tuple[LightSpec, ...], BeforeValidator(listed_lights)] = ()
    """Lights, or `file` for those of the meshes; a headlight and a dim ambient light when there are none."""
    background: Rgb = (0.0, 0.0, 0.0)
    """Colour where nothing is hit, linear."""

    def without_shadows(self) -> SceneFile:
        """The same with lights that shine through everything."""
        return self._lit(light.model_copy(update={"shadows": False}) for light in self.lights)

    def with_ambient_occlusion(self, distance: float, rays: int) -> SceneFile:
        """The same; what is near a place keeps light from it that comes from everywhere."""
        update = {"shadows": True, "distance": distance, "rays": rays}
        open_to_all = ("ambient", "environment")
        return self._lit(
            light.model_copy(update=update) if light.type in open_to_all and not light.shadows else light
            for light in self.lights
        )

    def _lit(self, lights: Iterable[LightSpec]) -> SceneFile:
        return self.model_copy(update={"lights": tuple(lights)})
