"""The broad phase: which polygons may overlap which, seen from the eye.

Directions are looked at through the six faces of a cube around the eye. On a face, polygons become
rectangles; a grid of cells finds those that meet. A polygon beside or behind a face's plane is
thrown out by the face's side planes or, rarely, counted as covering the whole face: too many
candidates only cost time, the exact test follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, dot, normalized, segments

_CHUNK = 1 << 20
_NEAR_PLANE = 1e-6


@dataclass(frozen=True)
class Footprints:
    """Rectangles of N polygons on one face, [-1, 1] both ways.

    Attributes:
        index: (N,) the polygon.
        low: (N, 2) least corner.
        high: (N, 2) greatest corner.
    """

    index: IntArray
    low: FloatArray
    high: FloatArray

    def take(self, keep: IntArray) -> Footprints:
        """The rectangles with these indices."""
        return Footprints(self.index[keep], self.low[keep], self.high[keep])


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


def candidate_pairs(polygons: FloatArray, cones: FloatArray) -> tuple[IntArray, IntArray]:
    """Pairs of polygons and cones that may overlap.

    Args:
        polygons: (N, n, 3) corners minus the eye.
        cones: (K, m, 3) corners minus the eye.

    Returns:
        Indices of polygons and of cones, every pair once.
    """
    keys: list[IntArray] = []
    if len(polygons) and len(cones):
        middle = normalized(cones).reshape(-1, 3).mean(axis=0)
        if not middle.any():  # facets all around the eye: any direction will do
            middle[2] = -1.0
        for frame in cube_faces(middle):
            found = _on_face(polygons, cones, frame)
            if found.size:
                keys.append(found)
    if not keys:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    found = keys[0] if len(keys) == 1 else np.unique(np.concatenate(keys))
    return np.divmod(found, max(len(cones), 1))


def _on_face(polygons: FloatArray, cones: FloatArray, frame: FloatArray) -> IntArray:
    """Keys polygon·K + cone of the pairs whose rectangles meet on one face."""
    targets = footprints(cones, frame)
    if not targets.index.size:
        return np.zeros(0, dtype=np.int64)
    grid = _Grid(targets)
    movers = grid.within(footprints(polygons, frame))
    result = []
    cells = grid.cells(movers)
    work = np.cumsum((cells[:, 2] - cells[:, 0] + 1) * (cells[:, 3] - cells[:, 1] + 1))
    first = 0
    while first < movers.index.size:
        done = work[first - 1] if first else 0
        last = max(int(np.searchsorted(work, done + _CHUNK // 8, side="right")), first + 1)
        part = np.arange(first, last)
        mover, target = grid.meeting(movers.take(part), cells[part])
        result.append(movers.index[first + mover] * len(cones) + targets.index[target])
        first = last
    return np.concatenate(result) if result else np.zeros(0, dtype=np.int64)


def footprints(polygons: FloatArray, frame: FloatArray) -> Footprints:
    """Rectangles of the polygons (N, n, 3) that may be seen through a face."""
    px, py, pz = np.ascontiguousarray(polygons.transpose(2, 1, 0))
    x, y, w = (axis[0] * px + axis[1] * py + axis[2] * pz for axis in frame)  # (n, N): corners first
    beside = (x > w).all(axis=0) | (-x > w).all(axis=0) | (y > w).all(axis=0) | (-y > w).all(axis=0)
    index = np.flatnonzero((w > 0).any(axis=0) & ~beside)
    x, y, w = x[:, index], y[:, index], w[:, index]
    front = (w > _NEAR_PLANE * (np.abs(x) + np.abs(y) + np.abs(w))).all(axis=0)
    safe = np.where(front, w, 1.0)
    x, y = x / safe, y / safe
    low = np.stack((x.min(axis=0), y.min(axis=0)), axis=1)
    high = np.stack((x.max(axis=0), y.max(axis=0)), axis=1)
    low[~front], high[~front] = -1.0, 1.0
    seen = np.flatnonzero((low <= 1).all(axis=1) & (high >= -1).all(axis=1))
    return Footprints(index[seen], np.maximum(low[seen], -1.0), np.minimum(high[seen], 1.0))


class _Grid:
    """Cells over the part of a face that has targets, each with the target rectangles that touch it."""

    def __init__(self, targets: Footprints) -> None:
        self.targets = targets
        self.side = int(np.clip(2.0 * np.sqrt(targets.index.size), 8, 256))
        self.low = targets.low.min(axis=0)
        self.high = targets.high.max(axis=0)
        side = self.side
        self.box = self.cells(targets)
        owner, cell = self._enumerate(self.box)
        order = np.argsort(cell, kind="stable")
        self.members = owner[order]
        self.start = np.searchsorted(cell[order], np.arange(side * side + 1))

    def within(self, prints: Footprints) -> Footprints:
        """The rectangles that meet the part of the face that has targets."""
        inside = (prints.low <= self.high) & (prints.high >= self.low)
        return prints.take(np.flatnonzero(inside.all(axis=1)))

    def cells(self, prints: Footprints) -> IntArray:
        """First column and row, last column and row (N, 4) of the cells the rectangles touch."""
        scale = self.side / np.maximum(self.high - self.low, np.finfo(np.float64).tiny)
        low = np.floor((prints.low - self.low) * scale)
        high = np.floor((prints.high - self.low) * scale)
        cells: IntArray = np.clip(np.concatenate((low, high), axis=1), 0, self.side - 1).astype(np.int64)
        return cells

    def meeting(self, movers: Footprints, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Movers and targets whose rectangles overlap, each pair once.

        A pair that shares several cells is reported from one of them: the cell that holds the
        greater of the two least corners, which is unique.
        """
        owner, cell = self._enumerate(cells)
        counts = self.start[cell + 1] - self.start[cell]
        visit, rank = segments(np.concatenate(([0], np.cumsum(counts))))
        mover, target = owner[visit], self.members[self.start[cell[visit]] + rank]
        first = np.maximum(cells[mover, :2], self.box[target, :2])
        here = np.flatnonzero(cell[visit] == first[:, 1] * self.side + first[:, 0])
        mover, target = mover[here], target[here]
        apart = (movers.low[mover] > self.targets.high[target]) | (
            self.targets.low[target] > movers.high[mover]
        )
        meets = np.flatnonzero(~apart.any(axis=1))
        return mover[meets], target[meets]

    def _enumerate(self, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Every cell of every box: the box and the cell's number."""
        across = cells[:, 2] - cells[:, 0] + 1
        owner, rank = segments(np.concatenate(([0], np.cumsum(across * (cells[:, 3] - cells[:, 1] + 1)))))
        column = cells[owner, 0] + rank % across[owner]
        row = cells[owner, 1] + rank // across[owner]
        return owner, row * self.side + column
