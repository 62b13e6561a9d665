"""A projector from marks on a spinning mirror and the pixels that light them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from quiltcli.errors import DisplayError
from quiltcli.geometry import FloatArray
from quiltcli.geometry.resection import DETERMINED, Pinhole, Refined, decomposed, dlt, lie_in_plane, refine
from quiltcli.job.calibration import CalibrationFile, ClickSpec


@dataclass(frozen=True)
class Calibration:
    """A calibrated projector.

    Attributes:
        projector: the pinhole that fits best.
        direct: (3, 4) matrix of the direct linear transformation, before distances were made least.
        points: (N, 3) world metres.
        errors: (N, 2) by how much points are lit elsewhere than they were seen, pixels.
        deviation: as `quiltcli.geometry.resection.Refined`.
    """

    projector: Pinhole
    direct: FloatArray
    points: FloatArray
    errors: FloatArray
    deviation: FloatArray

    @property
    def distances(self) -> FloatArray:
        """(N,) how far points are off, pixels."""
        return np.hypot(self.errors[:, 0], self.errors[:, 1])

    @property
    def rms(self) -> float:
        """Root mean square of the distances, pixels."""
        return float(np.sqrt(np.mean(self.distances**2)))


def world_point(click: ClickSpec, tilt_deg: float, ridge: float) -> FloatArray:
    """Place of a mark in the world (3,).

    The mirror at the angle θ faces e = (cos θ, 0, sin θ); seen from there, f = (sin θ, 0, −cos θ) is to the
    right, and up the slope of a mirror whose normal is sin τ·e + cos τ·y is sin τ·y − cos τ·e.
    """
    if click.world is not None:
        return np.array(click.world, dtype=np.float64)
    assert click.mirror_deg is not None
    assert click.at is not None
    theta, tau = math.radians(click.mirror_deg), math.radians(tilt_deg)
    e = np.array([math.cos(theta), 0, math.sin(theta)])
    right = np.array([math.sin(theta), 0, -math.cos(theta)])
    up = np.array([0, math.sin(tau), 0]) - math.cos(tau) * e
    return np.array([0, ridge, 0]) + click.at[0] * right + click.at[1] * up


def calibrate(file: CalibrationFile) -> Calibration:
    """The projector that lights the marks of a file.

    Raises:
        DisplayError: the points lie in a plane, or do not determine a projector for another reason.
    """
    points = np.stack([world_point(click, file.tilt_deg, file.ridge) for click in file.points])
    pixels = np.array([click.pixel for click in file.points], dtype=np.float64)
    if lie_in_plane(points):
        words = "all lie in one plane, which leaves the projector open (turn the mirror for some of them)"
        raise DisplayError(file.source.problem("points", words))
    direct, determined = dlt(points, pixels)
    if determined < DETERMINED:
        words = "leave the projector open: several fit (add points elsewhere on the mirror)"
        raise DisplayError(file.source.problem("points", words))
    found = _fitted(file, direct, points, pixels)
    if not np.isfinite(found.errors).all() or found.pinhole.focal <= 0:
        words = "fit no projector (is a mirror angle or a place mistaken?)"
        raise DisplayError(file.source.problem("points", words))
    return Calibration(found.pinhole, direct, points, found.errors, found.deviation)


def _fitted(file: CalibrationFile, direct: FloatArray, points: FloatArray, pixels: FloatArray) -> Refined:
    free = np.array([name in file.free for name in ("f", "centre", "centre")] + [True] * 6)
    start = decomposed(direct)[1]
    focal = start.focal if file.f is None else file.f
    centre = start.centre
    if "centre" not in file.free:
        centre = np.array(file.centre or (file.image[0] / 2, file.image[1] / 2), dtype=np.float64)
    start = Pinhole(float(focal), centre, start.rotation, start.position, start.mirrored)
    # With what is fixed in its place, first the rest, then all that is free.
    some = refine(start, points, pixels, np.array([False] * 3 + [True] * 6))
    return refine(some.pinhole, points, pixels, free)
