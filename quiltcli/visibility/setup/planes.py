"""Triangle setup: every test and every value as a plane over the pixels of a block.

In the homogeneous pixels (X, Y, W) of a block, a triangle's three edge functions and its inverse
depth 1/t are linear in the pixel (x, y, 1); no clipping and no division comes before them
(Olano & Greer 1997).

            C                 edge A = B × C      0 on the line through B and C, positive on A's side
          ╱   ╲               1/t    = n / det    n = (B − A) × (C − A): the triangle's plane
        ╱   ·   ╲             ·      covered where all three edges are positive,
      ╱  (x, y)   ╲                  at depth t = 1 / (a·x + b·y + c)
     A ─────────── B

Their coefficients are put on grids of powers of two so that
`a·x + b·y + c` is exact in float64 whatever the order of the sums: two triangles that share an edge
then decide every pixel alike, and every machine computes the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray

LATTICE = (7.1e-7, 3.3e-7)
"""Shift of the sample lattice in pixels: no vertex of a tidy model sits on a sample."""

_EXPONENT = np.int64(0x7FF0000000000000)
_TINY = 1e-300


@dataclass(frozen=True)
class Warped:
    """N block pairs, by (block, triangle), in the homogeneous pixels of their blocks.

    Attributes:
        triangle: (N,) triangle index.
        block: (N,) place of the block in the batch.
        corners: (3, 3, N) homogeneous pixels [corner, X/Y/W].
        box: (4, N) first and last pixel column, first and last row of the bounding box; no pixel can be
            covered where a last is less than its first.
        cut: (N,) triangles that reach beyond the near or far depth.
    """

    triangle: Int32Array
    block: Int32Array
    corners: FloatArray
    box: Int32Array
    cut: BoolArray


@dataclass(frozen=True)
class Planes:
    """N block pairs ready to be drawn; plane coefficients (a, b, c) come before the pairs.

    Attributes:
        triangle: (N,) triangle index.
        block: (N,) place of the block in the batch.
        serial: (N,) rank of the pair by (block, triangle); the lower wins equal depths.
        edge: (3, 3, N) edge functions [edge, coefficient], positive inside, never 0 at a pixel.
        inverse: (3, N) plane of 1/t.
        turn: (N,) sign that the edge functions were multiplied by to be positive inside.
        low: (N,) least 1/t of the triangle's corners; a bound that slivers are held to.
        high: (N,) greatest 1/t of the corners.
        box: (4, N) first and last pixel column, first and last row of the bounding box.
        cut: (N,) triangles that reach beyond the near or far depth.
    """

    triangle: Int32Array
    block: Int32Array
    serial: Int32Array
    edge: FloatArray
    inverse: FloatArray
    turn: FloatArray
    low: FloatArray
    high: FloatArray
    box: Int32Array
    cut: BoolArray

    def __getitem__(self, part: slice) -> Planes:
        """A range of the pairs, as views."""
        return Planes(*(column[..., part] for column in vars(self).values()))

    def compact(self) -> Planes:
        """The same in memory of their own: `take` copies all of an array that has gaps, each time."""
        return Planes(*(np.ascontiguousarray(column) for column in vars(self).values()))


class PlaneTable:
    """Memory for the planes of a batch, filled as its pairs are drawn and read when all are.

    Attributes:
        planes: those of all pairs that were added, and meaningless rows behind them.
        row_of_serial: (N,) row of every pair that was added, by its serial.
    """

    def __init__(self, capacity: int) -> None:
        self._filled = 0
        self.row_of_serial = np.empty(capacity, dtype=np.int64)
        self.planes = Planes(
            triangle=np.empty(capacity, dtype=np.int32),
            block=np.empty(capacity, dtype=np.int32),
            serial=np.empty(capacity, dtype=np.int32),
            edge=np.empty((3, 3, capacity)),
            inverse=np.empty((3, capacity)),
            turn=np.empty(capacity),
            low=np.empty(capacity),
            high=np.empty(capacity),
            box=np.empty((4, capacity), dtype=np.int32),
            cut=np.empty(capacity, dtype=np.bool_),
        )

    def add(self, pairs: Warped, chosen: IntArray, grids: Grids | None = None) -> Planes:
        """Set up the `chosen` pairs in the table's next rows; a triangle seen edge-on covers nothing."""
        first, self._filled = self._filled, self._filled + chosen.size
        rows = self.planes[first : self._filled]
        self.row_of_serial[chosen] = np.arange(first, self._filled)
        rows.serial[:] = chosen
        for name in ("triangle", "block", "cut"):
            np.take(getattr(pairs, name), chosen, out=getattr(rows, name), mode="clip")
        np.take(pairs.box, chosen, axis=1, out=rows.box, mode="clip")
        corners = np.take(pairs.corners, chosen, axis=2)
        edge_planes(corners, rows.edge, rows.inverse, rows.turn, grids or WHOLE)
        rows.low[:], rows.high[:] = depth_bounds(corners[:, 2])
        return rows


def project(corners: FloatArray, matrix: FloatArray, result: FloatArray) -> FloatArray:
    """Homogeneous pixels of triangle corners, each sum in the same order for every triangle.

    Args:
        corners: (3, 3, N) [corner, axis] minus the eye, metres.
        matrix: (3, 3, N) rows give X, Y, W.
        result: (3, 3, N) is given them [corner, X/Y/W].

    Returns:
        `result`.
    """
    # Written out: a matrix product sums in an order of its own, another on every machine.
    x, y, z = corners[:, 0], corners[:, 1], corners[:, 2]
    part = np.empty_like(x)
    for row in range(3):
        total = result[:, row]
        np.multiply(matrix[row, 0], x, out=total)
        total += np.multiply(matrix[row, 1], y, out=part)
        total += np.multiply(matrix[row, 2], z, out=part)
    return result


def pixel_boxes(
    homogeneous: FloatArray,
    width: IntArray | FloatArray,
    height: IntArray | FloatArray,
    reach: float | tuple[FloatArray, FloatArray] = 0.0,
) -> Int32Array:
    """Bounding boxes (4, N) first/last column, first/last row of the pixels a triangle may cover.

    Samples lie at most `reach` pixels beside a pixel's centre, to either side; or (N,) across and down.

    A triangle that reaches behind the eye may cover all of the block; one wholly behind it, or
    beside the block, has an empty box (last < first).
    """
    # Corners ahead of the eye are divided; of others the box is told by what is said above.
    w = homogeneous[:, 2]
    least, greatest = _extremes(w)
    front = least > _TINY
    all_front = bool(front.all())
    scale = np.reciprocal(w if all_front else np.where(w > _TINY, w, 1.0))
    box = np.empty((4, w.shape[1]), dtype=np.int32)
    across, down = reach if isinstance(reach, tuple) else (reach, reach)
    for axis, extent, beside in ((0, width, across), (1, height, down)):
        # A pixel is a candidate when its centre, a whole number here, lies between the extremes.
        first, last = _extremes(homogeneous[:, axis] * scale)
        np.ceil(np.subtract(first, beside + 1e-6, out=first), out=first)
        np.floor(np.add(last, beside + 1e-6, out=last), out=last)
        if not all_front:
            first = np.where(front, first, 0.0)
            last = np.where(front, last, np.where(greatest > 0, extent - 1.0, -1.0))
        box[2 * axis] = np.minimum(np.maximum(first, 0.0, out=first), extent, out=first)
        box[2 * axis + 1] = np.minimum(np.maximum(last, -1.0, out=last), extent - 1, out=last)
    return box


def _extremes(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest (N,) of three values (3, N)."""
    a, b, c = values
    least, greatest = np.minimum(a, b), np.maximum(a, b)
    return np.minimum(least, c, out=least), np.maximum(greatest, c, out=greatest)


@dataclass(frozen=True)
class Grids:
    """Where samples lie, and so how fine planes may be for sums over them to be exact.

    Attributes:
        sample: the step of the grid that samples lie on, pixels.
        edge: the step of edge planes' coefficients, of the larger slope's power of two.
        inverse: the step of the plane of 1/t, of its greatest value's power of two in a block.
    """

    sample: float
    edge: float
    inverse: float


WHOLE = Grids(1.0, 2.0**-34, 2.0**-49)
"""Samples at whole pixels."""

DISPLACED = Grids(2.0**-16, 2.0**-24, 2.0**-36)
"""Samples anywhere, on a grid of 65,536 steps a pixel: 25 bits of a slope and 25 of a place give 50."""


def edge_planes(
    homogeneous: FloatArray, edge: FloatArray, inverse: FloatArray, turn: FloatArray, grids: Grids = WHOLE
) -> None:
    """Edge functions and inverse depth of triangles in homogeneous pixels.

    Args:
        homogeneous: (3, 3, N) [corner, X/Y/W].
        edge: (3, 3, N) is given the edge functions [edge, coefficient], edge k opposite to corner k,
            positive inside; all zero for a triangle seen edge-on.
        inverse: (3, N) is given the plane of 1/t.
        turn: (N,) is given the sign of the determinant, by which the edge functions were multiplied.
        grids: where samples lie.
    """
    p, q, r = homogeneous
    # The normal of the triangle's plane; with a corner it gives the determinant A·(B × C).
    _cross(q - p, r - p, inverse)
    determinant = p[0] * inverse[0]
    determinant += p[1] * inverse[1]
    determinant += p[2] * inverse[2]
    np.sign(determinant, out=turn)
    # A shared edge has the same two corners, in one order or the other: the same numbers, or negated.
    for k, (start, end) in enumerate(((q, r), (r, p), (p, q))):
        _cross(start, end, edge[k])
    edge *= turn
    snap_edges(edge, grids)
    # Seen edge-on: all edges are 0 by now, and nothing is covered.
    determinant[turn == 0] = 1.0
    inverse /= determinant
    # Depth is measured at the place itself; only what covers it is decided on the shifted lattice.
    inverse[2] -= LATTICE[0] * inverse[0] + LATTICE[1] * inverse[1]
    _snap_inverse(inverse, grids)


def depth_bounds(w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest 1/t (N,) of triangles whose corners have these W (3, N)."""
    least, greatest = _extremes(w)
    front = least > _TINY
    if front.all():
        return np.reciprocal(greatest), np.reciprocal(least)
    low = np.where(front, 1.0 / np.maximum(greatest, _TINY), _TINY)
    high = np.where(front, 1.0 / np.maximum(least, _TINY), 1.0 / _TINY)
    return low, high


def _cross(a: FloatArray, b: FloatArray, result: FloatArray) -> None:
    """Cross product along the first axis; trading `a` and `b` negates it exactly."""
    part = np.empty_like(result[0])
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=result[k])
        result[k] -= np.multiply(a[j], b[i], out=part)


def facing(planes: Planes, rows: IntArray, handed: FloatArray) -> FloatArray:
    """1 for pairs (n,) whose triangle's front the eye sees, −1 for those it sees from behind."""
    result: FloatArray = planes.turn.take(rows) * -handed.take(planes.block.take(rows))
    return result


def moved(x: NDArray[Any], y: NDArray[Any], *, out: FloatArray) -> FloatArray:
    """The planes `out` (..., 3, N) made to begin at x, y (N,); exact for what lies on dyadic grids."""
    out[..., 2, :] += out[..., 0, :] * x + out[..., 1, :] * y
    return out


def power_of_two(x: NDArray[Any]) -> FloatArray:
    """The largest power of two not above `x` > 0; 0 for 0."""
    result: FloatArray = (x.view(np.int64) & _EXPONENT).view(np.float64)
    return result


def snap_edges(edge: FloatArray, grids: Grids = WHOLE) -> None:
    """Put edge planes (..., 3, N) on their dyadic grids and fold the tie rule into c, in place.

    For samples at whole pixels the grid's step is 2⁻³⁴ of the larger slope, so sums over pixels below 2¹³
    are exact. Half a step of the sums, added to c, settles pixels exactly on the edge by the signs of a and b
    (a top-left rule); the neighbour's negated plane gets the negated half step.
    """
    a, b, c = edge[..., 0, :], edge[..., 1, :], edge[..., 2, :]
    # Adding 1.5·2⁵² steps rounds to whole steps, and taking that away leaves them.
    scale = power_of_two(np.maximum(np.abs(a), np.abs(b)))
    round_to = (scale * (1.5 * 2.0**52 * grids.edge))[..., None, :]
    edge += round_to
    edge -= round_to
    # The sign of a, or of b where a is 0: b's share is smaller than any step of a.
    tie = b * 2.0**-44
    tie += a
    scale *= grids.edge * grids.sample / 2
    c += np.copysign(scale, tie, out=tie)


def _snap_inverse(plane: FloatArray, grids: Grids) -> None:
    """Put a plane of 1/t (3, N) on a grid on which sums over a block are exact, in place."""
    # The greatest value within a block of 512 pixels decides the step, as for edges.
    a, b, c = plane
    slope = np.maximum(np.abs(a), np.abs(b))
    slope *= 512.0
    scale = power_of_two(np.maximum(slope, np.abs(c), out=slope))
    scale *= 1.5 * 2.0**52 * grids.inverse
    plane += scale
    plane -= scale
