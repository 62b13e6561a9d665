"""The cameras of a light field: rows of them, each around the axis at one height."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import FloatArray, IntArray
from quiltcli.job.lightfield import CameraSpec, LightfieldFile


@dataclass(frozen=True)
class Lens:
    """What all pictures have in common.

    Attributes:
        focal: (2,) focal lengths across and down, pixels.
        centre: (2,) where the axis meets the picture, pixels.
        size: width and height, pixels.
    """

    focal: FloatArray
    centre: FloatArray
    size: tuple[int, int]


@dataclass(frozen=True)
class Row:
    """Cameras at one height, by azimuth.

    Attributes:
        height: metres.
        azimuth: (n,) radians from 0 to 2π, ascending.
        position: (n, 3) world metres.
        rotation: (n, 3, 3) rows to the right, down and ahead.
        view: (n,) which view of the file each is, from 0.
    """

    height: float
    azimuth: FloatArray
    position: FloatArray
    rotation: FloatArray
    view: IntArray

    def around(self, azimuth: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """The cameras on both sides of azimuths (P,), and the share of the second one."""
        count = len(self.azimuth)
        turned = np.mod(azimuth, 2 * np.pi)
        after = np.searchsorted(self.azimuth, turned, side="right")
        before = (after - 1) % count
        after %= count
        gap = np.mod(self.azimuth[after] - self.azimuth[before], 2 * np.pi)
        gap = np.where(gap > 0, gap, 2 * np.pi)
        share = np.mod(turned - self.azimuth[before], 2 * np.pi) / gap
        return before, after, share


@dataclass(frozen=True)
class Cameras:
    """All cameras of a light field.

    Attributes:
        lens: of all of them.
        distance: from the axis, metres.
        rows: from the lowest to the highest.
    """

    lens: Lens
    distance: float
    rows: tuple[Row, ...]

    @cached_property
    def heights(self) -> FloatArray:
        """(R,) heights of the rows, metres."""
        return np.array([row.height for row in self.rows])

    def levels(self, height: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """The rows below and above heights (P,), and the upper one's share; the ends hold beyond them."""
        last = len(self.rows) - 1
        low = np.clip(np.searchsorted(self.heights, height, side="right") - 1, 0, max(last - 1, 0))
        high = np.minimum(low + 1, last)
        gap = self.heights[high] - self.heights[low]
        share = np.clip((height - self.heights[low]) / np.where(gap > 0, gap, 1), 0, 1)
        return low, high, share


def ring_cameras(file: LightfieldFile) -> Cameras:
    """The cameras of a file that says where its ring is."""
    assert file.distance is not None
    azimuth = np.mod(np.array(file.azimuths()), 2 * np.pi)
    order = np.argsort(azimuth, kind="stable")
    rows = [ring_row(file.camera, height, file.distance, azimuth[order], order) for height in file.rows]
    return Cameras(_lens(file.camera), file.distance, tuple(rows))


def ring_row(
    camera: CameraSpec, height: float, distance: float, azimuth: FloatArray, view: Sequence[int] | IntArray
) -> Row:
    """A row of cameras that look at the axis, or at one point."""
    position = np.stack(
        (distance * np.cos(azimuth), np.full_like(azimuth, height), distance * np.sin(azimuth)), axis=-1
    )
    if camera.look_at is not None:
        ahead = np.array(camera.look_at) - position
    else:
        tilt = math.radians(camera.tilt_deg or 0.0)
        level = -position * (math.cos(tilt) / distance)
        ahead = level * [1, 0, 1] + [0, math.sin(tilt), 0]
    return Row(height, azimuth, position, rotations(ahead), np.asarray(view))


def rotations(ahead: FloatArray) -> FloatArray:
    """Rows to the right, down and ahead (n, 3, 3) of cameras that look ahead (n, 3), upright."""
    ahead = ahead / np.linalg.norm(ahead, axis=1)[:, None]
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right, axis=1)[:, None]
    return np.stack((right, np.cross(ahead, right), ahead), axis=1)


def _lens(camera: CameraSpec) -> Lens:
    assert camera.size is not None
    width, height = camera.size
    centre = camera.centre or (width / 2, height / 2)
    return Lens(np.array(camera.focal), np.array(centre), (width, height))
