"""The objects of a scene file: what each brings to the scene, at its start and in any frame."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from quiltcli.errors import MeshError, Problem, SceneError
from quiltcli.geometry import FloatArray, normalized
from quiltcli.job.frames import format_frames
from quiltcli.job.sequence import MeshSequence, numbered
from quiltcli.scene.bake import Baked, bake
from quiltcli.scene.importers.asset import Asset, read_asset
from quiltcli.scene.importers.model import FileLight, Playing
from quiltcli.scene.importers.part import Part, moved, placed
from quiltcli.scene.materials import Surface, textures_of
from quiltcli.scene.movers import Mover
from quiltcli.scene.textures.pool import check_textures

if TYPE_CHECKING:
    from quiltcli.job.scene import ObjectSpec

# Files of a sequence that are kept: the one that is shown and the one before it.
_KEPT = 2


@dataclass(frozen=True, eq=False)
class Brought:
    """What an object brings to the scene.

    Attributes:
        asset: its mesh file.
        baked: its triangles, in the world.
        surfaces: those of its parts.
        lights: those of its file, in the world.
        materials: names of its parts' materials, empty where they have none.
    """

    asset: Asset
    baked: Baked
    surfaces: tuple[Surface, ...]
    lights: tuple[FileLight, ...]
    materials: tuple[str, ...] = ()


class ObjectError(SceneError):
    """An object that is wrong by another key than its mesh: `key`."""

    key = ""


class AnimationError(ObjectError):
    """An animation that cannot be played."""

    key = "animation"


class SceneObject(Protocol):
    """An object of the scene."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def playing(self) -> Playing | None:
        """Which animations of its file are played."""

    @property
    def start(self) -> Brought:
        """What it brings at its start."""

    def at(self, frame: float, fps: float) -> Brought:
        """What it brings in a frame; the same object where that has not changed."""

    def absent(self, frames: Iterable[int]) -> Iterator[str]:
        """Why there is nothing to show in some of the frames, one sentence for each reason."""


def load_object(item: ObjectSpec, assets: dict[tuple[Path, int], Asset]) -> SceneObject:
    """Read, place and bake an object as it is at its start.

    Args:
        item: what the scene file says of it.
        assets: meshes that are read already, by their subdivision, too; others are added.

    Raises:
        SceneError: the mesh cannot be read, or a sequence has no file for a number.
    """
    if item.sequence is not None:
        return _load_sequence(item, item.sequence)
    key = item.mesh, item.subdivision
    if key not in assets:
        assets[key] = read_asset(*key)
    asset = assets[key]
    playing = _playing(item, asset)
    time = None if item.animation is None else item.animation.offset
    matrix = item.world_from_mesh()
    return OneMesh(item, playing, time, matrix, bring(item, asset, playing, time, matrix))


def bring(
    item: ObjectSpec,
    asset: Asset,
    playing: Playing | None = None,
    time: float | None = None,
    matrix: FloatArray | None = None,
) -> Brought:
    """Place and bake an object.

    Args:
        item: what the scene file says of it.
        asset: its mesh.
        playing: which animations of the mesh are played.
        time: of theirs, seconds.
        matrix: world from the mesh's space (4, 4).

    Raises:
        SceneError: nothing of it can be drawn.
    """
    override = {} if item.material is None else item.material.changes()
    parts, lights = asset.parts, () if asset.model is None else asset.model.lights(time, playing)
    if playing is not None and asset.model is not None:
        parts = asset.model.parts(time, playing)
    baked = bake(_parts(parts, matrix, override), item.normals)
    if playing is not None and asset.model is not None and time is not None:
        baked = _started(item, asset, baked, Mover(asset.model, playing, matrix, baked), override, time)
    if not len(baked.triangles):
        raise SceneError(Problem("every triangle is without area or not finite", str(item.mesh)))
    given = () if item.material is None else textures_of(item.material)
    surfaces = tuple(part.surface.overridden(override, given) for part in parts)
    check_textures(texture for surface in surfaces for texture in surface.textures)
    names = tuple(part.material for part in parts)
    return Brought(asset, baked, surfaces, _placed_lights(lights, matrix), names)


def _parts(parts: Sequence[Part], matrix: FloatArray | None, override: dict[str, object]) -> tuple[Part, ...]:
    if matrix is not None:
        parts = tuple(placed(part, matrix) for part in parts)
    if "color" in override:
        parts = tuple(replace(part, colors=None, opacities=None) for part in parts)
    return tuple(parts)


def _started(
    item: ObjectSpec, asset: Asset, baked: Baked, mover: Mover, override: dict[str, object], time: float
) -> Baked:
    """An object of an animation as it is at a time."""
    if mover.model.hidden(time, mover.playing) and len(baked.triangles):
        vertices, normals = mover.at(time)
        return replace(baked, vertices=vertices, normals=normals)
    if baked.empty and mover.model.form(time, mover.playing) == mover.model.form(None, mover.playing):
        return _from_rest(item, asset, baked, mover, override, time)
    return baked


def _from_rest(
    item: ObjectSpec, asset: Asset, baked: Baked, mover: Mover, override: dict[str, object], time: float
) -> Baked:
    """An object whose first pose flattens triangles, which others do not, baked at rest if that is better."""
    rest = bake(_parts(asset.parts, mover.matrix, override), item.normals)
    if rest.empty >= baked.empty:
        return baked
    vertices, normals = replace(mover, baked=rest).at(time)
    return replace(rest, vertices=vertices, normals=normals)


def _placed_lights(lights: Sequence[FileLight], matrix: FloatArray | None) -> tuple[FileLight, ...]:
    return tuple(lights) if matrix is None else tuple(light.placed(matrix) for light in lights)


def _playing(item: ObjectSpec, asset: Asset) -> Playing | None:
    """How an object's animation is played, if it is."""
    if item.animation is None:
        return None
    if asset.model is None or not asset.model.clips:
        raise AnimationError(Problem("has no animation", str(item.mesh)))
    playing = Playing(item.animation.clip, item.animation.after)
    try:
        asset.model.check(playing)
    except MeshError as error:
        raise AnimationError(error.problems) from error
    return playing


@dataclass(frozen=True, eq=False)
class _Pose:
    """What an object brought last: it may rest there."""

    time: float | None
    matrix: FloatArray | None
    brought: Brought


def _same(a: FloatArray | None, b: FloatArray | None) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


@dataclass(frozen=True, eq=False)
class OneMesh:
    """An object of one mesh file, whose triangles stay the same: still, on keyframes, or animated.

    Attributes:
        item: what the scene file says of it.
        playing: which animations of its file are played.
        time: of those at its start, seconds; None where there are none.
        matrix: (4, 4) its place in the world at its start, or None.
        start: what it brings then.
    """

    item: ObjectSpec
    playing: Playing | None
    time: float | None
    matrix: FloatArray | None
    start: Brought
    _last: list[_Pose] = field(default_factory=list)
    _forms: list[tuple[Hashable, Brought]] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its name."""
        return self.item.name or self.item.mesh.stem

    @cached_property
    def _local(self) -> FloatArray:
        """Vertices (V, 3) in the space of the mesh, in the order in which they are baked."""
        joined = np.concatenate([part.vertices for part in self.start.asset.parts])
        return joined[self.start.baked.source]

    def at(self, frame: float, fps: float) -> Brought:
        """What it brings in a frame; the same object where it stands as at its start."""
        spec, place = self.item.animation, self.item.transform
        time = None if spec is None else spec.seconds(frame, fps)
        carried = place is not None and place.moves
        matrix = self.item.world_from_mesh(frame) if carried else self.matrix
        if time == self.time and _same(matrix, self.matrix):
            return self.start
        if not self._last or self._last[0].time != time or not _same(self._last[0].matrix, matrix):
            self._last[:] = [_Pose(time, matrix, self._posed(time, matrix))]
        return self._last[0].brought

    def _posed(self, time: float | None, matrix: FloatArray | None) -> Brought:
        """What it brings at a time of its animations, where a matrix (4, 4) has taken it."""
        model = self.start.asset.model
        if time is None or model is None or self.playing is None:
            assert matrix is not None
            return self._carried(matrix)
        form = model.form(time, self.playing)
        if not self._forms:
            self._forms.append((model.form(self.time, self.playing), self.start))
        known = next((brought for one, brought in self._forms if one == form), None)
        if known is None:
            known = bring(self.item, self.start.asset, self.playing, time, matrix)
            # The start is kept, and of the others the last.
            self._forms[1:] = [(form, known)]
            return known
        vertices, normals = Mover(model, self.playing, matrix, known.baked).at(time)
        lights = _placed_lights(model.lights(time, self.playing), matrix)
        baked = replace(known.baked, vertices=vertices, normals=normals)
        return replace(known, baked=baked, lights=lights)

    def _carried(self, matrix: FloatArray) -> Brought:
        """What it brings where a matrix (4, 4) has taken it."""
        assert self.matrix is not None
        baked, model = self.start.baked, self.start.asset.model
        # Normals go on from its start, where they are those of an object that does not move.
        way = matrix @ np.linalg.inv(self.matrix)
        vertices, _ = moved(matrix, self._local, np.empty((0, 3)))
        _, normals = moved(way, np.empty((0, 3)), baked.normals.astype(np.float64))
        assert normals is not None
        lights = () if model is None else _placed_lights(model.lights(), matrix)
        new = replace(baked, vertices=vertices, normals=normalized(normals).astype(np.float32))
        return replace(self.start, baked=new, lights=lights)

    def absent(self, frames: Iterable[int]) -> Iterator[str]:
        """Nothing is amiss: it has a place in every frame."""
        yield from ()


def _load_sequence(item: ObjectSpec, files: MeshSequence) -> NumberedMeshes:
    there, missing = files.there(), files.missing()
    if missing or not there:
        lost = missing or tuple(files.numbers)
        names = ", ".join(numbered(files.pattern, number).name for number in lost[:3])
        more = f" and {len(lost) - 3} more" if len(lost) > 3 else ""
        verb = "is" if len(lost) == 1 else "are"
        advice = " (hold: nearest or hold: last shows others instead)" if there else ""
        words = f"{names}{more} {verb} missing from {files.pattern}{advice}"
        raise SceneError(Problem(words))
    return NumberedMeshes(item, files, there)


@dataclass(frozen=True, eq=False)
class NumberedMeshes:
    """An object of one mesh file a frame, whose triangles may change.

    Attributes:
        item: what the scene file says of it.
        files: its files.
        there: the numbers of those there are, ascending.
    """

    item: ObjectSpec
    files: MeshSequence
    there: tuple[int, ...]
    _kept: OrderedDict[tuple[int, bytes], Brought] = field(default_factory=OrderedDict)

    @property
    def name(self) -> str:
        """Its name: that of the files without their number."""
        return self.item.name or self.item.mesh.stem.replace("#", "").rstrip("._- ") or self.item.mesh.stem

    @property
    def playing(self) -> Playing | None:
        """Files of a sequence rest."""
        return None

    @cached_property
    def start(self) -> Brought:
        """What its first file brings."""
        return self._shown(self.there[0], self.there[0])

    def at(self, frame: float, fps: float) -> Brought:
        """What it brings in a frame.

        Raises:
            SceneError: the frame has no file, or it cannot be read.
        """
        number = self.files.shown(frame, self.there)
        if number is None:
            raise SceneError([Problem(words) for words in self.absent([int(frame // 1)])])
        return self._shown(number, frame)

    def _shown(self, number: int, frame: float) -> Brought:
        matrix = self.item.world_from_mesh(frame)
        key = number, b"" if matrix is None else matrix.tobytes()
        if key not in self._kept:
            path = numbered(self.files.pattern, number)
            self._kept[key] = bring(self.item, read_asset(path, self.item.subdivision), matrix=matrix)
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def absent(self, frames: Iterable[int]) -> Iterator[str]:
        """Frames that have no file and nothing to stand in for it."""
        lost = [frame for frame in frames if self.files.shown(frame, self.there) is None]
        if lost:
            which = f"frame {lost[0]} has" if len(lost) == 1 else f"frames {format_frames(lost)} have"
            yield (
                f"{which} no file of {self.files.pattern} (frames: {format_frames(self.files.numbers)};"
                " hold: nearest or hold: last shows others instead)"
            )
