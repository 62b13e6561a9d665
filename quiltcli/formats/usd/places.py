"""Where prims are at a time, how often instancers show them, and whether they are seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from quiltcli.formats.usd.stage import Stage, library, path_of
from quiltcli.geometry import BoolArray, FloatArray, IntArray

MOST_COPIES = 2**21


@dataclass(frozen=True, eq=False)
class Instancer:
    """A prototype of a point instancer.

    Attributes:
        prim: the instancer.
        row: of the prototype in its list.
        root: the prototype.
        place: where the instancer is.
    """

    prim: Any
    row: int
    root: Any
    place: Place


@dataclass(frozen=True, eq=False)
class Place:
    """Where a prim is shown.

    Attributes:
        prim: the prim.
        within: the instancer that shows it, None for one that is where it stands.
    """

    prim: Any
    within: Instancer | None = None


@dataclass(eq=False)
class Moment:
    """A stage at a time; what several prims ask for is found once.

    Attributes:
        stage: the stage.
        time: time code of `pxr.Usd`.
    """

    stage: Stage
    time: Any
    _cache: Any = None
    _instances: dict[tuple[str, int], FloatArray] = field(default_factory=dict)
    _seen: dict[str, bool] = field(default_factory=dict)

    @property
    def _xforms(self) -> Any:
        if self._cache is None:
            self._cache = library().UsdGeom.XformCache(self.time)
        return self._cache

    def world(self, prim: Any) -> FloatArray:
        """World from prim (4, 4), in the stage's units and axes."""
        return _columns(self._xforms.GetLocalToWorldTransform(prim))

    def matrices(self, place: Place) -> FloatArray:
        """World from prim (C, 4, 4) of all copies in a place, seen or not.

        Raises:
            MeshError: an instancer's arrays do not fit one another.
        """
        within = place.within
        if within is None:
            return self.world(place.prim)[None]
        # From the prim to its prototype; the instancer's own matrices have the prototype's in them.
        local = np.eye(4)
        if place.prim != within.root:
            local = _columns(self._xforms.ComputeRelativeTransform(place.prim, within.root)[0])
        outer, own = self.matrices(within.place), self.instances(within)
        if len(outer) * len(own) > MOST_COPIES:
            words = f"shows {len(outer) * len(own):,} instances of {within.root.GetName()!r}"
            raise self.stage.error(within.prim, f"{words} (expected at most {MOST_COPIES:,})")
        with np.errstate(over="ignore", invalid="ignore"):
            result: FloatArray = (outer[:, None] @ (own @ local)[None]).reshape(-1, 4, 4)
        return result

    def count(self, place: Place) -> int:
        """How many copies there are in a place, seen or not."""
        within = place.within
        return 1 if within is None else self.count(within.place) * len(self.instances(within))

    def instances(self, within: Instancer) -> FloatArray:
        """Instancer from prototype (I, 4, 4) of the instances of one prototype that are not masked."""
        key = path_of(within.prim), within.row
        if key not in self._instances:
            self._instances.update(self._all_instances(within.prim))
        return self._instances.get(key, np.empty((0, 4, 4)))

    def _all_instances(self, prim: Any) -> dict[tuple[str, int], FloatArray]:
        geom = library().UsdGeom
        instancer = geom.PointInstancer(prim)
        rows = _whole(instancer.GetProtoIndicesAttr().Get(self.time))
        count = len(instancer.GetPrototypesRel().GetForwardedTargets())
        outside = (rows < 0) | (rows >= count)
        if outside.any():
            words = f"names prototype {rows[outside][0]} of {count}"
            raise self.stage.error(instancer.GetProtoIndicesAttr(), words)
        self._check(instancer, rows.size)
        given = instancer.ComputeInstanceTransformsAtTime(
            self.time, self.time, geom.PointInstancer.IncludeProtoXform, geom.PointInstancer.IgnoreMask
        )
        matrices = np.asarray(given, dtype=np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
        if len(matrices) != rows.size:
            words = f"has {rows.size:,} indices for {len(matrices):,} places"
            raise self.stage.error(instancer.GetProtoIndicesAttr(), words)
        mask = instancer.ComputeMaskAtTime(self.time)
        shown: BoolArray = np.ones(rows.size, np.bool_) if not len(mask) else np.asarray(mask, dtype=np.bool_)
        name = path_of(prim)
        return {(name, row): matrices[shown & (rows == row)] for row in range(count)}

    def _check(self, instancer: Any, count: int) -> None:
        """Hold the arrays of an instancer to one length."""
        for attribute, wanted in (
            (instancer.GetPositionsAttr(), True),
            (instancer.GetOrientationsAttr(), False),
            (instancer.GetOrientationsfAttr(), False),
            (instancer.GetScalesAttr(), False),
        ):
            values = attribute.Get(self.time)
            found = 0 if values is None else len(values)
            if found != count and (wanted or found):
                raise self.stage.error(attribute, f"has {found:,} values for {count:,} protoIndices")

    def shown(self, place: Place) -> bool:
        """Whether nothing makes a prim invisible, up to the prototype it is part of, and its instancer."""
        within = place.within
        if within is None:
            return self._visible(place.prim, None)
        return self._visible(place.prim, within.root) and self.shown(within.place)

    def _visible(self, prim: Any, top: Any) -> bool:
        key = f"{prim.GetPath()}|{'' if top is None else top.GetPath()}"
        if key not in self._seen:
            attribute = library().UsdGeom.Imageable(prim).GetVisibilityAttr()
            hidden = bool(attribute) and attribute.Get(self.time) == "invisible"
            above = prim.GetParent()
            ends = prim == top or not above or above.IsPseudoRoot()
            self._seen[key] = not hidden and (ends or self._visible(above, top))
        return self._seen[key]


def _columns(matrix: Any) -> FloatArray:
    """A matrix that acts on columns; USD's act on rows."""
    return np.asarray(matrix, dtype=np.float64).reshape(4, 4).T


def _whole(values: Any) -> IntArray:
    return np.zeros(0, np.int64) if values is None else np.asarray(values, dtype=np.int64).reshape(-1)
