"""Load a scene: read its meshes, put them in the world, gather materials and lights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from quiltcli.errors import MeshError, Problem, SceneError, counted, raise_all
from quiltcli.formats.mesh.coverage import NOTHING, Coverage
from quiltcli.geometry import Float32Array
from quiltcli.scene.bake import Baked, given_opacities, given_uv
from quiltcli.scene.importers.asset import Asset, read_asset
from quiltcli.scene.importers.model import FileLight, Model, Playing
from quiltcli.scene.lights import (
    Light,
    ambient,
    default_lights,
    directional,
    environment,
    lights_of,
    panel,
    point,
    spot,
)
from quiltcli.scene.materials import Surface, material_table
from quiltcli.scene.objects import Brought, ObjectError, SceneObject, bring, load_object
from quiltcli.scene.scene import Scene
from quiltcli.scene.textures.notices import textures_not_drawn, textures_without_places

if TYPE_CHECKING:
    from quiltcli.job.lights import LightSpec
    from quiltcli.job.scene import ObjectSpec, SceneFile

Color = tuple[float, float, float]


def load_scene(scene: Path | str | SceneFile) -> Scene:
    """Load a scene file, or a mesh or glTF file as a scene of one object.

    Everything is baked to world space: instances, transforms (a mirroring one turns the winding
    over), materials. Colours given in the scene file replace the mesh's own, vertex colours included.
    What moves is as it is at its start; `motion.load_moving_scene` has all its frames.

    Raises:
        SceneError: a mesh is missing, unreadable, of an unknown kind or has no triangles. All
            problems at once, each with the file, and the line and key of the scene file.
        JobError: the scene file itself is wrong.
    """
    if isinstance(scene, (str, Path)):
        path = Path(scene)
        if path.suffix.lower() not in (".yaml", ".yml"):
            return _mesh_scene(path)
        from quiltcli.job import load_scene_file

        scene = load_scene_file(path)
    objects = load_objects(scene)
    return scene_of(scene, objects, [one.start for one in objects])


@dataclass
class _Gathered:
    """What the objects have brought so far."""

    names: list[str] = field(default_factory=list)
    baked: list[Baked] = field(default_factory=list)
    materials: list[list[int]] = field(default_factory=list)
    surfaces: dict[Surface, int] = field(default_factory=dict)
    named: list[list[int]] = field(default_factory=list)
    material_names: dict[str, int] = field(default_factory=dict)
    coverage: Coverage = NOTHING
    notices: list[str] = field(default_factory=list)
    lights: list[FileLight] = field(default_factory=list)
    wants_lights: bool = False

    def take(self, name: str, brought: Brought, playing: Playing | None) -> None:
        """Append what an object brings."""
        self.add(name, brought)
        self.animate(name, brought.asset.model, playing)
        self.light(name, brought.lights)

    def add(self, name: str, brought: Brought) -> None:
        """Append an object; a material that has no name has the object's."""
        asset, baked = brought.asset, brought.baked
        self.names.append(name)
        self.baked.append(baked)
        self.materials.append([self.surfaces.setdefault(s, len(self.surfaces)) for s in brought.surfaces])
        called = [material or name for material in brought.materials]
        self.named.append([self.material_names.setdefault(m, len(self.material_names)) for m in called])
        self.coverage += asset.coverage
        self.notices += [f"{name}: {words}" for words in textures_not_drawn(brought.surfaces)]
        self.notices += [f"{name}: {words}" for words in textures_without_places(baked, brought.surfaces)]
        for count, why in ((baked.infinite, "with NaN or infinite vertices"), (baked.empty, "of no area")):
            if count:
                self.notices.append(f"{name}: {counted(count, 'triangle')} {why} dropped")
        self.notices += [f"{name}: {notice}" for notice in asset.notices]
        for missing in asset.missing:
            self.notices.append(f"{name}: the material file {missing!r} is missing (default materials used)")

    def animate(self, name: str, model: Model | None, playing: Playing | None) -> None:
        """Say what becomes of an object's animations."""
        if model is None or not model.clips:
            return
        clips = counted(len(model.clips), "animation")
        if playing is None:
            words = f"{clips} of the file not played ('animation' of the object plays them)"
            self.notices.append(f"{name}: {words}")
            return
        lost = model.contested(playing)
        if lost:
            words = f"animated by two clips at once (the first counts): {counted(lost, 'channel')}"
            self.notices.append(f"{name}: {words}")

    def light(self, name: str, lights: Sequence[FileLight]) -> None:
        """Take an object's own lights, or say that they are left out."""
        if not lights:
            return
        if not self.wants_lights:
            words = f"{counted(len(lights), 'light')} of the file left out ('lights: file' takes them)"
            self.notices.append(f"{name}: {words}")
            return
        self.lights += lights


def _mesh_scene(path: Path) -> Scene:
    """A mesh file as the only object, lit by the headlight."""
    from quiltcli.job.scene import ObjectSpec

    asset = read_asset(path)
    gathered = _Gathered()
    gathered.take(path.stem, bring(ObjectSpec(mesh=path), asset), None)
    return _assembled(gathered, (), (0.0, 0.0, 0.0))


def load_objects(spec: SceneFile) -> tuple[SceneObject, ...]:
    """The objects of a scene file, each as it is at its start; a mesh that several show is read once.

    Raises:
        SceneError: as for `load_scene`.
    """
    assets: dict[tuple[Path, int], Asset] = {}
    objects: list[SceneObject] = []
    problems: list[Problem] = []
    for index, item in enumerate(spec.objects):
        try:
            objects.append(load_object(item, assets))
        except (MeshError, SceneError) as error:
            key = error.key if isinstance(error, ObjectError) else "mesh"
            problems += [spec.source.problem(("objects", index, key), str(p)) for p in error.problems]
    raise_all(SceneError, problems)
    return tuple(objects)


def scene_of(spec: SceneFile, objects: Sequence[SceneObject], brought: Sequence[Brought]) -> Scene:
    """The scene of objects that bring this."""
    gathered = _Gathered(wants_lights=wants_lights(spec))
    for index, (one, given) in enumerate(zip(objects, brought, strict=True)):
        gathered.take(one.name, given, one.playing)
        gathered.notices += _bright(index, spec.objects[index])
    thin = tuple(index for index, item in enumerate(spec.objects) if not item.casts_shadows)
    return replace(_assembled(gathered, spec.lights, spec.background), lets_light_by=thin)


def wants_lights(spec: SceneFile) -> bool:
    """Whether a scene takes the lights of its objects' files."""
    return any(light.type == "file" for light in spec.lights)


def _bright(index: int, item: ObjectSpec) -> Iterator[str]:
    """A colour above 1 gives off more light than falls on it: a number of 8 bits, most likely."""
    material = item.material
    if material is None or material.color is None or material.unlit or max(material.color) <= 1:
        return
    text = ", ".join(f"{part:g}" for part in material.color)
    how = "divide 8-bit values by 255 and make them linear" if max(material.color) > 2 else "white is 1"
    yield f"objects[{index}].material.color [{text}] reflects more light than falls on it ({how})"


def _assembled(gathered: _Gathered, lights: Sequence[LightSpec], background: Color) -> Scene:
    """One set of arrays for all objects."""
    baked = gathered.baked
    counts = [len(b.triangles) for b in baked]
    base = np.cumsum([0, *(len(b.vertices) for b in baked)])
    rows, named = (
        [np.array(m, dtype=np.int32)[b.part] for m, b in zip(table, baked, strict=True)]
        for table in (gathered.materials, gathered.named)
    )
    triangles = [b.triangles + start for b, start in zip(baked, base, strict=False)]
    uv, uv1 = given_uv(baked)
    return Scene(
        vertices=np.concatenate([b.vertices for b in baked]),
        triangles=np.concatenate(triangles).astype(np.int32),
        normals=np.concatenate([b.normals for b in baked]),
        colors=np.concatenate([_colors(b) for b in baked]),
        flat=np.repeat([b.flat for b in baked], counts),
        object=np.repeat(np.arange(len(baked), dtype=np.int32), counts),
        material=np.concatenate(rows),
        objects=tuple(gathered.names),
        materials=material_table(list(gathered.surfaces)),
        lights=lights_in(lights, gathered.lights),
        background=np.array(background, dtype=np.float32),
        uv=uv,
        uv1=uv1,
        coverage=gathered.coverage,
        material_names=tuple(gathered.material_names),
        material_name=np.concatenate(named),
        opacities=given_opacities(baked),
        notices=_notices(gathered, lights),
    )


def _colors(baked: Baked) -> Float32Array:
    return np.ones(baked.vertices.shape, np.float32) if baked.colors is None else baked.colors


def _notices(gathered: _Gathered, lights: Sequence[LightSpec]) -> tuple[str, ...]:
    notices = list(gathered.notices)
    if not _has_lamps(lights, gathered.lights):
        left_out = any("of the file left out" in notice for notice in notices)
        why = "no lights are asked for" if left_out else "the scene has no lights"
        notices.append(f"{why}: a headlight at the viewer and a dim ambient light are used")
    return tuple(notices)


def _has_lamps(lights: Sequence[LightSpec], found: Sequence[FileLight]) -> bool:
    """Whether anything lights the scene."""
    return any(light.type != "file" for light in lights) or bool(found)


def lights_in(lights: Sequence[LightSpec], found: Sequence[FileLight]) -> tuple[Light, ...]:
    """The lights of scene and mesh files; without any, a headlight and a dim ambient light."""
    if not _has_lamps(lights, found):
        return default_lights()
    scale = sum(light.scale for light in lights if light.type == "file")
    shadows = any(light.shadows for light in lights if light.type == "file")
    own = [light for light in lights if light.type != "file"]
    rows = list(lights_of(own)) if own else []
    rows += [_lamp(light, scale, shadows=shadows) for light in found]
    return tuple(rows)


def _lamp(light: FileLight, scale: float, *, shadows: bool) -> Light:
    """A light of a mesh file."""
    color = [scale * part for part in light.color]
    if light.kind == "directional":
        return directional(light.direction, color, shadows=shadows)
    if light.kind == "point":
        return point(light.position, color, light.reach, shadows=shadows)
    if light.kind == "area":
        return panel(light.position, light.across, light.along, color, shadows=shadows)
    if light.kind == "ambient":
        return ambient(color)
    if light.kind == "environment":
        return environment(light.panorama, light.axes, color, shadows=shadows)
    return spot(light.position, light.direction, color, light.cone, light.reach, shadows=shadows)
