"""Where a direction from the eye lies in a picture: pinhole, equirectangular, fisheye, cube map.

Every lens gives the place of a direction in texels (continuous, the first one's centre at 0.5) and, in closed
form, how that changes along the page: its derivatives by the direction times those of the direction, which is
linear in the page's pixels. Axes are rows right, up, forward, as of a camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray, IntArray, cross

FACES = ("right", "left", "up", "down", "front", "back")
"""Faces of a cube map in the order of OpenGL's +X, −X, +Y, −Y, +Z, −Z, each upright as one inside sees it."""


class Place(NamedTuple):
    """Texels (...) of directions: the picture or face, across, down, and whether the picture shows it."""

    face: IntArray | None
    x: FloatArray
    y: FloatArray
    inside: BoolArray


class Steps(NamedTuple):
    """How far the place moves for a step of the direction, texels (...)."""

    x: FloatArray
    y: FloatArray


class Lens(Protocol):
    """What kind of picture it is; a frozen dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows right, up, forward."""

    @property
    def wraps(self) -> str:
        """What lies beyond its edges: `sphere`, `cube` or nothing."""

    def place(self, d: FloatArray) -> Place:
        """Where directions (3, ...) lie."""

    def steps(self, d: FloatArray, step: FloatArray) -> Steps:
        """How far places of directions (3, ...) move when these change by `step` (3,)."""


WORLD = np.eye(3)
"""Axes of a lens that is given directions along its own axes already; told by identity, not by value."""


def turned(axes: FloatArray, d: FloatArray) -> FloatArray:
    """Directions or steps (3, ...) along axes (3, 3); products are summed in order, for equal results."""
    if axes is WORLD:
        return d
    shaped = axes[:, :, *[None] * (d.ndim - 1)]
    result: FloatArray = shaped[:, 0] * d[0] + shaped[:, 1] * d[1] + shaped[:, 2] * d[2]
    return result


@dataclass(frozen=True)
class Pinhole:
    """A camera's picture.

    Attributes:
        axes: (3, 3) rows right, up, forward.
        window: left, right, bottom, top of the picture on the plane at distance 1.
        size: width and height, texels.
    """

    axes: FloatArray
    window: tuple[float, float, float, float]
    size: tuple[int, int]
    wraps: str = ""

    def place(self, d: FloatArray) -> Place:
        """Where directions lie; behind the camera nowhere."""
        right, up, ahead = turned(self.axes, d)
        left, _, _, top = self.window
        across, down = self._scale
        seen = ahead > 0
        ahead = np.where(seen, ahead, 1.0)
        x, y = (right / ahead - left) * across, (top - up / ahead) * down
        width, height = self.size
        return Place(None, x, y, seen & (x >= 0) & (x <= width) & (y >= 0) & (y <= height))

    def steps(self, d: FloatArray, step: FloatArray) -> Steps:
        """Derivatives of a quotient."""
        right, up, ahead = turned(self.axes, d)
        dr, du, da = turned(self.axes, step)
        across, down = self._scale
        square = np.where(ahead > 0, ahead, np.inf) ** 2
        return Steps((dr * ahead - right * da) / square * across, (up * da - du * ahead) / square * down)

    @property
    def _scale(self) -> tuple[float, float]:
        left, right, bottom, top = self.window
        return self.size[0] / (right - left), self.size[1] / (top - bottom)


@dataclass(frozen=True)
class Equirect:
    """All directions by longitude and latitude; the middle is forward, the top is up."""

    axes: FloatArray
    size: tuple[int, int]
    wraps: str = "sphere"

    def place(self, d: FloatArray) -> Place:
        """Where directions lie."""
        right, up, ahead = turned(self.axes, d)
        width, height = self.size
        x = (np.arctan2(right, ahead) / (2 * np.pi) + 0.5) * width
        y = (0.5 - np.arctan2(up, np.sqrt(right * right + ahead * ahead)) / np.pi) * height
        return Place(None, x, y, np.ones(x.shape, dtype=np.bool_))

    def steps(self, d: FloatArray, step: FloatArray) -> Steps:
        """Derivatives of the two angles."""
        right, up, ahead = turned(self.axes, d)
        dr, du, da = turned(self.axes, step)
        flat2 = np.maximum(right * right + ahead * ahead, 1e-30)
        flat = np.sqrt(flat2)
        width, height = self.size
        turn = (ahead * dr - right * da) / flat2
        rise = (flat * du - up * (right * dr + ahead * da) / flat) / (flat2 + up * up)
        return Steps(turn / (2 * np.pi) * width, -rise / np.pi * height)


@dataclass(frozen=True)
class Fisheye:
    """Equidistant: the distance from the middle is the angle from forward; a dome master.

    Attributes:
        axes: (3, 3) rows right, up, forward; forward is what the middle shows.
        aperture: of the picture's circle, radians.
        size: width and height, texels; the circle touches the shorter sides.
    """

    axes: FloatArray
    aperture: float
    size: tuple[int, int]
    wraps: str = ""

    def place(self, d: FloatArray) -> Place:
        """Where directions lie."""
        right, up, ahead = turned(self.axes, d)
        off = np.sqrt(right * right + up * up)
        angle = np.arctan2(off, ahead)
        scale = self._scale * np.divide(angle, off, out=np.zeros_like(off), where=off > 0)
        width, height = self.size
        return Place(
            None, width / 2 + right * scale, height / 2 - up * scale, angle <= self.aperture / 2 * (1 + 1e-12)
        )

    def steps(self, d: FloatArray, step: FloatArray) -> Steps:
        """Derivatives of an angle times a unit vector."""
        right, up, ahead = turned(self.axes, d)
        dr, du, da = turned(self.axes, step)
        off = np.sqrt(right * right + up * up)
        safe = np.where(off > 1e-12 * np.abs(ahead), off, 1.0)
        angle = np.arctan2(off, ahead)
        doff = (right * dr + up * du) / safe
        dangle = (ahead * doff - off * da) / (off * off + ahead * ahead)
        middle = off <= 1e-12 * np.abs(ahead)
        x = np.where(middle, dr / ahead, (dangle * right + angle * (dr - right * doff / safe)) / safe)
        y = np.where(middle, du / ahead, (dangle * up + angle * (du - up * doff / safe)) / safe)
        return Steps(x * self._scale, -y * self._scale)

    @property
    def _scale(self) -> float:
        return min(self.size) / self.aperture


@dataclass(frozen=True)
class Cube:
    """Six square pictures of 90° around the eye, in the order of `FACES`.

    Attributes:
        axes: (3, 3) rows right, up, forward of the front face.
        side: of a face, texels.
    """

    axes: FloatArray
    side: int
    wraps: str = "cube"

    def place(self, d: FloatArray) -> Place:
        """The face that a direction goes through, and where."""
        right, up, ahead = turned(self.axes, d)
        face = faces_of(right, up, ahead)
        across, down, deep = in_face(face, right, up, ahead)
        half = self.side / 2
        return Place(
            face, (across / deep + 1) * half, (down / deep + 1) * half, np.ones(face.shape, dtype=np.bool_)
        )

    def steps(self, d: FloatArray, step: FloatArray) -> Steps:
        """Derivatives of a quotient, in the face."""
        right, up, ahead = turned(self.axes, d)
        face = faces_of(right, up, ahead)
        across, down, deep = in_face(face, right, up, ahead)
        dr, du, da = (np.broadcast_to(part, face.shape) for part in turned(self.axes, step))
        dx, dy, dz = in_face(face, dr, du, da)
        scale = self.side / 2 / (deep * deep)
        return Steps((dx * deep - across * dz) * scale, (dy * deep - down * dz) * scale)


def faces_of(right: FloatArray, up: FloatArray, ahead: FloatArray) -> IntArray:
    """The face (...) that directions go through."""
    size = np.stack((np.abs(right), np.abs(up), np.abs(ahead)))
    axis = size.argmax(axis=0)
    chosen = np.choose(axis, (right, up, ahead))
    result: IntArray = axis * 2 + (chosen < 0)
    return result


def in_face(
    face: IntArray, right: FloatArray, up: FloatArray, ahead: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Across, down and depth (...) in faces; a face is upright for who turns to it, or looks up or down."""
    across = np.choose(face, (-ahead, ahead, right, right, right, -right))
    down = np.choose(face, (-up, -up, ahead, -ahead, -up, -up))
    deep = np.choose(face, (right, -right, up, -up, ahead, -ahead))
    return across, down, deep


def axes_of(yaw: float, pitch: float) -> FloatArray:
    """Rows right, up, forward of who looks along −Z, turns left by `yaw` and then up by `pitch`, radians."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.array([[cy, 0, -sy], [sy * sp, cp, cy * sp], [-sy * cp, sp, -cy * cp]])


def viewer_axes(look: Sequence[float] | FloatArray, up: Sequence[float] | FloatArray) -> FloatArray:
    """Rows right, up, forward of a viewer."""
    look, up = np.asarray(look, dtype=np.float64), np.asarray(up, dtype=np.float64)
    return np.stack((cross(look, up), up, look))
