"""Bézier and NURBS patches (Piegl and Tiller, The NURBS Book, 1997)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from quiltcli.charts.shapes import Shape, Smooth
from quiltcli.formats.mesh.freeform import FreeformPatch, read_freeform
from quiltcli.geometry import FloatArray


def bezier_shape(spec: Any, metres: Callable[[Any], float]) -> Shape:
    """The patch of rows of control points: a NURBS patch without inner knots."""
    points = _points(spec.points, metres)
    degree = (points.shape[1] - 1, points.shape[0] - 1)
    return _patch(points, np.ones(points.shape[:2]), degree, _ends(degree[0]), _ends(degree[1]))


def nurbs_shape(spec: Any, metres: Callable[[Any], float]) -> Shape:
    """The patch of rows of control points with weights and knots."""
    if spec.file is not None:
        return _freeform_shape(read_freeform(spec.file), metres(1.0))
    points = _points(spec.points, metres)
    rows, columns = points.shape[:2]
    weights = np.ones((rows, columns)) if spec.weights is None else np.array(spec.weights, dtype=np.float64)
    knots = [
        _even(count, degree) if given is None else np.array(given, dtype=np.float64)
        for count, degree, given in zip(
            (columns, rows), spec.degree, (spec.knots_s, spec.knots_t), strict=True
        )
    ]
    return _patch(points, weights, spec.degree, knots[0], knots[1])


def _freeform_shape(found: FreeformPatch, unit: float) -> Shape:
    """The patch of a file, v upwards as textures have it: the first row is at the top."""
    (first, last), (low, high) = found.ranges
    along, down = found.knots
    turned = (-down)[::-1] + 0.0
    points, weights = unit * found.points[::-1], found.weights[::-1]
    return _patch(points, weights, found.degree, along, turned, ((first, last), (-high, -low)))


def _points(rows: Any, metres: Callable[[Any], float]) -> FloatArray:
    """Control points (rows, columns, 3), metres."""
    return np.array([[[metres(value) for value in point] for point in row] for row in rows])


def _ends(degree: int) -> FloatArray:
    """The knots of a Bézier curve."""
    return np.repeat((0.0, 1.0), degree + 1)


def _even(count: int, degree: int) -> FloatArray:
    """Clamped knots at even distances for so many points."""
    inner = np.linspace(0.0, 1.0, count - degree + 1)
    return np.concatenate((np.zeros(degree), inner, np.ones(degree)))


def _patch(
    points: FloatArray,
    weights: FloatArray,
    degree: tuple[int, int],
    along: FloatArray,
    down: FloatArray,
    ranges: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> Shape:
    """The patch over ranges of its knots, between the outer ones by default, taken for 0 to 1."""
    shares = [
        _identity if ranges is None else _rescaled(knots, order, part)
        for knots, order, part in zip((along, down), degree, ranges or ((0, 1), (0, 1)), strict=True)
    ]
    weighted = np.concatenate((points * weights[..., None], weights[..., None]), axis=2)

    def at(s: FloatArray, t: FloatArray) -> FloatArray:
        shape = np.broadcast_shapes(np.shape(s), np.shape(t))
        # What broadcasts is worked out once: rows and columns of a block are far fewer than its pixels.
        total = np.zeros((4, *shape))
        across = basis(along, degree[0], shares[0](np.asarray(s, dtype=np.float64)))
        below = basis(down, degree[1], shares[1](np.asarray(t, dtype=np.float64)))
        for j in range(weighted.shape[0]):
            for i in range(weighted.shape[1]):
                product = across[i] * below[j]
                for k in range(4):
                    total[k] += weighted[j, i, k] * product
        return np.asarray(total[:3] / total[3])

    return Smooth(at)


def _identity(share: FloatArray) -> FloatArray:
    return share


def _rescaled(
    knots: FloatArray, degree: int, part: tuple[float, float]
) -> Callable[[FloatArray], FloatArray]:
    """Shares of a part of the range between the outer knots as shares of all of it."""
    first, last = float(knots[degree]), float(knots[-degree - 1])
    start, step = (part[0] - first) / (last - first), (part[1] - part[0]) / (last - first)
    return lambda share: start + share * step


def basis(knots: FloatArray, degree: int, share: FloatArray) -> list[FloatArray]:
    """Values (...) of all basis functions (Cox and de Boor), the outer pieces going on beyond the ends."""
    count = knots.size - degree - 1
    u = knots[degree] + share * (knots[count] - knots[degree])
    # The piece that a place lies in; pieces of no length are never chosen.
    span = np.clip(np.searchsorted(knots, u, side="right") - 1, degree, count - 1)
    filled = np.flatnonzero(np.diff(knots) > 0)
    filled = filled[(filled >= degree) & (filled < count)]
    span = filled[np.clip(np.searchsorted(filled, span, side="right") - 1, 0, filled.size - 1)]
    values = [np.where(span == k, 1.0, 0.0) for k in range(knots.size - 1)]
    for p in range(1, degree + 1):
        values = [
            _share(u - knots[k], knots[k + p] - knots[k]) * values[k]
            + _share(knots[k + p + 1] - u, knots[k + p + 1] - knots[k + 1]) * values[k + 1]
            for k in range(knots.size - 1 - p)
        ]
    return values


def _share(part: FloatArray, whole: float) -> FloatArray:
    """Part by whole, 0 where the whole is nothing."""
    return part / whole if whole > 0 else np.zeros_like(part)
