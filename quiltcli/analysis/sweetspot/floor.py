"""A floor of places to stand, and the part of it where a figure stays under a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.sweetspot.distortion import MEASURES, Show, distortion
from quiltcli.analysis.sweetspot.samples import middle
from quiltcli.errors import JobError
from quiltcli.geometry import BoolArray, FloatArray, normalized

Area = tuple[float, float, float, float]
MOST_PLACES = 250_000
DIRECTIONS = ("left", "right", "forward", "back")
_HALVINGS = 30


@dataclass(frozen=True)
class Floor:
    """A grid of places for eyes.

    Attributes:
        x: (nx,) metres, ascending.
        z: (nz,) metres, ascending.
        height: y of the eyes, metres.
    """

    x: FloatArray
    z: FloatArray
    height: float

    @property
    def places(self) -> FloatArray:
        """Eyes (nz·nx, 3), row by row of equal z."""
        z, x = np.meshgrid(self.z, self.x, indexing="ij")
        return np.stack((x, np.full_like(x, self.height), z), axis=-1).reshape(-1, 3)

    @property
    def area(self) -> Area:
        """Least x and z, greatest x and z."""
        return float(self.x[0]), float(self.z[0]), float(self.x[-1]), float(self.z[-1])


@dataclass(frozen=True)
class Reach:
    """How much room there is under the limit.

    Attributes:
        area: square metres of the map.
        metres: how far one may go from the eye to the left, right, forward and back.
        open: directions in which the limit was not met as far as the map's farthest corner.
    """

    area: float
    metres: dict[str, float]
    open: tuple[str, ...]


def floor_of(area: Area, step: float, height: float) -> Floor:
    """A grid over an area (x0, z0, x1, z1), its steps `step` metres or a little less.

    Raises:
        JobError: the area has no extent, or too many places.
    """
    x0, z0, x1, z1 = area
    if not (x0 < x1 and z0 < z1):
        text = ",".join(f"{side:g}" for side in area)
        raise JobError(f"--area {text} has no extent, expected x0,z0,x1,z1 with x0 < x1 and z0 < z1")
    counts = [math.ceil((side - 1e-9 * step) / step) + 1 for side in (x1 - x0, z1 - z0)]
    if counts[0] * counts[1] > MOST_PLACES:
        raise JobError(
            f"a step of {step:g} m makes {counts[0] * counts[1]:,} places, more than {MOST_PLACES:,}"
            " (a larger --step or a smaller --area makes fewer)"
        )
    return Floor(np.linspace(x0, x1, counts[0]), np.linspace(z0, z1, counts[1]), height)


def default_step(size: float) -> float:
    """1, 2 or 5 times a power of ten: a fifteenth of a size in metres, or down to half of that."""
    most = size / 15 * (1 + 1e-9)
    power = 10.0 ** math.floor(math.log10(most))
    return max(digit * power for digit in (1, 2, 5) if digit * power <= most)


def area_about(eye: FloatArray, size: float, step: float) -> Area:
    """A square about the eye, whole steps and at least `size` metres to every side."""
    reach = math.ceil(size / step - 1e-9) * step
    x, z = float(eye[0]), float(eye[2])
    return x - reach, z - reach, x + reach, z + reach


def cells(floor: Floor, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The map as triangles, four a cell, about its middle: corners (T, 3, 2) in x, z and values (T, 3).

    Triangles that touch a place without a value (nan) are left out.
    """
    grid = np.stack(np.meshgrid(floor.x, floor.z), axis=-1)
    known = np.concatenate((grid, values[..., None]), axis=-1)
    around = [known[:-1, :-1], known[:-1, 1:], known[1:, 1:], known[1:, :-1]]
    centre = sum(around) / 4
    triangles = np.concatenate(
        [np.stack((around[k], around[(k + 1) % 4], centre), axis=2).reshape(-1, 3, 3) for k in range(4)]
    )
    triangles = triangles[np.isfinite(triangles[:, :, 2]).all(axis=1)]
    order = np.argsort(triangles[:, :, 2], axis=1, kind="stable")[..., None]
    triangles = np.take_along_axis(triangles, order, axis=1)
    return triangles[:, :, :2], triangles[:, :, 2]


def area_under(floor: Floor, values: FloatArray, limit: float) -> float:
    """Square metres where values (nz, nx), linear in triangles between places, do not exceed a limit."""
    corners, value = cells(floor, values)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    whole = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    low, mid, high = value.T
    ones = np.ones_like(low)
    rising = (limit > low) & (limit <= mid)
    falling = (limit > mid) & (limit < high)
    below = np.divide((limit - low) ** 2, (mid - low) * (high - low), out=0 * ones, where=rising)
    above = np.divide((high - limit) ** 2, (high - low) * (high - mid), out=0 * ones, where=falling)
    share = np.where(limit >= high, 1.0, np.where(falling, 1 - above, below))
    return float((whole * share).sum())


def contour(floor: Floor, values: FloatArray, limit: float) -> FloatArray:
    """Segments (n, 2, 2) in x, z along which values (nz, nx) are `limit`."""
    corners, value = cells(floor, values)
    crossed = (value[:, 0] < limit) & (limit < value[:, 2])
    corners, (low, mid, high) = corners[crossed], value[crossed].T
    lower = limit < mid
    start = np.where(lower, low, mid)
    stop = np.where(lower, mid, high)
    first = np.where(lower[:, None], corners[:, 0], corners[:, 1])
    second = np.where(lower[:, None], corners[:, 1], corners[:, 2])
    long = ((limit - low) / (high - low))[:, None]
    short = np.divide(limit - start, stop - start, out=np.zeros_like(low), where=stop > start)[:, None]
    ends = corners[:, 0] + long * (corners[:, 2] - corners[:, 0]), first + short * (second - first)
    return np.stack(ends, axis=1)


def directions(shown: Show) -> FloatArray:
    """Unit steps (4, 3) to the left, right, forward and back; forward is where the shown facets are."""
    samples = shown.samples
    kept = np.where(shown.shown, samples.area, 0)
    centre = middle(samples) if not kept.any() else (samples.point * kept[:, None]).sum(axis=0) / kept.sum()
    ahead = (centre - shown.eye) * (1, 0, 1)
    if np.linalg.norm(ahead) < 1e-6 * np.linalg.norm(np.ptp(samples.point, axis=0)):
        ahead = np.array([0.0, 0, -1])
    ahead = normalized(ahead)
    left = np.array([ahead[2], 0, -ahead[0]])
    return np.stack((left, -left, ahead, -ahead))


def reaches(shown: Show, floor: Floor, limit: float) -> dict[str, tuple[dict[str, float], tuple[str, ...]]]:
    """By measure, how far one may go from the eye to each side, and the sides without an end.

    The first step over the limit along a line is found on the map's grid, then halved to where it is.
    """
    step = min(float(np.diff(floor.x).min()), float(np.diff(floor.z).min()))
    x0, z0, x1, z1 = floor.area
    far = max(math.hypot(x - shown.eye[0], z - shown.eye[2]) for x in (x0, x1) for z in (z0, z1))
    marks = np.minimum(np.arange(math.ceil(far / step) + 1) * step, far)
    ways = directions(shown)
    start = np.array([shown.eye[0], floor.height, shown.eye[2]])

    def over(metres: FloatArray) -> BoolArray:
        """Whether limits are exceeded (3, 4, n), at distances (4, n) from the eye."""
        places = start + metres[..., None] * ways[:, None]
        figures = distortion(shown, places.reshape(-1, 3))
        values = np.stack([getattr(figures, name) for name in MEASURES]).reshape(-1, *metres.shape)
        within: BoolArray = values <= limit
        return ~within

    out = over(np.tile(marks, (4, 1)))
    first = np.where(out.any(axis=2), out.argmax(axis=2), len(marks) - 1)  # (3, 4)
    high, low = marks[first], marks[np.maximum(first - 1, 0)]
    for _ in range(_HALVINGS):
        half = (low + high) / 2
        beyond = over(half.T)[np.arange(3), :, np.arange(3)]
        low, high = np.where(beyond, low, half), np.where(beyond, half, high)
    open_ways = np.logical_not(out.any(axis=2))
    low = np.where(open_ways, far, np.where(first == 0, 0, low))
    return {
        name: (
            dict(zip(DIRECTIONS, row.tolist(), strict=True)),
            tuple(side for side, free in zip(DIRECTIONS, ends.tolist(), strict=True) if free),
        )
        for name, row, ends in zip(MEASURES, low, open_ways, strict=True)
    }
