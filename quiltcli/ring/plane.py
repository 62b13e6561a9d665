"""The mirror as seen from above: places on it, and viewers in vertical planes through P′.

Coordinates are those of `Pose`: frame, from P′.
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.ring.curve import Curve
from quiltcli.ring.rig import Pose

_STEPS = 8
_SPAN = 0.5
_NODES = 4097
_FROM_NODES = 2


def on_mirror(pose: Pose, x: FloatArray, y: FloatArray) -> FloatArray:
    """Points M (3, ...) of the mirror's plane at pixels (...), in the frame from P′."""
    rows = pose.ray_from_pixel
    ray = [row[0] * x + row[1] * y + row[2] for row in rows]
    slope = pose.slope
    t = pose.lift / (slope[0] * ray[0] + slope[2] * ray[2])
    return np.stack([t * part for part in ray])


def through_mirror(pose: Pose, viewer: FloatArray, points: FloatArray) -> FloatArray:
    """Where lines (3, ...) from V′ through points meet the mirror's plane."""
    along = points - viewer
    slope = pose.slope
    share = (pose.lift - slope[0] * viewer[0] - slope[2] * viewer[2]) / (
        slope[0] * along[0] + slope[2] * along[2]
    )
    return np.asarray(viewer + share * along)


def pixels_of(pose: Pose, mirror: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Pixels (...) whose light meets the mirror at points (3, ...)."""
    h = [row[0] * mirror[0] + row[1] * mirror[1] + row[2] * mirror[2] for row in pose.pixel_from_ray]
    return h[0] / h[2], h[1] / h[2]


def viewer_along(pose: Pose, curve: Curve, b: FloatArray, nodes: FloatArray | None = None) -> FloatArray:
    """V′ (3, ...) of vertical planes through P′ of slope b (...): e and f grow as 1 and b.

    The far of the two places where such a plane meets the curve: where the viewers are nearer than the
    projector, P′ is outside their ring and the near one is behind it. On a circle this takes no sine.

    Args:
        pose: the mirror.
        curve: the viewers.
        b: slopes.
        nodes: `nodes_of` the two, where there are many slopes: they save most of the work.
    """
    e0, f0, y0 = pose.origin
    if curve.is_circle:
        square = 1 + b * b
        half = e0 + b * f0
        s = (np.sqrt(half * half - square * (e0 * e0 + f0 * f0 - curve.distance**2)) - half) / square
        return np.stack((s, b * s, np.full(s.shape, curve.height - y0)))
    turn = _turns(pose, curve, b) if nodes is None else _turns_between(pose, curve, b, nodes)
    distance, height = curve.at(pose.angle - turn)
    s = distance * np.cos(turn) - e0
    return np.stack((s, b * s, height - y0))


def nodes_of(pose: Pose, curve: Curve) -> FloatArray | None:
    """Angles of viewers at slopes evenly from −½ to ½, to start from; None on a circle, which needs none.

    They depend on nothing else, so that a ray is the same whichever others are asked for.
    """
    return None if curve.is_circle else _turns(pose, curve, np.linspace(-_SPAN, _SPAN, _NODES))


def _turns_between(pose: Pose, curve: Curve, b: FloatArray, nodes: FloatArray) -> FloatArray:
    """Angles of viewers from the frame's e towards f, for slopes b (...)."""
    place = (b + _SPAN) * ((_NODES - 1) / (2 * _SPAN))
    whole = np.clip(place, 0, _NODES - 2).astype(np.int64)
    before = nodes.take(whole)
    start = before + (place - whole) * (nodes.take(whole + 1) - before)
    turn = _improved(pose, curve, b, start, _FROM_NODES)
    beyond = np.abs(b) > _SPAN
    if beyond.any():
        turn[beyond] = _turns(pose, curve, b[beyond])
    return turn


def _turns(pose: Pose, curve: Curve, b: FloatArray) -> FloatArray:
    """As `_turns_between`, from a circle as large as the ring on."""
    e0, f0, _ = pose.origin
    aside = (f0 - b * e0) / (curve.distance * np.sqrt(1 + b * b))
    return _improved(pose, curve, b, np.arctan(b) + np.arcsin(np.clip(aside, -1, 1)), _STEPS)


def _improved(pose: Pose, curve: Curve, b: FloatArray, turn: FloatArray, steps: int) -> FloatArray:
    """Newton's method for d(A) (sin − b cos) = f₀ − b e₀."""
    e0, f0, _ = pose.origin
    offset = f0 - b * e0
    for _ in range(steps):
        azimuth = pose.angle - turn
        distance, _, slope, _ = curve.at_and_slopes(azimuth)
        c, s = np.cos(turn), np.sin(turn)
        across, beside = s - b * c, c + b * s
        # d(A) falls as the frame's angle grows: A = θ − turn.
        turn = turn - (distance * across - offset) / (distance * beside - slope * across)
    return turn
