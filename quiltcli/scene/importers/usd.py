"""USD stages as parts of a scene: meshes cut into triangles, placed, posed and given their surfaces."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MeshError, Problem, counted
from quiltcli.formats.corners import Faces, normals_of_groups, same_normals
from quiltcli.formats.subdivision import subdivided
from quiltcli.formats.usd.changes import Movement, movement
from quiltcli.formats.usd.mesh import read_dress, read_faces, read_points, read_sharpness, subset_rows
from quiltcli.formats.usd.places import Moment
from quiltcli.formats.usd.primvars import read_normals
from quiltcli.formats.usd.skins import skinned
from quiltcli.formats.usd.stage import Stage, library, open_stage, path_of, understood
from quiltcli.formats.usd.walk import Piece, Shown, listed, walk
from quiltcli.geometry import FloatArray
from quiltcli.scene.importers.cuts import (
    MOST_TRIANGLES,
    Form,
    Look,
    Posed,
    at_one_place,
    form_of,
    joined,
    part_of,
    placed_cut,
)
from quiltcli.scene.importers.model import NO_SUBDIVISION, ONLY_CLIP, FileLight, Playing, check_only_clip
from quiltcli.scene.importers.part import Part
from quiltcli.scene.importers.usd_lights import lights_at, lights_lost
from quiltcli.scene.importers.usd_surfaces import lost, surface_of, uv_names

_KEPT = 2


@dataclass(frozen=True, eq=False)
class UsdModel:
    """A stage, ready to be posed at any time.

    Attributes:
        stage: the stage.
        shown: what it shows.
        movement: what of it moves.
        levels: how many times its subdivision surfaces are refined.
    """

    stage: Stage
    shown: Shown
    movement: Movement
    levels: int = 0
    _forms: dict[int, dict[bytes, Form]] = field(default_factory=dict)
    _points: dict[int, Posed] = field(default_factory=dict)

    @property
    def clips(self) -> tuple[str, ...]:
        """The one animation there may be."""
        return () if self.movement.clock is None else (ONLY_CLIP,)

    @property
    def notices(self) -> tuple[str, ...]:
        """What of the stage is not drawn as it means."""
        with understood(self.stage.path):
            return (*self.stage.notices, *self.shown.notices, *self._own_notices())

    def subdivided(self, levels: int) -> UsdModel:
        """The same with its subdivision surfaces refined so many times.

        Raises:
            MeshError: there are none.
        """
        if not self.shown.cages:
            raise MeshError(Problem(NO_SUBDIVISION, str(self.stage.path)))
        return UsdModel(self.stage, self.shown, self.movement, levels)

    def _own_notices(self) -> Iterator[str]:
        if self.shown.cages and not self.levels:
            yield (
                "subdivision surfaces drawn as the polygons of their cages ('subdivision' of the object"
                f" refines them): {listed(self.shown.cages)}"
            )
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
        check_only_clip(str(self.stage.path), playing)

    def contested(self, playing: Playing) -> int:
        """Nothing is moved twice by one animation."""
        return 0

    def form(self, seconds: float | None, playing: Playing | None) -> Hashable:
        """What is equal at two times whose parts have the same triangles."""
        with understood(self.stage.path):
            if not self.movement.forms:
                return None
            moment = self._moment(seconds, playing)
            everything = self._all_hidden(moment)
            return tuple(
                (
                    self._form(number, moment).faces.key,
                    *(
                        moment.count(place) if everything or moment.shown(place) else 0
                        for place in self.shown.pieces[number].places
                    ),
                )
                for number in sorted(self.movement.forms)
            )

    def hidden(self, seconds: float, playing: Playing) -> bool:
        """Whether nothing is to be seen at a time."""
        with understood(self.stage.path):
            return bool(self.movement.forms) and self._all_hidden(self._moment(seconds, playing))

    def parts(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[Part, ...]:
        """A part for each mesh and material, all its copies in it; at rest as the animation begins.

        Raises:
            MeshError: a mesh is broken, or there are too many triangles.
        """
        with understood(self.stage.path):
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
        with understood(self.stage.path):
            moment = self._moment(seconds, playing)
            everything = self._all_hidden(moment)
            placed = []
            for number, piece in enumerate(self.shown.pieces):
                places, posed = self._places(moment, piece, everything), self._posed(number, moment)
                form = self._form(number, moment)
                placed += [placed_cut(form, cut, posed, places) for cut in form.cuts]
            vertices, normals = joined(placed)
            return at_one_place(vertices) if everything else vertices, normals

    def lights(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[FileLight, ...]:
        """The stage's lights at a time."""
        with understood(self.stage.path):
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
        with np.errstate(over="ignore", invalid="ignore"):  # bake drops what is nowhere
            return np.asarray(self.stage.world @ np.concatenate([np.empty((0, 4, 4)), *found]))

    def _check_size(self, moment: Moment, everything: bool) -> None:
        """Count before anything is copied: a small file can ask for very much."""
        total = 0
        for number, piece in enumerate(self.shown.pieces):
            total += self._form(number, moment).triangles * len(self._places(moment, piece, everything))
            if total > MOST_TRIANGLES:
                words = f"and all before it show {total:,} triangles (expected at most {MOST_TRIANGLES:,})"
                raise self.stage.error(piece.prim, words)

    def _form(self, number: int, moment: Moment) -> Form:
        """A mesh's triangles at a time; the last ones are kept."""
        kept = self._forms.setdefault(number, {})
        if kept and number not in self.movement.faces:
            return next(iter(kept.values()))
        piece = self.shown.pieces[number]
        faces = read_faces(self.stage, piece.mesh, moment.time)
        if faces.key not in kept:
            kept[faces.key] = self._made(piece, faces, moment.time, moving=number in self.movement.points)
            while len(kept) > _KEPT:
                kept.pop(next(iter(kept)))
        return kept[faces.key]

    def _made(self, piece: Piece, faces: Faces, time: Any, *, moving: bool) -> Form:
        mesh = piece.mesh
        dress = read_dress(self.stage, mesh, faces, piece.asked(uv_names(piece)), time, moving=moving)
        points = read_points(self.stage, mesh, time, faces.corners.vertices)
        rows = subset_rows(self.stage, list(piece.subsets), faces)
        if not self.levels or path_of(piece.prim) not in self.shown.cages:
            return form_of(str(self.stage.path), faces, dress, points, rows)
        if len(faces.corners.vertex) * 4**self.levels > MOST_TRIANGLES:
            words = f"is refined to more than {MOST_TRIANGLES:,} corners (give it less subdivision)"
            raise self.stage.error(piece.prim, words)
        sharp = read_sharpness(self.stage, mesh, time, faces.corners.vertices)
        found = subdivided(faces, dress, *sharp, self.levels)
        refined = np.asarray(found.points @ points)
        form = form_of(str(self.stage.path), found.faces, found.dress, refined, rows[found.owner])
        return replace(form, refining=found.points)

    def _posed(self, number: int, moment: Moment) -> Posed:
        """A mesh at a time; those that rest are kept."""
        if number in self._points:
            return self._points[number]
        piece, form = self.shown.pieces[number], self._form(number, moment)
        points = read_points(self.stage, piece.mesh, moment.time, form.vertices)
        if form.refining is not None:
            return self._smooth(number, moment, form, points)
        normals = read_normals(self.stage, piece.mesh, form.faces.corners, moment.time)
        directions = None if normals is None else normals.at_corners
        if piece.skin is not None:
            points = skinned(piece.prim, piece.skin, moment, points)
            if normals is not None:
                # Smooth where the mesh's own are one, and sharp where they differ.
                directions = normals_of_groups(points, form.faces, same_normals(form.faces, normals))
        posed = Posed(points, directions)
        if number not in self.movement.points:
            self._points[number] = posed
        return posed

    def _smooth(self, number: int, moment: Moment, form: Form, points: FloatArray) -> Posed:
        """A subdivision surface at a time; its normals are found from its faces."""
        piece = self.shown.pieces[number]
        assert form.refining is not None
        if piece.skin is not None:
            points = skinned(piece.prim, piece.skin, moment, points)
        posed = Posed(np.asarray(form.refining @ points), None)
        if number not in self.movement.points:
            self._points[number] = posed
        return posed

    def _parts(self, piece: Piece, form: Form, posed: Posed, places: FloatArray) -> Iterator[Part]:
        """The parts of a mesh, one for each material."""
        double = bool(piece.mesh.GetDoubleSidedAttr().Get())
        color, opacity = form.dress.color, form.dress.opacity
        faint = opacity is not None and bool((opacity.values < 1).any())
        for cut in form.cuts:
            material = piece.materials[cut.row]
            surface = surface_of(
                material, uv_names(piece), colored=color is not None, faint=faint, double_sided=double
            )
            look = Look(surface)
            if material is not None:
                look = Look(surface, material.name, bool(material.color), bool(material.opacity))
            yield part_of(form, cut, posed, places, look)


def read_usd_model(path: Path) -> UsdModel:
    """Open a stage and look at all that it shows.

    Raises:
        MissingExtraError: the package of the extra `usd` is not installed.
        MeshError: the stage is wrong.
    """
    stage = open_stage(path)
    with understood(path):
        time = library().Usd.TimeCode
        shown = walk(stage, time.EarliestTime() if stage.range is None else time(stage.range[0]))
        return UsdModel(stage, shown, movement(stage, shown))
