"""The eye that serves an audience best."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quiltcli.analysis.sweetspot.content import Content
from quiltcli.analysis.sweetspot.distortion import distortion, show
from quiltcli.analysis.sweetspot.floor import Area, Floor
from quiltcli.analysis.sweetspot.samples import Samples
from quiltcli.errors import JobError
from quiltcli.geometry import FloatArray

MINIMISED = ("mean", "worst")
DARK_DEG = 90.0
"""What a facet that an audience sees and the eye does not counts for: it shows nothing."""

_SIDE = 11  # places of an audience to a side
_STARTS = 9  # eyes of the first grid to a side
_DESCENTS = 3  # of its best, from where the search goes on
_FINEST = 1e-4  # the last step, of the audience's longer side


@dataclass(frozen=True)
class Served:
    """What an audience sees of a show.

    Attributes:
        eye: (3,) the eye the content is drawn for.
        mean: degrees, over the audience.
        worst: degrees, of anyone anywhere.
        dark: share of what is seen of the facets that shows nothing.
    """

    eye: FloatArray
    mean: float
    worst: float
    dark: float

    def cost(self, minimise: str) -> float:
        """What is to be small, degrees."""
        value = self.mean if minimise == "mean" else self.worst
        return value + DARK_DEG * self.dark if math.isfinite(value) else math.inf


def audience_floor(area: Area, height: float) -> Floor:
    """Places of an audience.

    Raises:
        JobError: the area has no extent.
    """
    x0, z0, x1, z1 = area
    if not (x0 < x1 and z0 < z1):
        text = ",".join(f"{side:g}" for side in area)
        raise JobError(f"--audience {text} has no extent, expected x0,z0,x1,z1 with x0 < x1 and z0 < z1")
    return Floor(np.linspace(x0, x1, _SIDE), np.linspace(z0, z1, _SIDE), height)


def served(samples: Samples, content: Content, eye: FloatArray, audience: Floor) -> Served:
    """How well an eye (3,) serves an audience; nan where nobody sees anything."""
    figures = distortion(show(samples, content, eye), audience.places, p95=False)
    seen, faced = np.isfinite(figures.mean), np.isfinite(figures.dark)
    mean = float(figures.mean[seen].mean()) if seen.any() else math.nan
    worst = float(figures.worst[seen].max()) if seen.any() else math.nan
    return Served(eye, mean, worst, float(figures.dark[faced].mean()) if faced.any() else math.nan)


def best_eye(samples: Samples, content: Content, audience: Floor, minimise: str) -> Served:
    """The eye in the audience's area, at its height, that makes the mean or the worst distortion smallest.

    A grid over the area, then a pattern search (Hooke and Jeeves' exploratory moves, with
    diagonals) from its three best eyes: no derivatives, which the worst has none of, no chance, and
    eyes that are alike keep the order of the grid, its middle first.

    Raises:
        JobError: nobody in the audience sees a facet that any eye would light.
    """
    x0, z0, x1, z1 = audience.area
    known: dict[tuple[float, float], Served] = {}

    def cost(at: tuple[float, float]) -> float:
        if not (x0 <= at[0] <= x1 and z0 <= at[1] <= z1):
            return math.inf
        if at not in known:
            eye = np.array([at[0], audience.height, at[1]])
            known[at] = served(samples, content, eye, audience)
        return known[at].cost(minimise)

    across, along = (np.linspace(*ends, _STARTS).tolist() for ends in ((x0, x1), (z0, z1)))
    grid = [(x, z) for z in along for x in across]
    middle = ((x0 + x1) / 2, (z0 + z1) / 2)
    grid.sort(key=lambda at: (round(cost(at), 9), round(math.dist(at, middle), 9)))
    if not math.isfinite(cost(grid[0])):
        raise JobError("nobody in the --audience sees a facet that is lit towards one of them")
    longer = max(x1 - x0, z1 - z0)
    found = [_descended(at, cost, longer / _STARTS, longer * _FINEST) for at in grid[:_DESCENTS]]
    return known[min(found, key=lambda at: round(cost(at), 9))]


def _descended(
    at: tuple[float, float], cost: Callable[[tuple[float, float]], float], step: float, finest: float
) -> tuple[float, float]:
    """Where a pattern search ends: no neighbour at the finest step is better."""
    while step > finest:
        around = [(at[0] + x * step, at[1] + z * step) for z in (0, -1, 1) for x in (0, -1, 1) if x or z]
        better = min(around, key=cost)
        if cost(better) < cost(at) - 1e-12:
            at = better
        else:
            step /= 2
    return at
