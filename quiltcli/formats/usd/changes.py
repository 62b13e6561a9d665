"""What of a stage changes over time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from quiltcli.formats.clock import Clock
from quiltcli.formats.usd.places import Instancer, Place
from quiltcli.formats.usd.stage import Stage, library, path_of
from quiltcli.formats.usd.walk import Piece, Shown


@dataclass
class Changes:
    """What of a stage changes, found by asking each prim once.

    Attributes:
        stage: the stage.
        times: time codes of samples, where the stage names no range.
    """

    stage: Stage
    times: set[float] = field(default_factory=set)
    _known: dict[str, tuple[bool, bool]] = field(default_factory=dict)

    def points(self, piece: Piece) -> bool:
        """Whether a mesh's points or normals change, or its faces."""
        mesh = piece.mesh
        normals = library().UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
        given = [mesh.GetPointsAttr(), mesh.GetNormalsAttr()]
        found = self._any([*given, normals.GetAttr()] if normals else given)
        if piece.skin is not None and piece.skin.moves:
            self.times.update(piece.skin.times())
            found = True
        return found or self.faces(piece)

    def faces(self, piece: Piece) -> bool:
        """Whether a mesh's faces change."""
        mesh = piece.mesh
        return self._any(
            [mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr(), mesh.GetHoleIndicesAttr()]
        )

    def place(self, place: Place) -> tuple[bool, bool]:
        """Whether a prim moves, and whether it comes and goes, with all that is above it or shows it."""
        moves, blinks = self._prim(place.prim)
        if place.within is not None:
            more, others = self._instancer(place.within), self.place(place.within.place)
            moves, blinks = moves or any(more) or others[0], blinks or more[1] or others[1]
        return moves, blinks

    def dress(self, piece: Piece) -> bool:
        """Whether its colours or texture coordinates change."""
        found = library().UsdGeom.PrimvarsAPI(piece.mesh).GetPrimvars()
        return any(one.ValueMightBeTimeVarying() for one in found if one.GetPrimvarName() != "normals")

    def light(self, prim: Any) -> bool:
        """Whether a light moves or changes."""
        inputs = [one for one in prim.GetAttributes() if one.GetName().startswith("inputs:")]
        return self._any(inputs) or any(self._prim(prim))

    def _prim(self, prim: Any) -> tuple[bool, bool]:
        """Whether it moves, and whether it comes and goes, by itself or with what is above it."""
        if not prim or prim.IsPseudoRoot():
            return False, False
        key = path_of(prim)
        if key not in self._known:
            geom = library().UsdGeom
            moves = blinks = False
            if prim.IsA(geom.Xformable):
                xformable = geom.Xformable(prim)
                moves = xformable.TransformMightBeTimeVarying()
                if moves:
                    self.times.update(xformable.GetTimeSamples())
            if prim.IsA(geom.Imageable):
                blinks = self._any([geom.Imageable(prim).GetVisibilityAttr()])
            above = self._prim(prim.GetParent())
            self._known[key] = moves or above[0], blinks or above[1]
        return self._known[key]

    def _instancer(self, within: Instancer) -> tuple[bool, bool]:
        """Whether instances move, and whether they become others."""
        one = library().UsdGeom.PointInstancer(within.prim)
        moving = [one.GetPositionsAttr(), one.GetOrientationsAttr(), one.GetOrientationsfAttr()]
        moves = self._any([*moving, one.GetScalesAttr(), one.GetVelocitiesAttr()])
        changing = [one.GetProtoIndicesAttr(), one.GetInvisibleIdsAttr(), one.GetIdsAttr()]
        return moves, self._any(changing)

    def _any(self, attributes: Iterable[Any]) -> bool:
        found = [one for one in attributes if one and one.ValueMightBeTimeVarying()]
        if self.stage.range is None:
            for one in found:
                self.times.update(one.GetTimeSamples())
        return bool(found)


@dataclass(frozen=True, eq=False)
class Movement:
    """What of a stage moves, by the number of its piece.

    Attributes:
        clock: when; None where nothing does.
        points: pieces whose points change.
        faces: pieces whose faces change.
        forms: these, and pieces the number of whose copies changes.
        dresses: pieces whose colours or texture coordinates do.
    """

    clock: Clock | None
    points: frozenset[int]
    faces: frozenset[int]
    forms: frozenset[int]
    dresses: frozenset[int]


def movement(stage: Stage, shown: Shown) -> Movement:
    """Find out what moves."""
    changes = Changes(stage)
    points, faces, forms, dresses = set(), set(), set(), set()
    anything = False
    for number, piece in enumerate(shown.pieces):
        if changes.points(piece):
            points.add(number)
        found = [changes.place(place) for place in piece.places]
        anything = anything or any(moves for moves, _ in found)
        if changes.faces(piece):
            faces.add(number)
        if number in faces or any(blinks for _, blinks in found):
            forms.add(number)
        if changes.dress(piece):
            dresses.add(number)
    lit = [changes.light(prim) for prim in shown.lights]
    clock = None
    if anything or points or forms or any(lit):
        times = changes.times or {0.0}
        first, last = (min(times), max(times)) if stage.range is None else stage.range
        clock = Clock(first, last, stage.rate)
    return Movement(clock, frozenset(points), frozenset(faces), frozenset(forms), frozenset(dresses))
