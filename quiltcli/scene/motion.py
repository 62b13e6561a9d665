"""Scenes that move: the scene of every frame, from objects on keyframes, animated and of numbered files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from quiltcli.errors import MeshError, Problem, SceneError
from quiltcli.scene.environment.sky import sky_of
from quiltcli.scene.load import lights_in, load_objects, scene_of, wants_lights
from quiltcli.scene.objects import Brought, SceneObject
from quiltcli.scene.scene import Scene, facing_anywhere
from quiltcli.scene.textures.pool import TextureStore

if TYPE_CHECKING:
    from quiltcli.job.scene import SceneFile


@dataclass
class _Last:
    """The last frame's scene; only what would be found again is kept.

    Attributes:
        brought: what the objects brought to it.
        scene: the scene.
    """

    brought: Sequence[Brought]
    scene: Scene


@dataclass(frozen=True, eq=False)
class MovingScene:
    """The scene of each frame; the frame number alone decides.

    Attributes:
        spec: the scene file.
        objects: its objects.
        base: the scene with each object as it is at its start.
        fps: frames a second.
        store: makes the textures; None where nothing will be drawn.
    """

    spec: SceneFile
    objects: tuple[SceneObject, ...]
    base: Scene
    fps: float
    store: TextureStore | None = None
    _last: list[_Last] = field(default_factory=list)

    def scene_at(self, frame: float) -> Scene:
        """The scene as it is in a frame; `base` itself where everything is as at its start.

        Where the triangles are those of the frame before, only vertices and normals (and lights of
        files) are new, all other arrays the same objects.

        Raises:
            SceneError: a sequence has no file for the frame, or it cannot be read.
        """
        brought = [self._brought(index, frame) for index in range(len(self.objects))]
        start = [one.start for one in self.objects]
        if all(a is b for a, b in zip(brought, start, strict=True)):
            return self.base
        last = self._last[0] if self._last else _Last(start, self.base)
        if not _alike(brought, last.brought):
            last = _Last(start, self.base)
        if all(a is b for a, b in zip(brought, last.brought, strict=True)):
            return last.scene
        if _alike(brought, last.brought):
            scene = self._posed(last.scene, brought)
        else:
            scene = covered(scene_of(self.spec, self.objects, brought), self.store)
            scene = replace(scene, sky=self.base.sky)
        self._last[:] = [_Last(brought, scene)]
        return scene

    def _brought(self, index: int, frame: float) -> Brought:
        try:
            return self.objects[index].at(frame, self.fps)
        except (MeshError, SceneError) as error:
            key = ("objects", index, "mesh")
            raise SceneError([self.spec.source.problem(key, str(p)) for p in error.problems]) from error

    def _posed(self, form: Scene, brought: Sequence[Brought]) -> Scene:
        """A scene of the same triangles with the vertices, normals and lights that objects bring."""
        lights = form.lights
        if wants_lights(self.spec):
            lights = lights_in(self.spec.lights, [light for one in brought for light in one.lights])
        scene = replace(
            form,
            vertices=np.concatenate([one.baked.vertices for one in brought]),
            normals=np.concatenate([one.baked.normals for one in brought]),
            lights=lights,
        )
        facing = facing_anywhere(len(scene.vertices))
        return scene.knowing(facing=facing, corner_colors=form.corner_colors)

    def problems(self, frames: Iterable[int]) -> Iterator[Problem]:
        """What keeps frames from being drawn: objects that have no file for them."""
        frames = list(frames)
        for index, one in enumerate(self.objects):
            for words in one.absent(frames):
                yield self.spec.source.problem(("objects", index, "frames"), words)


def _alike(some: Sequence[Brought], others: Sequence[Brought]) -> bool:
    """Whether objects have the same triangles, in the same files' colours."""
    pairs = zip(some, others, strict=True)
    return all(a.baked.triangles is b.baked.triangles and a.asset is b.asset for a, b in pairs)


def covered(scene: Scene, store: TextureStore | None) -> Scene:
    """The scene with the pictures that cover its surfaces, where a store makes them."""
    textures = None if store is None else store.of(scene.materials.textures)
    return scene if textures is None else replace(scene, textures=textures)


def load_moving_scene(
    spec: SceneFile, fps: float, store: TextureStore | None = None
) -> tuple[Scene, MovingScene | None]:
    """A scene with each object as it is at its start, and what gives its frames if something in it moves.

    Args:
        spec: the scene file.
        fps: frames a second.
        store: makes the textures; None for a scene that is looked into and not drawn.

    Raises:
        SceneError: as for `load.load_scene`, and of textures.
    """
    objects = load_objects(spec)
    base = covered(scene_of(spec, objects, [one.start for one in objects]), store)
    seen = next((light for light in spec.lights if light.type == "environment" and light.visible), None)
    if seen is not None and store is not None:
        base = replace(base, sky=sky_of(seen, store))
    moves = any(item.moves for item in spec.objects)
    return base, MovingScene(spec, objects, base, fps, store) if moves else None
