"""How pictures of projectors overlap: what share of the light each pixel gives, and how black is lifted.

At a point of the screen each projector that lights it counts by the square of how far the pixel is from the
border of its picture; shares are those counts over their sum. So they add up to 1 wherever a point is lit, go
to 0 at the border of every picture, level there, and have no steps. They are shares of light, not of signals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from quiltcli.charts.chart import Chart
from quiltcli.display.projectors import Projector
from quiltcli.display.response import Blend
from quiltcli.errors import DisplayError, Problem, raise_all
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import BoolArray, FloatArray
from quiltcli.job.display import DisplayFile

_ROWS = 256  # of a picture that are looked at together
_MEETS = 3.0  # pixels that the point of another picture may be away: more is another part of the screen


def blended(spec: DisplayFile, projectors: Sequence[Projector]) -> Blend | None:
    """How the projectors of a display file overlap; None where it does not say.

    Raises:
        DisplayError: a picture of weights cannot be read, or has another size.
    """
    given = spec.projectors or ()
    read = [one.weights is not None for one in given]
    if spec.blend is None:
        if any(read):
            words = "needs blend beside projectors (expected blend: {} at least)"
            raise DisplayError(spec.source.problem(("projectors", read.index(True), "weights"), words))
        return None
    counts = [_counts(one.chart, spec.blend.width) for one in projectors]
    pictures = [_centres(one.chart) for one in projectors]
    finders = [_finder(one) for one in projectors]
    shares, lit = [], []
    for k in range(len(projectors)):
        others = [j for j in range(len(projectors)) if j != k]
        total, times = _added(pictures[k].points, counts, finders, others, pictures)
        mine = counts[k]
        shares.append(np.divide(mine, mine + total, out=np.zeros(mine.shape), where=mine > 0))
        lit.append(np.where(mine > 0, times + 1, 0))
    raise_all(DisplayError, _read_weights(spec, projectors, shares))
    most = max(int(times.max()) for times in lit)
    lift: tuple[FloatArray, ...] = ()
    if spec.blend.black:
        pairs = zip(shares, lit, strict=True)
        lift = tuple(np.where(n > 0, share * (most - n) * spec.blend.black, 0.0) for share, n in pairs)
    return Blend(tuple(shares), lift, spec.blend.black)


@dataclass(frozen=True, eq=False)
class Centres:
    """The centres of a picture's pixels.

    Attributes:
        points: (3, H, W) world metres.
        step: (H, W) square of how far apart they are there.
    """

    points: FloatArray
    step: FloatArray

    def meets(self, points: FloatArray, x: FloatArray, y: FloatArray) -> BoolArray:
        """Whether pixels (P,) are in the picture and light these points (3, P), not others behind."""
        high, wide = self.step.shape
        inside: BoolArray = (x >= 0) & (x <= wide) & (y >= 0) & (y <= high)
        column = np.clip(np.floor(x), 0, wide - 1).astype(np.int64)
        row = np.clip(np.floor(y), 0, high - 1).astype(np.int64)
        off = self.points[:, row, column] - points
        return np.asarray(inside & ((off * off).sum(axis=0) <= _MEETS**2 * self.step[row, column]))


def _centres(chart: Chart) -> Centres:
    wide, high = chart.size
    points = chart.points(np.arange(0.5, wide), np.arange(0.5, high)[:, None])
    step = np.zeros((high, wide))
    for axis in (1, 2):
        apart = (np.diff(points, axis=axis) ** 2).sum(axis=0)
        for side in ((0, 1), (1, 0)):
            pad = [(0, 0), (0, 0)]
            pad[axis - 1] = side
            np.maximum(step, np.pad(apart, pad), out=step)
    return Centres(points, step)


def _counts(chart: Chart, width: float | None) -> FloatArray:
    """How much each pixel (H, W) of a picture counts: its distance to the border squared, up to 1."""
    wide, high = chart.size
    there = np.ones((high, wide), dtype=np.bool_) if chart.mask is None else chart.mask
    # From centre to centre of the nearest pixel that is not there: the border is half a pixel nearer.
    away = ndimage.distance_transform_edt(np.pad(there, 1))[1:-1, 1:-1] - 0.5
    reach = width if width is not None else float(away.max())
    share = np.where(there, np.minimum(away / reach, 1.0), 0.0)
    # Squares end level at the border: no edge is seen where a picture begins to fade.
    return np.asarray(share * share)


Finder = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From points (3, P) to the pixels of a picture, x and y (P,), that light them if any do."""


def _finder(projector: Projector) -> Finder:
    """How pixels are found by their points: by the matrix, or where the map has points near by."""
    matrix, chart = projector.matrix, projector.chart
    if matrix is not None:
        known = matrix

        def by_matrix(points: FloatArray) -> tuple[FloatArray, FloatArray]:
            x, y, depth = known[:, :3] @ points + known[:, 3:]
            ahead = depth > 0
            safe = np.where(ahead, depth, 1.0)
            return np.where(ahead, x / safe, -1.0), np.where(ahead, y / safe, -1.0)

        return by_matrix
    wide, high = chart.size
    centres = chart.points(np.arange(0.5, wide), np.arange(0.5, high)[:, None])
    there = np.ones((high, wide), dtype=np.bool_) if chart.mask is None else chart.mask
    row, column = np.nonzero(there)
    tree = cKDTree(centres[:, row, column].T)

    def by_points(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        near = tree.query(points.T)[1]
        x, y = column[near] + 0.5, row[near] + 0.5
        # One step of least squares to the place between pixels.
        along = chart.points(x + 0.5, y) - chart.points(x - 0.5, y)
        down = chart.points(x, y + 0.5) - chart.points(x, y - 0.5)
        off = points - chart.points(x, y)
        aa, ab, bb = (along * along).sum(0), (along * down).sum(0), (down * down).sum(0)
        p, q = (along * off).sum(0), (down * off).sum(0)
        det = aa * bb - ab * ab
        det = np.where(det > 0, det, np.inf)
        return x + (p * bb - q * ab) / det, y + (q * aa - p * ab) / det

    return by_points


def _added(
    points: FloatArray,
    counts: Sequence[FloatArray],
    finders: Sequence[Finder],
    others: Sequence[int],
    pictures: Sequence[Centres],
) -> tuple[FloatArray, FloatArray]:
    """How much other pictures count (H, W) at points (3, H, W) of a picture, and how many light them."""
    _, high, wide = points.shape
    total, times = np.zeros((high, wide)), np.zeros((high, wide))
    for first in range(0, high, _ROWS):
        rows = np.s_[first : min(first + _ROWS, high)]
        some = points[:, rows].reshape(3, -1)
        for j in others:
            x, y = finders[j](some)
            there = np.flatnonzero(pictures[j].meets(some, x, y))
            found = np.zeros(x.size)
            found[there] = _between(counts[j], x[there], y[there])
            total[rows] += found.reshape(-1, wide)
            times[rows] += (found > 0).reshape(-1, wide)
    return total, times


def _between(values: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Values (H, W) at places (P,) in pixels, in proportion between centres; 0 beyond the outermost."""
    return np.asarray(ndimage.map_coordinates(np.pad(values, 1), (y + 0.5, x + 0.5), order=1))


def _read_weights(
    spec: DisplayFile, projectors: Sequence[Projector], shares: list[FloatArray]
) -> list[Problem]:
    """Put pictures of weights in the place of shares; what is wrong with them."""
    assert spec.blend is not None
    problems = []
    for k, (given, one) in enumerate(zip(spec.projectors or (), projectors, strict=True)):
        if given.weights is None:
            continue
        picture = read_numbers(given.weights, 1)
        wide, high = one.chart.size
        values = picture.values.max(axis=0) if picture.size == (wide, high) else np.zeros((1, 1))
        key = ("projectors", k, "weights")
        if picture.size != (wide, high):
            words = f"is {picture.size[0]} × {picture.size[1]} pixels (expected {wide} × {high})"
            problems.append(spec.source.problem(key, words))
        elif not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1):
            words = f"has numbers from {values.min():g} to {values.max():g} (expected shares from 0 to 1)"
            problems.append(spec.source.problem(key, words))
        else:
            there = 1.0 if one.chart.mask is None else one.chart.mask
            shares[k] = values**spec.blend.weights_gamma * there
    return problems
