"""Which pixels light the mirror: row by row from one column to another, for every outline is convex."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.ring.rig import Pose, Rig


def lit_pixels(rig: Rig, pose: Pose) -> BoolArray:
    """Pixels (H, W) whose centres light the side of the mirror that a pose is of.

    With M − P′ = lift · D / (n·D), and D linear in the pixel, every bound of the mirror is linear or
    quadratic in the column once it is multiplied by (n·D)².
    """
    width, height = rig.size
    y = np.arange(height) + 0.5
    rows = pose.ray_from_pixel
    start = rows[:, 1, None] * y + rows[:, 2, None]  # D = start + x · step
    step = np.repeat(rows[:, :1], height, axis=1)
    sign = np.sign(pose.lift)
    slope = pose.slope
    weight = [sign * (slope[0] * part[0] + slope[2] * part[2]) for part in (start, step)]
    lift = abs(pose.lift)
    place = [
        [lift * part[k] + pose.origin[k] * w for part, w in zip((start, step), weight, strict=True)]
        for k in range(3)
    ]
    low, high = _half(weight[0], weight[1], width=width)
    bounds = []
    if len(rig.sides) > 1:
        bounds.append(place[0])
    if rig.disk:
        bounds_of_disk = _disk(place[0], place[1], weight, rig.disk / 2)
        low, high = np.maximum(low, bounds_of_disk[0]), np.minimum(high, bounds_of_disk[1])
    else:
        across, up = rig.rectangle
        # Up the slope: −cos τ·e + sin τ·y, from where the plane meets the axis.
        rise = [
            slope[0] * (h - pose.ridge * w) - slope[2] * e
            for e, h, w in zip(place[0], place[2], weight, strict=True)
        ]
        lowest = up if len(rig.sides) > 1 else up / 2
        bounds += [
            [across / 2 * w - f for f, w in zip(place[1], weight, strict=True)],
            [across / 2 * w + f for f, w in zip(place[1], weight, strict=True)],
            [lowest * w + r for r, w in zip(rise, weight, strict=True)],
        ]
        if len(rig.sides) == 1:
            bounds.append([up / 2 * w - r for r, w in zip(rise, weight, strict=True)])
    for bound in bounds:
        left, right = _half(bound[0], bound[1], width=width)
        low, high = np.maximum(low, left), np.minimum(high, right)
    x = np.arange(width) + 0.5
    result: BoolArray = (x >= low[:, None]) & (x <= high[:, None])
    return result


def _half(start: FloatArray, step: FloatArray, *, width: int) -> tuple[FloatArray, FloatArray]:
    """Columns (H,) from and to which start + x · step is not negative."""
    far = 2.0 * width
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.clip(-start / step, -far, far)
    low = np.where(step > 0, root, np.where((step == 0) & (start < 0), far, -far))
    high = np.where(step < 0, root, far)
    return low, high


def _disk(
    e: list[FloatArray], f: list[FloatArray], weight: list[FloatArray], radius: float
) -> tuple[FloatArray, FloatArray]:
    """Columns (H,) between which e² + f² is at most (radius · weight)²; the first is larger where none is."""
    square = radius * radius
    a = e[1] * e[1] + f[1] * f[1] - square * weight[1] * weight[1]
    half = e[0] * e[1] + f[0] * f[1] - square * weight[0] * weight[1]
    c = e[0] * e[0] + f[0] * f[0] - square * weight[0] * weight[0]
    within = half * half - a * c
    root = np.sqrt(np.maximum(within, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-half - root) / a, (-half + root) / a
    nothing = ~(within >= 0)
    return np.where(nothing, np.inf, low), np.where(nothing, -np.inf, high)
