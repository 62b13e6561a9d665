"""Shapes: a point of space, or a direction, for every place (s, t) of a picture.

`s` runs from 0 at the left edge to 1 at the right one, `t` from 0 at the top to 1 at the bottom, and both
a little beyond. All of it is double precision, and what a place gives depends on nothing but the place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray

STEP = 1e-5
"""Of s and t, to the places of which differences are slopes."""


class Shape(Protocol):
    """What a surface or a projection is."""

    @property
    def known(self) -> BoolArray | None:
        """Pixels (H, W) that have a point, where the shape is a map of so many; None for others."""

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """Points or directions (3, ...) at places that broadcast, NaN where there are none."""

    def normal(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """∂X/∂t × ∂X/∂s (3, ...), of any length: towards whoever sees s run right and t down."""


@dataclass(frozen=True, eq=False)
class Smooth:
    """A shape given by a function whose slopes are differences.

    Attributes:
        point: (s, t) → (3, ...).
        steps: how far apart in s and in t the places are of which differences are taken.
        known: (H, W) pixels that have a point, where the shape is a map of so many; None for others.
    """

    point: Callable[[FloatArray, FloatArray], FloatArray]
    steps: tuple[float, float] = (STEP, STEP)
    known: BoolArray | None = None

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.at`."""
        return self.point(s, t)

    def normal(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.normal`."""
        along, down = slopes(self, s, t, self.steps)
        return crossed(down, along)


@dataclass(frozen=True, eq=False)
class Known:
    """A shape whose normals are known too: differences say nothing of them at creases.

    Attributes:
        point: (s, t) → (3, ...).
        upright: (s, t) → (3, ...) as `Shape.normal`.
        known: as of `Smooth`.
    """

    point: Callable[[FloatArray, FloatArray], FloatArray]
    upright: Callable[[FloatArray, FloatArray], FloatArray]
    known: BoolArray | None = None

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.at`."""
        return self.point(s, t)

    def normal(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.normal`."""
        return self.upright(s, t)


@dataclass(frozen=True, eq=False)
class Placed:
    """A shape at its place, perhaps with its columns in the other order.

    Attributes:
        shape: the shape.
        linear: (3, 3) world from the shape's own axes.
        shift: (3,) of its origin, world metres.
        reversed: whether s runs the other way.
    """

    shape: Shape
    linear: FloatArray
    shift: FloatArray
    reversed: bool = False

    @property
    def known(self) -> BoolArray | None:
        """See `Shape.known`."""
        known = self.shape.known
        return known[:, ::-1] if known is not None and self.reversed else known

    @cached_property
    def _upright(self) -> bool:
        """Whether it is not turned, only moved."""
        return bool((self.linear == np.eye(3)).all())

    def at(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.at`."""
        local = self.shape.at(1.0 - s if self.reversed else s, t)
        with np.errstate(all="ignore"):  # formulas may give anything; what is not finite is told by who asks
            if self._upright:
                return np.asarray(local + self.shift.reshape(3, *[1] * (local.ndim - 1)))
            return turned(self.linear, local, self.shift)

    def normal(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """See `Shape.normal`."""
        local = self.shape.normal(1.0 - s if self.reversed else s, t)
        # Normals go with the cofactors of the map of points; the cross product takes its determinant's sign.
        a, b, c = self.linear.T
        cofactors = np.stack((np.cross(b, c), np.cross(c, a), np.cross(a, b)), axis=1)
        with np.errstate(all="ignore"):
            return turned(-cofactors if self.reversed else cofactors, local)


def turned(linear: FloatArray, points: FloatArray, shift: FloatArray | None = None) -> FloatArray:
    """`linear` (3, 3) applied to points (3, ...), and shifted, every sum in a fixed order."""
    result = np.empty(points.shape)
    for k in range(3):
        row = linear[k, 0] * points[0] + linear[k, 1] * points[1] + linear[k, 2] * points[2]
        result[k] = row if shift is None else row + shift[k]
    return result


def slopes(
    shape: Shape, s: FloatArray, t: FloatArray, steps: tuple[float, float] = (STEP, STEP)
) -> tuple[FloatArray, FloatArray]:
    """∂X/∂s and ∂X/∂t (3, ...) by central differences."""
    hs, ht = steps
    along = (shape.at(s + hs, t) - shape.at(s - hs, t)) / (2 * hs)
    return along, (shape.at(s, t + ht) - shape.at(s, t - ht)) / (2 * ht)


def crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products (3, ...) of vectors (3, ...)."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.subtract(a[i] * b[j], a[j] * b[i], out=result[k])
    return result


def stacked(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Three coordinates that broadcast, as (3, ...)."""
    result = np.empty((3, *np.broadcast_shapes(np.shape(x), np.shape(y), np.shape(z))))
    for k, value in enumerate((x, y, z)):
        result[k] = value
    return result


def over(first: float, last: float) -> Callable[[FloatArray], FloatArray]:
    """Angles in radians that run from `first` to `last` degrees while their argument does from 0 to 1."""
    return lambda share: np.radians(first) + share * (np.radians(last) - np.radians(first))
