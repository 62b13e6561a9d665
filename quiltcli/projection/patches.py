"""Curved facets in flat patches: planes close to a chart's pixels, and how far from them its rays go through.

A block of a curved facet's pixels gets a plane and a grid on it, a matrix M as a flat facet has one. The ray
d of a pixel meets that plane at M⁻¹d, near the pixel's own place but not at it. An edge function is linear in
d, whatever d depends on: what is a plane over a flat facet's pixels is the same plane here, read at the place
where the ray goes through. Nothing is approximated; a bad plane costs time, for its pixels are looked up
farther away.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from quiltcli.charts import Chart
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, dot
from quiltcli.layout import Layout
from quiltcli.projection.curved import ChartView, inverse_affine
from quiltcli.projection.planar import QuiltRays, inverse_3x3

SIDE = 64
"""Pixels from side to side of a patch at most; small enough for most to be almost flat."""

_TURN = 0.3
"""Radians that the pixels of a patch may be turned from their mean: coarse rasters have smaller patches."""

_ALONG = 5

_STEEP = 0.12
"""Share of a cube's volume below which the eye sees a patch too much from the side for its own plane."""

_FOLDED = 0.1
"""Of a view's slopes the smaller is at least this share of the larger: at a fold it would be 0."""

_SNAP = 2.0**-15
_FARTHEST = 192.0  # pixels; sums over places farther away would be rounded
_AT_A_TIME = 16


@dataclass(frozen=True, eq=False)
class Patches:
    """K patches of curved facets; x and y of a patch count pixels from its first one's centre.

    Attributes:
        charts: of all facets.
        facet: (K,) facet index.
        x0: (K,) page column of the first pixel.
        y0: (K,) page row.
        width: (K,) columns.
        height: (K,) rows.
        facet_from_quilt: (F, 2, 3).
        origin: (K, 3) of the plane that fits, where x = y = 0: world metres, or a projection's own axes.
        du: (K, 3) steps along it to the next pixel right.
        dv: (K, 3) steps down.
        spread: (K, 3) how far, axis by axis, points lie from it at most.
        facing: (K, 3) mean of the normals.
        turn: (K,) how far normals are from their mean at most.
        middle: (K, 3) mean of the points.
        radius: (K,) how far points are from there at most, metres.
        beside: pixels by which samples may lie beside pixels' centres.
    """

    charts: tuple[Chart | None, ...]
    facet: Int32Array
    x0: IntArray
    y0: IntArray
    width: IntArray
    height: IntArray
    facet_from_quilt: FloatArray
    origin: FloatArray
    du: FloatArray
    dv: FloatArray
    spread: FloatArray
    facing: FloatArray
    turn: FloatArray
    middle: FloatArray
    radius: FloatArray
    beside: float

    @property
    def count(self) -> int:
        """Number of patches, K."""
        return self.facet.size


@dataclass(frozen=True, eq=False)
class Patched:
    """The patches as one eye sees them.

    Attributes:
        lit: (K,) patches of which pixels may be lit.
        sure: (K,) those of which all are that there are.
        eye_from_patch: (K, 3, 3) pixel (x, y, 1) of a patch → ray, world axes.
        patch_from_eye: (K, 3, 3) the inverse.
        reach: (K, 2) how far rays of lit pixels go through beside their own places at most, pixels.
        near: whether the eye is so near to a patch that no plane lies across all of its rays.
    """

    lit: BoolArray
    sure: BoolArray
    eye_from_patch: FloatArray
    patch_from_eye: FloatArray
    reach: FloatArray
    near: bool = False


def small_enough(
    chart: Chart, x: FloatArray, y: FloatArray, width: FloatArray, height: FloatArray
) -> BoolArray:
    """Which rectangles (n,) of a chart's pixels are turned little enough in themselves to be patches.

    Args:
        chart: the chart.
        x: (n,) facet columns of their first pixels' centres.
        y: (n,) rows.
        width: (n,) from there to the last ones' centres.
        height: (n,) likewise.
    """
    share = np.linspace(0.0, 1.0, _ALONG)
    columns = x[:, None, None] + width[:, None, None] * share
    rows = y[:, None, None] + height[:, None, None] * share[:, None]
    found = np.broadcast_to(_direction(chart, columns, rows), (3, x.size, _ALONG, _ALONG))
    known = np.isfinite(found.sum(axis=0)) & (np.abs(found).sum(axis=0) > 0)
    count = np.maximum(known.sum(axis=(1, 2)), 1)
    mean = np.where(known, found, 0.0).sum(axis=(2, 3)) / count
    away = np.where(known, ((found - mean[:, :, None, None]) ** 2).sum(axis=0), 0.0)
    return np.asarray(away.max(axis=(1, 2)) <= _TURN**2)


def _direction(chart: Chart, x: FloatArray, y: FloatArray) -> FloatArray:
    """Normals (3, ...), or directions of a projection, of unit length."""
    if chart.stands:
        return chart.normals(x, y)
    points = chart.points(x, y)
    return np.asarray(points / np.sqrt((points**2).sum(axis=0)))


def make_patches(
    charts: tuple[Chart | None, ...],
    layout: Layout,
    facet: Int32Array,
    x0: IntArray,
    y0: IntArray,
    width: IntArray,
    height: IntArray,
    beside: float,
) -> Patches:
    """Fit planes to the blocks of curved facets; see `Patches` for the arguments.

    The plane is the one of least squares over the pixels that have points.
    """
    count = facet.size
    numbers = {name: np.zeros((count, 3)) for name in ("origin", "du", "dv", "spread", "facing", "middle")}
    turn, radius = np.full(count, np.inf), np.zeros(count)
    maps = np.stack([inverse_affine(matrix) for matrix in layout.quilt_from_facet])
    patches = Patches(
        charts, facet, x0, y0, width, height, maps, turn=turn, radius=radius, beside=beside, **numbers
    )
    for some in alike(patches, np.arange(count)):
        _fit(patches, some)
    return patches


def alike(patches: Patches, which: IntArray) -> Iterator[IntArray]:
    """Patches of one facet and size, a few at a time."""
    key = (patches.facet[which].astype(np.int64) << 32) | patches.width[which] << 16 | patches.height[which]
    order = np.argsort(key, kind="stable")
    bounds = np.flatnonzero(np.diff(key[order], prepend=-1, append=-1))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        for at in range(first, last, _AT_A_TIME):
            yield which[order[at : min(at + _AT_A_TIME, last)]]


def patch_grid(
    patches: Patches, some: IntArray, width: int, height: int, sample: tuple[float, float] = (0.0, 0.0)
) -> tuple[FloatArray, FloatArray]:
    """Page pixels, x (n, 1, width) and y (n, height, 1), of patches of one facet from their first pixels."""
    columns, rows = np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64)[:, None]
    x: FloatArray = patches.x0[some][:, None, None] + (0.5 + sample[0]) + columns
    y: FloatArray = patches.y0[some][:, None, None] + (0.5 + sample[1]) + rows
    return x, y


def _fit(patches: Patches, some: IntArray) -> None:
    """Work out the planes of patches of one facet and size, in place."""
    facet = int(patches.facet[some[0]])
    chart = patches.charts[facet]
    assert chart is not None
    width, height = int(patches.width[some[0]]), int(patches.height[some[0]])
    view = ChartView(chart, np.zeros(3), None, patches.facet_from_quilt[facet])
    points = view.rays(*patch_grid(patches, some, width, height))
    known = np.isfinite(points.sum(axis=0))
    weight = known.astype(np.float64)
    safe = np.where(known, points, 0.0)
    x, y = np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64)[:, None]
    # Normal equations of an affine map, about the middle of what is known.
    total = np.maximum(weight.sum(axis=(1, 2)), 1.0)
    mx, my = (weight * x).sum(axis=(1, 2)) / total, (weight * y).sum(axis=(1, 2)) / total
    dx, dy = x - mx[:, None, None], y - my[:, None, None]
    xx, xy, yy = ((weight * a * b).sum(axis=(1, 2)) for a, b in ((dx, dx), (dx, dy), (dy, dy)))
    mean = safe.sum(axis=(2, 3)) / total
    fx, fy = (safe * dx).sum(axis=(2, 3)), (safe * dy).sum(axis=(2, 3))
    det = xx * yy - xy * xy
    good = det > 1e-9 * np.maximum(xx * yy, 1e-300)
    det = np.where(good, det, 1.0)
    # A line of pixels has one slope, a pixel alone has none.
    du = np.where(good, (yy * fx - xy * fy) / det, np.where(xx > 0, fx / np.maximum(xx, 1e-300), 0.0)).T
    dv = np.where(good, (xx * fy - xy * fx) / det, np.where(yy > 0, fy / np.maximum(yy, 1e-300), 0.0)).T
    du, dv = _spanning(du, dv)
    # In single precision: the last bits of sums are not the same on all machines, and planes are to be.
    du, dv = _single(du), _single(dv)
    origin = _single(mean.T - mx[:, None] * du - my[:, None] * dv)
    patches.origin[some], patches.du[some], patches.dv[some] = origin, du, dv
    off = _away(patches, some, points, x, y)
    if patches.beside:
        # Samples lie between centres: the corners of pixels are as far away as any of them.
        corners = view.rays(*patch_grid(patches, some, width + 1, height + 1, (-0.5, -0.5)))
        ends = np.arange(-0.5, width), np.arange(-0.5, height)[:, None]
        off = np.maximum(1.05 * off, 1.05 * _away(patches, some, corners, *ends))
    patches.spread[some] = off
    patches.middle[some] = mean.T
    away = np.sqrt(((safe - mean[:, :, None, None]) ** 2).sum(axis=0))
    patches.radius[some] = np.where(known, away, 0.0).max(axis=(1, 2))
    if chart.stands:
        _bound_normals(patches, some, view, known)


def _single(values: FloatArray) -> FloatArray:
    """Values rounded to single precision."""
    return np.asarray(values.astype(np.float32), dtype=np.float64)


def _spanning(du: FloatArray, dv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Steps (n, 3) that span a plane, made up where a patch is a line or a point."""
    for k in range(len(du)):
        a, b = dot(du[k], du[k]), dot(dv[k], dv[k])
        if a == 0 and b == 0:
            du[k], dv[k] = (1e-6, 0, 0), (0, 1e-6, 0)
        elif not dot(np.cross(du[k], dv[k]), np.cross(du[k], dv[k])) > 1e-8 * a * b:
            long = du[k] if a >= b else dv[k]
            other = np.cross(long, np.eye(3)[np.abs(long).argmin()])
            other *= np.sqrt(dot(long, long) / dot(other, other))
            (dv if a >= b else du)[k] = other
    return du, dv


def _away(patches: Patches, some: IntArray, points: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """How far (n, 3), axis by axis, points (3, n, h, w) lie from the planes at most."""
    result = np.zeros((some.size, 3))
    for k in range(3):
        plane = (
            patches.du[some, k, None, None] * x
            + patches.dv[some, k, None, None] * y
            + patches.origin[some, k, None, None]
        )
        off = np.abs(points[k] - plane)
        result[:, k] = np.where(np.isfinite(off), off, 0.0).max(axis=(1, 2))
    return result


def _bound_normals(patches: Patches, some: IntArray, view: ChartView, known: BoolArray) -> None:
    """Mean and spread of the normals of patches, in place."""
    width, height = int(patches.width[some[0]]), int(patches.height[some[0]])
    normals = view.chart.normals(*view.facet_pixels(*patch_grid(patches, some, width, height)))
    normals = np.broadcast_to(normals, (3, *known.shape))
    # A pixel without a normal, as at a pole, is never lit; its patch is looked at pixel by pixel.
    none = known & ~(np.abs(normals).sum(axis=0) > 0)
    mean = np.where(known, normals, 0.0).sum(axis=(2, 3)) / np.maximum(known.sum(axis=(1, 2)), 1)
    away = np.sqrt(((normals - mean[:, :, None, None]) ** 2).sum(axis=0))
    patches.facing[some] = mean.T
    patches.turn[some] = np.where(none.any(axis=(1, 2)), 2.0, np.where(known, away, 0.0).max(axis=(1, 2)))


def patched(rays: QuiltRays, patches: Patches) -> QuiltRays:
    """The rays with the patches as the eye sees them."""
    lit = rays.lit[patches.facet].copy()
    sure = lit.copy()
    matrices = np.stack((patches.du, patches.dv, patches.origin), axis=-1)
    standing = np.array([view is not None and view.chart.stands for view in rays.views])[patches.facet]
    matrices[standing, :, 2] -= rays.eye
    for facet, view in enumerate(rays.views):
        if view is not None and view.turn is not None:
            mine = patches.facet == facet
            matrices[mine] = view.turn @ matrices[mine]
    height = dot(patches.facing, rays.eye - patches.middle)
    far = np.sqrt(dot(rays.eye - patches.middle, rays.eye - patches.middle))
    # n·(eye − X) against the same of the means, of which it is at most this far off.
    doubt = patches.turn * (far + patches.radius) + patches.radius * np.sqrt(
        dot(patches.facing, patches.facing)
    )
    lit &= ~standing | (height > -doubt)
    sure &= ~standing | (height > doubt + 1e-9)
    inverse = np.zeros_like(matrices)
    reach = np.zeros((patches.count, 2))
    u, v, o = (np.sqrt(dot(matrices[..., k], matrices[..., k])) for k in range(3))
    det = np.abs(np.linalg.det(matrices))
    flat = lit & (det >= _STEEP * u * v * o) & (det > 0)
    inverse[flat] = inverse_3x3(matrices[flat])
    reach[flat], good = _bounds(inverse[flat], patches, np.flatnonzero(flat), rays)
    flat[np.flatnonzero(flat)[~good]] = False
    near = False
    for some in alike(patches, np.flatnonzero(lit & ~flat)):
        near |= not _by_view(patches, some, rays, lit, matrices, inverse, reach)
    found = Patched(lit, sure & lit, matrices, inverse, reach, near)
    return replace(rays, patched=found)


def _bounds(
    inverse: FloatArray, patches: Patches, which: IntArray, rays: QuiltRays
) -> tuple[FloatArray, BoolArray]:
    """How far at most rays go through beside their pixels (n, 2), and where that can be told."""
    spread = patches.spread[which]
    turned = np.zeros((which.size, 3))
    for facet, view in enumerate(rays.views):
        mine = patches.facet[which] == facet
        if view is None or not mine.any():
            continue
        turn = np.eye(3) if view.turn is None else np.abs(view.turn)
        turned[mine] = spread[mine] @ turn.T
    e = (np.abs(inverse) * turned[:, None, :]).sum(axis=2)
    good = e[:, 2] < 0.5
    rest = np.where(good, 1 - e[:, 2], 1.0)
    extent = np.stack((patches.width[which], patches.height[which]), axis=1) + 2 * patches.beside
    reach = (e[:, :2] + extent * e[:, 2:]) / rest[:, None]
    good &= (reach < _FARTHEST).all(axis=1)
    return reach * (1 + 1e-6) + 2 * _SNAP, good


def _by_view(
    patches: Patches,
    some: IntArray,
    rays: QuiltRays,
    lit: BoolArray,
    matrices: FloatArray,
    inverse: FloatArray,
    reach: FloatArray,
) -> bool:
    """Planes across the view, for patches of one facet and size that are seen too much from the side.

    An affine map is fitted to the picture that the eye has of the patch; where the patch folds back on
    itself, its smaller slope is kept from 0.

    Returns:
        whether there are such planes.
    """
    facet = int(patches.facet[some[0]])
    view = rays.views[facet]
    assert view is not None
    width, height = int(patches.width[some[0]]), int(patches.height[some[0]])
    x, y = patch_grid(patches, some, width, height)
    d = np.broadcast_to(view.rays(x, y), (3, some.size, height, width))
    shown = view.lit(x, y) & np.isfinite(d.sum(axis=0))
    beside = patches.beside
    for n, patch in enumerate(some.tolist()):
        if not shown[n].any():
            lit[patch] = False
            continue
        unit = d[:, n] / np.sqrt((d[:, n] ** 2).sum(axis=0))
        weight = np.where(shown[n], 1.0, 1e-3)
        weight = np.where(np.isfinite(unit.sum(axis=0)), weight, 0.0)
        unit = np.where(weight > 0, unit, 0.0)
        f = (unit * np.where(shown[n], 1.0, 0.0)).sum(axis=(1, 2))
        f /= np.sqrt(f @ f)
        m = _view_matrix(unit, weight, f)
        a = inverse_3x3(m[None])[0]
        q = np.einsum("ij,jhw->ihw", a, d[:, n])
        with np.errstate(divide="ignore", invalid="ignore"):
            px, py = q[0] / q[2] - np.arange(width), q[1] / q[2] - np.arange(height)[:, None]
        if (shown[n] & ~(q[2] > 1e-3)).any():
            return False
        matrices[patch], inverse[patch] = m, a
        reach[patch] = [np.abs(p[shown[n]]).max() for p in (px, py)]
        if beside:
            # A sample is half a pixel away: as much again as neighbours differ.
            reach[patch] += beside * np.array([_steps(px), _steps(py)])
        reach[patch] += 2 * _SNAP + 1e-6
    return True


def _steps(values: FloatArray) -> float:
    """How much neighbours of a picture (h, w) differ at most, across and down."""
    total = 0.0
    for axis in (0, 1):
        step = np.abs(np.diff(values, axis=axis))
        total += float(step.max(initial=0.0, where=np.isfinite(step)))
    return total


def _view_matrix(unit: FloatArray, weight: FloatArray, f: FloatArray) -> FloatArray:
    """M (3, 3) of a plane across the direction f (3,), fitted to unit rays (3, h, w) with weights (h, w)."""
    e1 = np.cross(f, np.eye(3)[np.abs(f).argmin()])
    e1 /= np.sqrt(e1 @ e1)
    e2 = np.cross(f, e1)
    ahead = np.tensordot(f, unit, 1)
    weight = np.where(ahead > 0.05, weight, 0.0)
    safe = np.where(ahead > 0.05, ahead, 1.0)
    u, v = np.tensordot(e1, unit, 1) / safe, np.tensordot(e2, unit, 1) / safe
    height, width = weight.shape
    x, y = (
        np.broadcast_to(np.arange(width), weight.shape),
        np.broadcast_to(np.arange(height)[:, None], weight.shape),
    )
    total = weight.sum()
    mx, my, mu, mv = ((weight * value).sum() / total for value in (x, y, u, v))
    dx, dy = x - mx, y - my
    normal = (
        np.array([[(weight * a * b).sum() for b in (dx, dy)] for a in (dx, dy)]) + np.eye(2) * 1e-9 * total
    )
    right = np.array([[(weight * a * b).sum() for b in (dx, dy)] for a in (u - mu, v - mv)])
    slope = right @ np.linalg.inv(normal)
    left, size, across = np.linalg.svd(slope)
    largest = max(size[0], 1e-9)
    slope = left @ np.diag(np.maximum(size, (largest, _FOLDED * largest))) @ across
    basis = np.stack((e1, e2))
    du, dv = slope[:, 0] @ basis, slope[:, 1] @ basis
    return _single(np.stack((du, dv, f + mu * e1 + mv * e2 - mx * du - my * dv), axis=1))
