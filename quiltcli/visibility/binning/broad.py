"""The broad phase: which polygons may overlap which, seen from the eye.

Directions are looked at through the six faces of a cube around the eye. On a face, polygons become
rectangles; a grid of cells finds those that meet. A polygon that reaches behind the eye, seen through
this face, is cut to what the face can show first; one that passes the eye by next to nothing counts as
covering the whole face. Too many candidates only cost time, the exact test follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, dot, normalized, offsets, segments, shares
from quiltcli.visibility.binning.cut import cut_polygons

_CHUNK = 1 << 20
_NEAR_PLANE = 1e-6
_SLACK = 1e-6
"""What polygons are widened by, on a face of [-1, 1], where they were cut."""
_AT_THE_EYE = 1e-9
"""Of a polygon's size: nearer to the eye than this, nothing is said about where it is seen."""
_ALL_AROUND = 1e-6
"""Cones whose mean direction is no longer than this are all around: their mean is rounding alone."""


@dataclass(frozen=True)
class Footprints:
    """Rectangles of N polygons on one face, [-1, 1] both ways.

    Attributes:
        index: (N,) the polygon.
        low: (2, N) least x and y.
        high: (2, N) greatest x and y.
    """

    index: IntArray
    low: FloatArray
    high: FloatArray

    def take(self, keep: IntArray) -> Footprints:
        """The rectangles with these indices, ascending."""
        if keep.size == self.index.size:
            return self
        return Footprints(self.index.take(keep), self.low.take(keep, axis=1), self.high.take(keep, axis=1))


def cube_faces(towards: FloatArray) -> FloatArray:
    """Six face frames (6, 3, 3) with the rows right, up, forward; the first looks `towards` (3,)."""
    forward = normalized(towards)
    aside = np.eye(3)[np.argmin(np.abs(forward))]
    right = normalized(np.cross(aside, forward))
    up = np.cross(forward, right)
    axes = (forward, -forward, right, -right, up, -up)
    frames = []
    for axis in axes:
        other = up if abs(float(dot(axis, up))) < 0.5 else right
        frames.append(np.stack((np.cross(other, axis), other, axis)))
    return np.stack(frames)


class ConeGrids:
    """Cones as rectangles on the faces of a cube about the eye, and grids in which they are found.

    Attributes:
        count: number of cones.
        faces: frame (3, 3) and grid of every face that cones are seen through.
    """

    def __init__(self, cones: FloatArray) -> None:
        """Sort in the cones (K, m, 3), given by corners minus the eye."""
        self.count = len(cones)
        self.faces: list[tuple[FloatArray, _Grid]] = []
        if not len(cones):
            return
        columns = np.ascontiguousarray(cones.transpose(1, 2, 0))
        middle = normalized(cones).reshape(-1, 3).mean(axis=0)
        if np.sqrt(dot(middle, middle)) < _ALL_AROUND:  # any direction will do: the world's axes, then
            middle = np.array([0.0, 0.0, -1.0])
        for frame in cube_faces(middle):
            targets = footprints(columns, frame)
            if targets.index.size:
                self.faces.append((frame, _Grid(targets)))


def candidate_pairs(polygons: FloatArray, cones: ConeGrids) -> tuple[IntArray, IntArray]:
    """Pairs of polygons and cones that may overlap.

    Args:
        polygons: (n, 3, N) [corner, axis] minus the eye.
        cones: the cones.

    Returns:
        Indices of polygons and of cones, every pair once.
    """
    keys: list[IntArray] = []
    if polygons.shape[2]:
        for frame, grid in cones.faces:
            found = _on_face(polygons, frame, grid, cones.count)
            if found.size:
                keys.append(found)
    if not keys:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    found = keys[0] if len(keys) == 1 else np.unique(np.concatenate(keys))
    return np.divmod(found, max(cones.count, 1))


def _on_face(polygons: FloatArray, frame: FloatArray, grid: _Grid, count: int) -> IntArray:
    """Keys polygon·`count` + cone of the pairs whose rectangles meet on one face."""
    movers = grid.within(footprints(polygons, frame))
    cells = grid.cells(movers)
    areas = _areas(cells)
    result = []
    for some in (np.flatnonzero(areas == 1), np.flatnonzero(areas > 1)):
        for share in shares(areas.take(some), _CHUNK // 8):
            part = some[share]
            mover, target = grid.meeting(movers.take(part), cells.take(part, axis=1))
            result.append(movers.index.take(part.take(mover)) * count + grid.targets.index.take(target))
    return np.concatenate(result) if result else np.zeros(0, dtype=np.int64)


def footprints(polygons: FloatArray, frame: FloatArray) -> Footprints:
    """Rectangles of the polygons (n, 3, N) that may be seen through a face."""
    px, py, pz = polygons.transpose(1, 0, 2)
    x, y, w = (axis[0] * px + axis[1] * py + axis[2] * pz for axis in frame)  # (n, N): corners first
    beside = (x > w).all(axis=0) | (-x > w).all(axis=0) | (y > w).all(axis=0) | (-y > w).all(axis=0)
    index = np.flatnonzero((w > 0).any(axis=0) & ~beside)
    if index.size < beside.size:
        x, y, w = (values.take(index, axis=1) for values in (x, y, w))
    front = (w > _NEAR_PLANE * (np.abs(x) + np.abs(y) + np.abs(w))).all(axis=0)
    all_front = bool(front.all())
    around = None if all_front else np.flatnonzero(~front)
    cut = None if around is None else _cut_to_face(np.stack((x, y, w), axis=2).take(around, axis=1))
    scale = np.reciprocal(w if all_front else np.where(front, w, 1.0))
    x *= scale
    y *= scale
    low, high = (np.stack([reduce(extreme, axis) for axis in (x, y)]) for extreme in (np.minimum, np.maximum))
    if around is not None and cut is not None:
        low[:, around], high[:, around] = cut
    seen = np.flatnonzero((low[0] <= 1) & (low[1] <= 1) & (high[0] >= -1) & (high[1] >= -1))
    prints = Footprints(index, low, high).take(seen)
    np.maximum(prints.low, -1.0, out=prints.low)
    np.minimum(prints.high, 1.0, out=prints.high)
    return prints


def _cut_to_face(polygons: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where polygons (n, N, 3), right, up and forward on a face, show on it after all else is cut away.

    Returns:
        least and greatest x and y (2, N), far outside the face where a polygon does not show.
    """
    corners = polygons.transpose(1, 0, 2)
    reach = np.abs(corners).max(axis=(1, 2))
    counts = np.full(len(corners), corners.shape[1])
    for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)):
        side = (1 + _SLACK) * corners[..., 2] - sign * corners[..., axis]
        corners, counts = cut_polygons(corners, counts, side)
    shown = counts > 0
    depth = corners[..., 2]
    # What is left lies ahead; closer to the eye than rounding allows, the directions are not known.
    unsure = shown & (depth <= _AT_THE_EYE * reach[:, None]).any(axis=1)
    plane = corners[..., :2] / np.where((shown & ~unsure)[:, None], depth, 1.0)[..., None]
    low, high = plane.min(axis=1).T - _SLACK, plane.max(axis=1).T + _SLACK
    low[:, unsure], high[:, unsure] = -1.0, 1.0
    low[:, ~shown], high[:, ~shown] = np.inf, -np.inf
    return low, high


def _areas(cells: IntArray) -> IntArray:
    """Number (N,) of cells in boxes (4, N) of first column and row, last column and row."""
    x0, y0, x1, y1 = cells
    result: IntArray = (x1 - x0 + 1) * (y1 - y0 + 1)
    return result


class _Grid:
    """Cells over the part of a face that has targets, each with the target rectangles that touch it."""

    def __init__(self, targets: Footprints) -> None:
        self.targets = targets
        self.side = int(np.clip(2.0 * np.sqrt(targets.index.size), 8, 256))
        self.low = targets.low.min(axis=1)
        self.high = targets.high.max(axis=1)
        side = self.side
        self.box = self.cells(targets)
        owner, cell = self._enumerate(self.box)
        order = np.argsort(cell, kind="stable")
        self.members = owner[order]
        self.start = np.searchsorted(cell[order], np.arange(side * side + 1))

    def within(self, prints: Footprints) -> Footprints:
        """The rectangles that meet the part of the face that has targets."""
        inside = np.ones(prints.index.size, dtype=np.bool_)
        for axis in range(2):
            inside &= prints.low[axis] <= self.high[axis]
            inside &= prints.high[axis] >= self.low[axis]
        return prints.take(np.flatnonzero(inside))

    def cells(self, prints: Footprints) -> IntArray:
        """First column and row, last column and row (4, N) of the cells the rectangles touch."""
        scale = self.side / np.maximum(self.high - self.low, np.finfo(np.float64).tiny)
        corners = np.stack((prints.low, prints.high)) - self.low[:, None]
        corners *= scale[:, None]
        cells: IntArray = np.clip(np.floor(corners, out=corners), 0, self.side - 1).astype(np.int64)
        return cells.reshape(4, -1)

    def meeting(self, movers: Footprints, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Movers and targets whose rectangles overlap, each pair once.

        A pair that shares several cells is reported from one of them: the cell that holds the
        greater of the two least corners, which is unique.
        """
        owner, cell = self._enumerate(cells)
        once = owner.size == movers.index.size  # one cell each
        first = self.start[cell]
        counts = self.start[cell + 1] - first
        visit, rank = segments(offsets(counts))
        rank += first.take(visit)
        mover, target = owner.take(visit), self.members.take(rank)
        meets = np.ones(mover.size, dtype=np.bool_)
        for axis in range(2):
            meets &= movers.low[axis].take(mover) <= self.targets.high[axis].take(target)
            meets &= self.targets.low[axis].take(target) <= movers.high[axis].take(mover)
        keep = np.flatnonzero(meets)
        mover, target = mover.take(keep), target.take(keep)
        if once:
            return mover, target
        cell = cell.take(visit.take(keep))
        column, row = (np.maximum(cells[k].take(mover), self.box[k].take(target)) for k in (0, 1))
        here = np.flatnonzero(cell == row * self.side + column)
        return mover.take(here), target.take(here)

    def _enumerate(self, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Every cell of every box (4, N): the box and the cell's number."""
        x0, y0, x1, _ = cells
        areas = _areas(cells)
        if areas.size and int(areas.max()) == 1:
            return np.arange(areas.size), y0 * self.side + x0
        owner, rank = segments(offsets(areas))
        row, column = np.divmod(rank, (x1 - x0 + 1).take(owner))
        return owner, (y0.take(owner) + row) * self.side + x0.take(owner) + column
