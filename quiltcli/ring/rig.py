"""Projector and mirror: what stands still, and what it looks like at one angle of the mirror.

The projector's pixel is matrix · (X, 1). At angle θ the mirror serves the side e = (cos θ, 0, sin θ);
with f = (sin θ, 0, −cos θ) and the world's y, (e, f, y) is right-handed. Coordinates in it from the
projector's mirror image P′ are called a, b and y here: along e, along f, upward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import FloatArray


@dataclass(frozen=True)
class Side:
    """One plane of the mirror.

    Attributes:
        azimuth: radians from the side that the first one serves.
        ridge: height of the plane over the axis, metres: 0 for a single mirror through the centre.
        projector: (3, 4) what of the world the projector's pixels show by way of this side, K[R | −RP].
        filter: (3,) linear colour of the light that is returned.
    """

    azimuth: float
    ridge: float
    projector: FloatArray
    filter: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Rig:
    """A projector above a mirror that turns about the world's Y.

    Attributes:
        size: width and height of a picture, pixels.
        sides: the mirror's planes, one, or two of a tent.
        tilt: of each plane from the horizontal, radians.
        disk: diameter of the part that is lit, as seen from above, metres; 0 where `rectangle` says it.
        rectangle: across, and up the slope, metres.
        positions: pictures a turn.
        first: angle of the first, radians.
        step: from a picture to the next, radians, negative where the angle decreases.
        lobe: width of the diffuser's lobe, radians.
        cone: whether light leaves the mirror in cones about its lines, not in planes.
        streams: colours of which each has pictures of one bit of its own; one without a name for all colours.
    """

    size: tuple[int, int]
    sides: tuple[Side, ...]
    tilt: float
    disk: float
    rectangle: tuple[float, float]
    positions: int
    first: float
    step: float
    lobe: float
    cone: bool = False
    streams: tuple[str, ...] = ("",)

    @property
    def radius(self) -> float:
        """How far the mirror reaches from the axis in plan, metres."""
        if self.disk:
            return self.disk / 2
        across, up = self.rectangle
        return math.hypot(across / 2, up * math.cos(self.tilt) / (2 if len(self.sides) == 1 else 1))

    def angle(self, position: int) -> float:
        """The mirror's angle at a position from 0, radians."""
        return self.first + self.step * position

    def at(self, angle: float, side: int = 0) -> Pose:
        """One side of the mirror, turned by an angle in radians."""
        chosen = self.sides[side]
        return Pose(angle + chosen.azimuth, self.tilt, chosen.ridge, chosen.projector, self.cone)


@dataclass(frozen=True)
class Pose:
    """A plane of the mirror at one angle.

    Attributes:
        angle: of the side that is served, radians.
        tilt: radians.
        ridge: height at which the plane meets the axis, metres.
        projector: (3, 4) K[R | −RP].
        cone: whether light leaves the mirror in cones about its lines, not in planes.
    """

    angle: float
    tilt: float
    ridge: float
    projector: FloatArray
    cone: bool = False

    @cached_property
    def axes(self) -> FloatArray:
        """Rows e, f, y (3, 3): frame from world, for directions."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return np.array([[c, 0.0, s], [s, 0.0, -c], [0.0, 1.0, 0.0]])

    @cached_property
    def slope(self) -> FloatArray:
        """The plane's normal (3,) in the frame: sin τ·e + cos τ·y."""
        if abs(self.tilt - math.pi / 4) < 1e-15:  # the same to the last bit in both
            return np.array([math.sqrt(0.5), 0.0, math.sqrt(0.5)])
        return np.array([math.sin(self.tilt), 0.0, math.cos(self.tilt)])

    @cached_property
    def eye(self) -> FloatArray:
        """The projector's centre P (3,), world metres."""
        return np.asarray(-np.linalg.solve(self.projector[:, :3], self.projector[:, 3]), dtype=np.float64)

    @cached_property
    def origin(self) -> FloatArray:
        """P′ (3,), the projector's mirror image: in the frame's axes, from the world's origin."""
        eye = self.axes @ self.eye
        return np.asarray(eye - 2 * ((eye - self._centre) @ self.slope) * self.slope)

    @property
    def _centre(self) -> FloatArray:
        return np.array([0.0, 0.0, self.ridge])

    @cached_property
    def lift(self) -> float:
        """Distance (c − P′)·n of the plane from P′, metres."""
        return float((self._centre - self.origin) @ self.slope)

    @cached_property
    def pixel_from_ray(self) -> FloatArray:
        """Directions from P′ in the frame → homogeneous pixels (3, 3).

        The mirror image of a mirror image is the thing itself: M − P is M − P′ reflected.
        """
        reflect = np.eye(3) - 2 * np.outer(self.slope, self.slope)
        return np.asarray(self.projector[:, :3] @ self.axes.T @ reflect)

    @cached_property
    def ray_from_pixel(self) -> FloatArray:
        """Pixels (x, y, 1) → directions from P′ to M in the frame (3, 3)."""
        return np.asarray(np.linalg.inv(self.pixel_from_ray))

    def from_world(self, points: FloatArray) -> FloatArray:
        """World points (..., 3) in the frame, from P′."""
        return np.asarray(points @ self.axes.T - self.origin)

    def to_world(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) of the frame in the world."""
        return np.asarray((points + self.origin) @ self.axes)


def ideal_projector(size: tuple[int, int], height: float, diameter: float) -> FloatArray:
    """K[R | −RP] (3, 4) of a projector on the axis that looks straight down.

    Args:
        size: width and height of a picture, pixels.
        height: of the projector, metres.
        diameter: what the width covers at the world's origin, metres.
    """
    width, rows = size
    focal = width * height / diameter
    intrinsic = np.array([[focal, 0.0, width / 2], [0.0, focal, rows / 2], [0.0, 0.0, 1.0]])
    down = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return np.asarray(intrinsic @ np.column_stack((down, -down @ [0.0, height, 0.0])))
