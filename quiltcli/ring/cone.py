"""Diffusers as they are: light leaves a bundle of fine cylinders in a cone about their direction.

The cylinders lie across the mirror, along a = f. Light that comes in along i leaves in all directions o
with o·a = i·a (Jones et al., appendix A). Near the horizontal that is the plane of `maps`; for viewers
high above the mirror it is not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.ring.curve import Curve
from quiltcli.ring.plane import through_mirror, viewer_along
from quiltcli.ring.rig import Pose

_STEPS = 6
_ON_CIRCLE = 5
_SECANTS = 24


def viewer_of(pose: Pose, curve: Curve, mirror: FloatArray, nodes: FloatArray | None = None) -> FloatArray:
    """V′ (3, ...) of the pixels that light points M (3, ...) of the mirror, in the frame from P′.

    Newton's method for (V(A) − M)·a = (i·a) |V(A) − M|, from the viewer of the plane on, which may be found
    from `nodes` as `plane.nodes_of` has them.
    """
    share = mirror[1] / np.sqrt(mirror[0] ** 2 + mirror[1] ** 2 + mirror[2] ** 2)
    start = viewer_along(pose, curve, mirror[1] / mirror[0], nodes)
    if curve.is_circle:
        return _on_circle(pose, curve, mirror, share, start)
    turn = _turn(pose, start)
    e0, f0, y0 = pose.origin
    for _ in range(_STEPS):
        azimuth = pose.angle - turn
        distance, height, along, up = curve.at_and_slopes(azimuth)
        c, s = np.cos(turn), np.sin(turn)
        x, y, z = distance * c - e0 - mirror[0], distance * s - f0 - mirror[1], height - y0 - mirror[2]
        length = np.sqrt(x * x + y * y + z * z)
        dx, dy, dz = -distance * s - along * c, distance * c - along * s, -up
        rate = dy - share * (x * dx + y * dy + z * dz) / length
        turn = turn - (y - share * length) / rate
    return _place(pose, curve, turn)


def _on_circle(
    pose: Pose, curve: Curve, mirror: FloatArray, share: FloatArray, start: FloatArray
) -> FloatArray:
    """As `viewer_of`, on a circle: with cosine and sine for the angle, which rational turns keep of length 1.

    A step by δ turns them by 2 atan(δ/2): Newton's method comes to the same end, and takes no sine.
    """
    e0, f0, y0 = pose.origin
    c, s = (start[0] + e0) / curve.distance, (start[1] + f0) / curve.distance
    left, beside, up = e0 + mirror[0], f0 + mirror[1], curve.height - y0 - mirror[2]
    up2 = up * up
    for _ in range(_ON_CIRCLE):
        x, y = curve.distance * c, curve.distance * s
        x -= left
        y -= beside
        length = np.sqrt(x * x + y * y + up2)
        # The half of what is off, over how it changes: d (c − share (y c − x s) / length).
        rate = c - share * (y * c - x * s) / length
        rate *= 2 * curve.distance
        length *= share
        y -= length
        half = np.divide(y, rate, out=y)
        square = half * half
        scale = 1 / (1 + square)
        turned = (1 - square) * scale
        half *= 2 * scale
        c, s = c * turned + s * half, s * turned - c * half
    return np.stack((curve.distance * c - e0, curve.distance * s - f0, np.full(c.shape, curve.height - y0)))


def viewer_through(pose: Pose, curve: Curve, points: FloatArray) -> FloatArray:
    """V′ (3, ...) from which points (3, ...) are seen by way of the mirror; secants, as M moves with V′."""

    def off(turn: FloatArray) -> FloatArray:
        viewer = _place(pose, curve, turn)
        mirror = through_mirror(pose, viewer, points)
        out = viewer - mirror
        share = mirror[1] / np.sqrt((mirror * mirror).sum(axis=0))
        result: FloatArray = out[1] - share * np.sqrt((out * out).sum(axis=0))
        return result

    start = _turn(pose, viewer_along(pose, curve, points[1] / points[0]))
    return _place(pose, curve, _root(off, start))


def _root(function: Callable[[FloatArray], FloatArray], start: FloatArray) -> FloatArray:
    """Where a function of one number each is 0, near `start` (...)."""
    before, now = start, start + 1e-4
    value, here = function(before), function(now)
    for _ in range(_SECANTS):
        rise = here - value
        step = np.divide(here * (now - before), rise, out=np.zeros_like(rise), where=rise != 0)
        before, value, now = now, here, now - step
        here = function(now)
        if not (np.abs(step) > 1e-15).any():
            break
    return now


def _turn(pose: Pose, viewer: FloatArray) -> FloatArray:
    """Angles of places (3, ...) about the axis, from e towards f."""
    return np.asarray(np.arctan2(viewer[1] + pose.origin[1], viewer[0] + pose.origin[0]), dtype=np.float64)


def _place(pose: Pose, curve: Curve, turn: FloatArray) -> FloatArray:
    """Places on the curve (3, ...), in the frame from P′."""
    distance, height = curve.at(pose.angle - turn)
    e0, f0, y0 = pose.origin
    return np.stack((distance * np.cos(turn) - e0, distance * np.sin(turn) - f0, height - y0))
