"""USD stages as parts of a scene: meshes cut into triangles, placed, posed and given their surfaces."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MeshError, Problem, counted
from quiltcli.formats.gltf.posing import carried, copied_triangles
from quiltcli.formats.mesh import PolygonMesh
from quiltcli.formats.usd.clock import Movement, movement
from quiltcli.formats.usd.mesh import (
    Dress,
    Faces,
    read_dress,
    read_faces,
    read_normals,
    read_points,
    subset_rows,
)
from quiltcli.formats.usd.places import Moment
from quiltcli.formats.usd.skins import skinned
from quiltcli.formats.usd.stage import Stage, library, open_stage
from quiltcli.formats.usd.walk import Piece, Shown, walk
from quiltcli.geometry import FloatArray
from quiltcli.scene.importers.model import FileLight, Playing
from quiltcli.scene.importers.part import Part
from quiltcli.scene.importers.polygons import Cut, cut_polygons
from quiltcli.scene.importers.usd_lights import lights_at, lights_lost
from quiltcli.scene.importers.usd_surfaces import lost, surface_of, uv_names

MOST_TRIANGLES = 2**26
CLIP = "animation 1"
"""Name of a stage's animation, of which there is one."""
_KEPT = 2


@dataclass(frozen=True, eq=False)
class _Form:
    """A mesh cut into triangles, as long as its faces stay the same.

    Attributes:
        faces: the faces.
        dress: what their corners carry.
        cuts: triangles by materials.
        flaws: what of the mesh cannot be drawn.
    """

    faces: Faces
    dress: Dress
    cuts: tuple[Cut, ...]
    flaws: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class UsdModel:
    """A stage, ready to be posed at any time.

    Attributes:
        stage: the stage.
        shown: what it shows.
        movement: what of it moves.
    """

    stage: Stage
    shown: Shown
    movement: Movement
    _forms: dict[int, dict[bytes, _Form]] = field(default_factory=dict)
    _points: dict[int, tuple[FloatArray, FloatArray | None]] = field(default_factory=dict)

    @property
    def clips(self) -> tuple[str, ...]:
        """The one animation there may be."""
        return () if self.movement.clock is None else (CLIP,)

    @property
    def notices(self) -> tuple[str, ...]:
        """What of the stage is not drawn as it means."""
        return (*self.stage.notices, *self.shown.notices, *self._own_notices())

    def _own_notices(self) -> Iterator[str]:
        if self.movement.dresses and self.movement.clock is not None:
            count = counted(len(self.movement.dresses), "mesh").replace("meshs", "meshes")
            yield f"colours or texture coordinates that change over time rest ({count})"
        moment = self._moment(None, None)
        for number, piece in enumerate(self.shown.pieces):
            for words in self._form(number, moment).flaws:
                yield f"{piece.prim.GetPath()}: {words}"
            if len(uv_names(piece)) > 2:
                yield f"{piece.prim.GetPath()}: its materials look up more than 2 texture coordinates"
        made_of = {one.path: one for piece in self.shown.pieces for one in piece.materials if one is not None}
        yield from lost(list(made_of.values()))
        yield from lights_lost(self.shown.lights, moment)

    def check(self, playing: Playing) -> None:
        """Raise a `MeshError` unless the animations that are asked for are there."""
        wanted = (playing.clips,) if isinstance(playing.clips, str) else playing.clips
        for name in wanted:
            if name not in ("all", CLIP):
                words = f"has no animation {name!r} (a stage has one, {CLIP!r})"
                raise MeshError(Problem(words, str(self.stage.path)))

    def contested(self, playing: Playing) -> int:
        """Nothing is moved twice by one animation."""
        return 0

    def form(self, seconds: float | None, playing: Playing | None) -> Hashable:
        """What is equal at two times whose parts have the same triangles."""
        if not self.movement.forms:
            return None
        moment = self._moment(seconds, playing)
        everything = self._all_hidden(moment)
        return tuple(
            (len(self._places(moment, self.shown.pieces[number], everything)), self._key(number, moment))
            + tuple(moment.shown(place) for place in self.shown.pieces[number].places)
            for number in sorted(self.movement.forms)
        )

    def hidden(self, seconds: float, playing: Playing) -> bool:
        """Whether nothing is to be seen at a time."""
        return bool(self.movement.forms) and self._all_hidden(self._moment(seconds, playing))

    def parts(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[Part, ...]:
        """A part for each mesh and material, all its copies in it; at rest as the animation begins.

        Raises:
            MeshError: a mesh is broken, or there are too many triangles.
        """
        moment = self._moment(seconds, playing)
        everything = seconds is not None and self._all_hidden(moment)
        self._check_size(moment, everything)
        found: list[Part] = []
        for number, piece in enumerate(self.shown.pieces):
            places = self._places(moment, piece, everything)
            found += self._parts(piece, self._form(number, moment), self._posed(number, moment), places)
        return tuple(found)

    def pose(self, seconds: float, playing: Playing) -> tuple[FloatArray, FloatArray]:
        """Vertices and normals (V, 3) of all parts after one another at a time."""
        moment = self._moment(seconds, playing)
        everything = self._all_hidden(moment)
        vertices, normals = [np.empty((0, 3))], [np.empty((0, 3))]
        for number, piece in enumerate(self.shown.pieces):
            places = self._places(moment, piece, everything)
            points, directions = self._posed(number, moment)
            form = self._form(number, moment)
            for cut in form.cuts:
                there = carried(*_cut(form, cut, points, directions), places)
                vertices.append(there.vertices)
                normals.append(np.zeros_like(there.vertices) if there.normals is None else there.normals)
        joined = np.concatenate(vertices)
        if everything and len(joined):
            joined = np.repeat(joined[:1], len(joined), axis=0)
        return joined, np.concatenate(normals)

    def lights(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[FileLight, ...]:
        """The stage's lights at a time."""
        return lights_at(self.shown.lights, self._moment(seconds, playing))

    def _moment(self, seconds: float | None, playing: Playing | None) -> Moment:
        """The stage at a time; at rest it is as its animation begins."""
        time = library().Usd.TimeCode
        clock = self.movement.clock
        if seconds is not None and clock is not None:
            return Moment(self.stage, time(clock.code(seconds, (playing or Playing()).after)))
        if clock is None and self.stage.range is None:
            return Moment(self.stage, time.EarliestTime())
        first = clock.first if clock is not None else self.stage.range[0]  # type: ignore[index]
        return Moment(self.stage, time(first))

    def _all_hidden(self, moment: Moment) -> bool:
        if not self.movement.forms:
            return False
        return not any(moment.shown(place) for piece in self.shown.pieces for place in piece.places)

    def _places(self, moment: Moment, piece: Piece, everything: bool) -> FloatArray:
        """Metres, Y up, from the space of a mesh (C, 4, 4), for all its copies that are seen."""
        seen = [place for place in piece.places if everything or moment.shown(place)]
        found = [moment.matrices(place) for place in seen]
        return np.asarray(self.stage.world @ np.concatenate([np.empty((0, 4, 4)), *found]))

    def _check_size(self, moment: Moment, everything: bool) -> None:
        """Count before anything is copied: a small file can ask for very much."""
        total = 0
        for number, piece in enumerate(self.shown.pieces):
            own = sum(len(cut.triangles) for cut in self._form(number, moment).cuts)
            total += own * len(self._places(moment, piece, everything))
            if total > MOST_TRIANGLES:
                words = f"and all before it show {total:,} triangles (expected at most {MOST_TRIANGLES:,})"
                raise self.stage.error(piece.prim, words)

    def _key(self, number: int, moment: Moment) -> bytes:
        return read_faces(self.stage, self.shown.pieces[number].mesh, moment.time).key

    def _form(self, number: int, moment: Moment) -> _Form:
        """A mesh's triangles at a time; the last ones are kept."""
        kept = self._forms.setdefault(number, {})
        if kept and number not in self.movement.forms:
            return next(iter(kept.values()))
        piece = self.shown.pieces[number]
        faces = read_faces(self.stage, piece.mesh, moment.time)
        if faces.key not in kept:
            kept[faces.key] = self._made(piece, faces, moment.time, moving=number in self.movement.points)
            while len(kept) > _KEPT:
                kept.pop(next(iter(kept)))
        return kept[faces.key]

    def _made(self, piece: Piece, faces: Faces, time: Any, *, moving: bool) -> _Form:
        mesh = piece.mesh
        dress = read_dress(self.stage, mesh, faces, piece.asked(uv_names(piece)), time, moving=moving)
        points = read_points(self.stage, mesh, time, faces.corners.vertices)
        polygons = PolygonMesh(
            vertices=points,
            corner_start=faces.start,
            corners=faces.corners.vertex,
            uv=None,
            names=("",) * len(faces.number),
            lines=np.zeros(len(faces.number), dtype=np.int64),
            path=str(self.stage.path),
            variant=dress.variant,
            material=subset_rows(self.stage, list(piece.subsets), faces),
        )
        found = cut_polygons(polygons)
        flaws = []
        if found.too_small:
            flaws.append(f"{counted(found.too_small, 'face')} of fewer than 3 corners dropped")
        if found.coverage.crossing:
            count = counted(found.coverage.crossing, "face")
            flaws.append(f"{count} whose outline crosses itself, which no triangles can cover")
        return _Form(faces, dress, tuple(found.cuts), tuple(flaws))

    def _posed(self, number: int, moment: Moment) -> tuple[FloatArray, FloatArray | None]:
        """Points (V, 3) of a mesh and normals (C, 3) of its corners at a time; those that rest are kept."""
        if number in self._points:
            return self._points[number]
        piece, form = self.shown.pieces[number], self._form(number, moment)
        points = read_points(self.stage, piece.mesh, moment.time, form.faces.corners.vertices)
        normals = None
        if piece.skin is None:
            found = read_normals(self.stage, piece.mesh, form.faces.corners, moment.time)
            normals = None if found is None else found.at_corners
        else:
            points = skinned(piece.prim, piece.skin, moment, points)
        if number not in self.movement.points and number not in self.movement.forms:
            self._points[number] = points, normals
        return points, normals

    def _parts(
        self, piece: Piece, form: _Form, posed: tuple[FloatArray, FloatArray | None], places: FloatArray
    ) -> Iterator[Part]:
        """The parts of a mesh, one for each material."""
        double = bool(piece.mesh.GetDoubleSidedAttr().Get())
        names = uv_names(piece)
        for cut in form.cuts:
            there = carried(*_cut(form, cut, *posed), places)
            material = piece.materials[cut.row]
            corner, copies = cut.corner, len(places)
            uv = [
                None if one is None else np.tile(one.at_corners[corner], (copies, 1)) for one in form.dress.uv
            ]
            color, opacity = form.dress.color, form.dress.opacity
            worn = material is None or material.color
            faint = material is None or material.opacity
            yield Part(
                vertices=there.vertices,
                triangles=copied_triangles(cut.triangles, len(corner), there.mirrored),
                normals=there.normals,
                colors=np.tile(color.at_corners[corner], (copies, 1)).astype(np.float32)
                if color is not None and worn
                else None,
                surface=surface_of(
                    material,
                    names,
                    colored=color is not None,
                    faint=opacity is not None and bool((opacity.values < 1).any()),
                    double_sided=double,
                ),
                uv=uv[0],
                uv1=uv[1],
                material="" if material is None else material.name,
                opacities=np.tile(opacity.at_corners[corner, 0], copies).astype(np.float32)
                if opacity is not None and faint and (opacity.values < 1).any()
                else None,
            )


def read_usd_model(path: Path) -> UsdModel:
    """Open a stage and look at all that it shows.

    Raises:
        MissingExtraError: the package of the extra `usd` is not installed.
        MeshError: the stage is wrong.
    """
    stage = open_stage(path)
    time = library().Usd.TimeCode
    shown = walk(stage, time.EarliestTime() if stage.range is None else time(stage.range[0]))
    return UsdModel(stage, shown, movement(stage, shown))


def _cut(
    form: _Form, cut: Cut, points: FloatArray, normals: FloatArray | None
) -> tuple[FloatArray, FloatArray | None]:
    """Points and normals (V, 3) of the vertices of a cut."""
    own = points[form.faces.corners.vertex[cut.corner]]
    return own, None if normals is None else normals[cut.corner]
