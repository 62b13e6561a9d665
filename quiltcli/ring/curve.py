"""The viewers all around: how far away and how high they are, by azimuth.

Azimuth A is the direction (cos A, 0, sin A) from the axis, the world's Y. Untracked viewers stand on a
circle; a tracked one bends it near their azimuth, smoothly, so that it stays a curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray


@dataclass(frozen=True)
class User:
    """Somebody whose head is tracked.

    Attributes:
        azimuth: radians.
        height: of the eyes, metres.
        distance: from the axis, metres.
        hold: radians to either side that are served from exactly there.
        blend: radians beyond those over which the curve goes back to what it is without them.
    """

    azimuth: float
    height: float
    distance: float
    hold: float
    blend: float


@dataclass(frozen=True)
class Curve:
    """Where viewers are taken to be: V(A) = (d(A) cos A, h(A), d(A) sin A).

    Attributes:
        height: h where nobody is tracked, metres.
        distance: d there, metres.
        users: who is tracked; what their azimuths hold apart must not meet.
    """

    height: float
    distance: float
    users: tuple[User, ...] = ()

    @property
    def is_circle(self) -> bool:
        """Whether distance and height are the same all around."""
        return not self.users

    def at(self, azimuth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance and height at azimuths."""
        return self.at_and_slopes(azimuth)[:2]

    def slopes(self, azimuth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of distance and height by azimuth, metres a radian."""
        return self.at_and_slopes(azimuth)[2:]

    def at_and_slopes(self, azimuth: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Distance, height, and the derivatives of both: `at` and `slopes` in one go."""
        distance = np.full(np.shape(azimuth), float(self.distance))
        height = np.full(np.shape(azimuth), float(self.height))
        along, up = np.zeros(np.shape(azimuth)), np.zeros(np.shape(azimuth))
        for user in self.users:
            share, slope = _share(user, azimuth)
            nearer, higher = user.distance - self.distance, user.height - self.height
            distance += share * nearer
            height += share * higher
            along += slope * nearer
            up += slope * higher
        return distance, height, along, up

    def points(self, azimuth: FloatArray) -> FloatArray:
        """V (..., 3) at azimuths, world metres."""
        distance, height = self.at(azimuth)
        return np.stack((distance * np.cos(azimuth), height, distance * np.sin(azimuth)), axis=-1)

    def too_steep(self, reach: float) -> bool:
        """Whether a vertical plane that passes the axis at up to `reach` metres may meet the curve twice.

        It meets it once while |d′| < d √(d² − q²) / |q| for all distances q up to `reach`.
        """
        if self.is_circle:
            return False
        azimuth = np.linspace(-np.pi, np.pi, 14401)
        distance, (slope, _) = self.at(azimuth)[0], self.slopes(azimuth)
        room = distance * np.sqrt(np.maximum(distance**2 - reach**2, 0)) / reach
        return bool((np.abs(slope) >= room).any())


def overlapping(users: Sequence[User]) -> tuple[int, int] | None:
    """The first two users whose azimuths overlap though they stand at different places; None for none."""
    for i, one in enumerate(users):
        for j in range(i):
            other = users[j]
            apart = abs(float(wrapped(np.float64(one.azimuth - other.azimuth))))
            differ = (one.height, one.distance) != (other.height, other.distance)
            # Where one's transition reached into what the other holds, the sum would serve neither.
            held = max(one.hold + other.hold + max(one.blend, other.blend), 0.0)
            if differ and apart < held:
                return j, i
    return None


def wrapped(angle: FloatArray | np.float64) -> FloatArray:
    """Angles brought to −π … π."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def _share(user: User, azimuth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How much of a user is at azimuths, 1 within `hold` and 0 past `blend`, and the derivative of that.

    In between it is the quintic whose first two derivatives are 0 at both ends.
    """
    offset = wrapped(azimuth - user.azimuth)
    t = np.clip((np.abs(offset) - user.hold) / user.blend, 0.0, 1.0)
    share = 1 - t * t * t * (10 + t * (6 * t - 15))
    slope = -30 * t * t * (1 - t) * (1 - t) / user.blend * np.sign(offset)
    return share, slope
