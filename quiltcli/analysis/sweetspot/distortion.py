"""How far beside their right places a person elsewhere than the eye sees things, in degrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.sweetspot.content import Content, nearness
from quiltcli.analysis.sweetspot.samples import Samples, heights
from quiltcli.geometry import BoolArray, FloatArray

MEASURES = {"mean": "mean", "p95": "95 %", "worst": "worst"}
"""Names of the figures in data, and what people are told."""

_BLOCK = 1 << 17  # angles at a time: they stay in the cache
_EDGE_ON = 1e-9  # metres off a facet's plane that show nothing of it


@dataclass(frozen=True)
class Show:
    """What an eye is shown.

    Attributes:
        eye: (3,) the eye the content is drawn for.
        samples: points on the facets.
        nearness: (S,) of the content.
        shown: (S,) points that show the eye some content.
    """

    eye: FloatArray
    samples: Samples
    nearness: FloatArray
    shown: BoolArray


@dataclass(frozen=True)
class Figures:
    """Distortion at P places, degrees; nan where no facet that shows something is seen.

    Attributes:
        mean: (P,) mean over what is seen, every part of it weighted by its solid angle.
        p95: (P,) what 95 % of the solid angle does not exceed.
        worst: (P,) the greatest of all samples.
        dark: (P,) share of the facets' solid angle that shows nothing; nan where no facet is seen.
    """

    mean: FloatArray
    p95: FloatArray
    worst: FloatArray
    dark: FloatArray


def lit_points(samples: Samples, eye: FloatArray) -> BoolArray:
    """Which samples (S,) lie on facets that are lit towards an eye (3,)."""
    result: BoolArray = heights(samples, eye) > _EDGE_ON
    return result


def show(samples: Samples, content: Content, eye: FloatArray) -> Show:
    """What is shown to an eye (3,) on the facets that are lit towards it."""
    near = nearness(content, samples, eye)
    shown = lit_points(samples, eye) & np.isfinite(near)
    return Show(eye, samples, np.where(shown, near, 1.0), shown)


def angles_deg(point: FloatArray, near: FloatArray, eye: FloatArray, place: FloatArray) -> FloatArray:
    """Angles between where a place sees facet points and where it ought to see their content.

    With a = X − V, e = E − V and nearness w, content lies from V in the direction a + (w − 1)e, so the
    angle is atan2(|w − 1| |a × e|, a·a + (w − 1) a·e): nothing is divided, infinitely far content is no
    exception, and angles are zero exactly at the eye and for content on the facets.

    Args:
        point: (3, ...) facet points X.
        near: (...) nearness w of their content.
        eye: (3, ...) the eye E.
        place: (3, ...) places V; all four broadcast.

    Returns:
        (...) degrees, 0 to 180.
    """
    ax, ay, az = point[0] - place[0], point[1] - place[1], point[2] - place[2]
    ex, ey, ez = eye - place
    square = (ay * ez - az * ey) ** 2 + (az * ex - ax * ez) ** 2 + (ax * ey - ay * ex) ** 2
    beyond = near - 1
    along = ax * ax + ay * ay + az * az + beyond * (ax * ex + ay * ey + az * ez)
    result: FloatArray = np.degrees(np.arctan2(np.abs(beyond) * np.sqrt(square), along))
    return result


def solid_angles(samples: Samples, places: FloatArray) -> FloatArray:
    """Solid angles (P, S) of the samples seen from places (P, 3); zero where a facet shows its dark side."""
    x, y, z = (place[:, None] - point for place, point in zip(places.T, samples.point.T, strict=True))
    nx, ny, nz = samples.normal.T
    height = x * nx + y * ny + z * nz
    if np.any(samples.both_sides):
        height = np.where(samples.both_sides, np.abs(height), height)
    square = np.maximum(x * x + y * y + z * z, _EDGE_ON**2)
    result: FloatArray = np.where(height > _EDGE_ON, samples.area * height / (square * np.sqrt(square)), 0)
    return result


def distortion(shown: Show, places: FloatArray, p95: bool = True) -> Figures:
    """The figures at places (P, 3), facets hidden behind others included; without `p95` that one is nan."""
    size = max(1, _BLOCK // len(shown.shown))
    blocks = [_figures(shown, places[at : at + size], p95) for at in range(0, len(places), size)]
    mean, p95s, worst, dark = (np.concatenate(column) for column in zip(*blocks, strict=True))
    return Figures(mean, p95s, worst, dark)


def _figures(shown: Show, places: FloatArray, p95: bool) -> tuple[FloatArray, ...]:
    """Figures of some places."""
    weight = solid_angles(shown.samples, places)
    everything = weight.sum(axis=1)
    weight = weight[:, shown.shown]
    total = weight.sum(axis=1)
    point, near = shown.samples.point[shown.shown].T, shown.nearness[shown.shown]
    angle = angles_deg(point, near, shown.eye[:, None, None], places.T[:, :, None])
    angle = np.where(weight > 0, angle, 0)
    nothing = np.where(total > 0, 0.0, np.nan)
    mean = _over((angle * weight).sum(axis=1), total)
    most = angle.max(axis=1, initial=0) + nothing
    # What is left of sums in another order is no darkness.
    dark = _over(everything - total, everything)
    dark = np.where(dark < 1e-10, np.abs(0 * dark), dark)
    return mean, _quantile(angle, weight, 0.95) + nothing if p95 else nothing + np.nan, most, dark


def _quantile(angle: FloatArray, weight: FloatArray, share: float) -> FloatArray:
    """Least angle (P,) of each row that, with all smaller ones, has this share of the row's weight."""
    if not angle.shape[1]:
        return np.zeros(len(angle))
    order = np.argsort(angle, axis=1)
    below = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    at = (below < share * (1 - 1e-12) * below[:, -1:]).sum(axis=1)[:, None]
    result: FloatArray = np.take_along_axis(angle, np.take_along_axis(order, at, axis=1), axis=1)[:, 0]
    return result


def _over(a: FloatArray, b: FloatArray) -> FloatArray:
    """Quotients, nan where the divisor is nothing."""
    result: FloatArray = np.divide(a, b, out=np.full(len(a), np.nan), where=b > 0)
    return result
