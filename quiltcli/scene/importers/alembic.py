"""Alembic archives as parts of a scene: meshes cut, placed and posed. They have no materials."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.alembic.archive import Archive, Piece, open_archive
from quiltcli.formats.alembic.samples import (
    changes_faces,
    read_dress,
    read_faces,
    read_normals,
    read_points,
    set_rows,
    shown,
    world,
)
from quiltcli.formats.clock import Clock
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
from quiltcli.scene.materials import Surface

_KEPT = 2


@dataclass(frozen=True, eq=False)
class AlembicModel:
    """An archive, ready to be posed at any time.

    Attributes:
        archive: the archive.
    """

    archive: Archive
    _forms: dict[int, dict[bytes, Form]] = field(default_factory=dict)
    _points: dict[int, Posed] = field(default_factory=dict)

    @property
    def clips(self) -> tuple[str, ...]:
        """The one animation there may be."""
        return () if self.archive.range is None else (ONLY_CLIP,)

    @property
    def notices(self) -> tuple[str, ...]:
        """What of the archive is not drawn as it means."""
        return (*self.archive.notices, *self._flaws())

    def _flaws(self) -> Iterator[str]:
        start = self._time(None, None)
        for number, piece in enumerate(self.archive.pieces):
            yield from (f"{piece.path}: {words}" for words in self._form(number, start).flaws)

    def check(self, playing: Playing) -> None:
        """Raise a `MeshError` unless the animations that are asked for are there."""
        check_only_clip(str(self.archive.path), playing)

    def subdivided(self, levels: int) -> AlembicModel:
        """Nothing: there are no surfaces to refine."""
        raise MeshError(Problem(NO_SUBDIVISION, str(self.archive.path)))

    def contested(self, playing: Playing) -> int:
        """Nothing is moved twice by one animation."""
        return 0

    def form(self, seconds: float | None, playing: Playing | None) -> Hashable:
        """What is equal at two times whose parts have the same triangles."""
        time = self._time(seconds, playing)
        seen = tuple(shown(piece, time) for piece in self.archive.pieces)
        return seen, tuple(
            read_faces(self.archive, piece, time).key if changes_faces(piece) else b""
            for piece in self.archive.pieces
        )

    def hidden(self, seconds: float, playing: Playing) -> bool:
        """Whether nothing is to be seen at a time."""
        return self._all_hidden(self._time(seconds, playing))

    def parts(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[Part, ...]:
        """A part for each mesh and set of faces; at rest as the animation begins.

        Raises:
            MeshError: a mesh is broken, or there are too many triangles.
        """
        time = self._time(seconds, playing)
        everything = seconds is not None and self._all_hidden(time)
        found: list[Part] = []
        total = 0
        for number, piece in enumerate(self.archive.pieces):
            form = self._form(number, time)
            total += form.triangles
            if total > MOST_TRIANGLES:
                words = f"and all before it show {total:,} triangles (expected at most {MOST_TRIANGLES:,})"
                raise self.archive.error(piece, words)
            places, posed = self._places(piece, time, everything), self._posed(number, time)
            found += [part_of(form, cut, posed, places, _look(piece, form, cut.row)) for cut in form.cuts]
        return tuple(found)

    def pose(self, seconds: float, playing: Playing) -> tuple[FloatArray, FloatArray]:
        """Vertices and normals (V, 3) of all parts after one another at a time."""
        time = self._time(seconds, playing)
        everything = self._all_hidden(time)
        placed = []
        for number, piece in enumerate(self.archive.pieces):
            form, posed = self._form(number, time), self._posed(number, time)
            places = self._places(piece, time, everything)
            placed += [placed_cut(form, cut, posed, places) for cut in form.cuts]
        vertices, normals = joined(placed)
        return at_one_place(vertices) if everything else vertices, normals

    def lights(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[FileLight, ...]:
        """None: lights of archives say nothing of how they shine."""
        return ()

    def _time(self, seconds: float | None, playing: Playing | None) -> float:
        """Seconds of the archive; at rest those of its first sample."""
        if self.archive.range is None:
            return 0.0
        first, last = self.archive.range
        return (
            first if seconds is None else Clock(first, last, 1.0).code(seconds, (playing or Playing()).after)
        )

    def _all_hidden(self, time: float) -> bool:
        return not any(shown(piece, time) for piece in self.archive.pieces)

    def _places(self, piece: Piece, time: float, everything: bool) -> FloatArray:
        """Where a mesh is (1, 4, 4), or (0, 4, 4) where it is not seen."""
        seen = everything or shown(piece, time)
        return world(piece, time)[None] if seen else np.empty((0, 4, 4))

    def _form(self, number: int, time: float) -> Form:
        """A mesh's triangles at a time; the last ones are kept."""
        kept = self._forms.setdefault(number, {})
        piece = self.archive.pieces[number]
        if kept and not changes_faces(piece):
            return next(iter(kept.values()))
        faces = read_faces(self.archive, piece, time)
        if faces.key not in kept:
            moving = not piece.schema.isConstant()
            dress = read_dress(self.archive, piece, faces, time, moving=moving)
            points = read_points(self.archive, piece, time, faces.corners.vertices)
            rows = set_rows(self.archive, piece, faces, time)
            kept[faces.key] = form_of(str(self.archive.path), faces, dress, points, rows)
            while len(kept) > _KEPT:
                kept.pop(next(iter(kept)))
        return kept[faces.key]

    def _posed(self, number: int, time: float) -> Posed:
        """A mesh at a time; those that rest are kept."""
        if number in self._points:
            return self._points[number]
        piece, form = self.archive.pieces[number], self._form(number, time)
        points = read_points(self.archive, piece, time, form.faces.corners.vertices)
        normals = read_normals(self.archive, piece, form.faces.corners, time)
        posed = Posed(points, None if normals is None else normals.at_corners)
        if piece.schema.isConstant():
            self._points[number] = posed
        return posed


def _look(piece: Piece, form: Form, row: int) -> Look:
    """What a set of faces looks like: white under colours of its own, else as a file without materials."""
    opacity = form.dress.opacity
    alpha = "blend" if opacity is not None and (opacity.values < 1).any() else "opaque"
    surface = (
        Surface(alpha=alpha) if form.dress.color is None else Surface(color=(1.0, 1.0, 1.0), alpha=alpha)
    )
    return Look(surface, piece.materials[row - 1] if row else "")


def read_alembic_model(path: Path) -> AlembicModel:
    """Open an archive and look at all that it shows.

    Raises:
        MissingExtraError: the package of the extra `alembic` is not installed.
        MeshError: the archive is wrong, or shows no mesh.
    """
    archive = open_archive(path)
    if not archive.pieces:
        left_out = "".join(f"; {notice}" for notice in archive.notices)
        raise MeshError(Problem(f"holds no meshes{left_out}", str(path)))
    return AlembicModel(archive)
