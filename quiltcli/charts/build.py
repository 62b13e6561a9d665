"""Charts from the surfaces and projections of display files, and all that can be wrong with them."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.kinds import KINDS, OUTWARD, metres_by
from quiltcli.charts.measure import seam_gap
from quiltcli.charts.omni import MERGE_DEG, Omnistereo
from quiltcli.charts.projections import FACES, cube_face
from quiltcli.charts.projections import KINDS as PROJECTIONS
from quiltcli.charts.shapes import Placed, Shape, slopes
from quiltcli.errors import DisplayError, Problem
from quiltcli.formats.numbers import read_numbers
from quiltcli.geometry import BoolArray, FloatArray, applied, rotation_deg
from quiltcli.geometry.formulas import parse
from quiltcli.job.digest import file_sha256
from quiltcli.job.display import DisplayFile
from quiltcli.job.dump import plain
from quiltcli.job.lengths import exact_metres
from quiltcli.job.model import FARTHEST

GRID = 33
_FLAT = 1e-9  # of the size squared, for a unit of s and t
_MEETS = 1e-6  # of the size
_IMPLICIT = 1e-4  # of the size
_CLOSES = 0.01  # pixels


def surface_chart(spec: Any, number: int, display: DisplayFile) -> Chart:
    """The chart of a surface, checked.

    Args:
        spec: the surface.
        number: its place in `surfaces`.
        display: the file.

    Raises:
        DisplayError: it has no points, folds, is mirrored, is not where its equation says …
    """
    shape = placed(KINDS[spec.kind](spec, metres_by(display.metres)), spec, display)
    size = tuple(spec.pixels or _size_of(shape))
    blame = _Blame(spec, number, display)
    if spec.kind == "map" and size != _size_of(shape):
        own = _size_of(shape)
        raise DisplayError(
            blame.problem("pixels", f"the map is {own[0]} × {own[1]}, got {size[0]} × {size[1]}")
        )
    shape = replace(shape, reversed=_runs_left(spec) != spec.mirror)
    mask = _mask(spec, shape, size, blame)
    normals = _checked_normals(shape, size, mask, blame)
    side = _lit_side(spec, shape, normals, blame)
    if getattr(spec, "zero", None):
        _check_equation(spec, shape, display, blame)
    chart = Chart(
        shape=shape,
        size=size,
        side=side,
        mask=mask,
        wraps=_wraps(shape),
        record=record_of(spec, display),
    )
    # A map knows its points alone: it is a ring where its last pixel is a step before its first.
    gap = seam_gap(chart) if spec.kind == "map" else None
    return replace(chart, wraps=True) if gap is not None and gap < _CLOSES else chart


def placed(shape: Shape, spec: Any, display: DisplayFile) -> Placed:
    """The shape, which is in metres about its own origin, where the display puts it."""
    matrix = display.world_from_local
    linear, shift = (np.eye(3), np.zeros(3)) if matrix is None else (matrix[:3, :3], matrix[:3, 3])
    at = np.array([float(exact_metres(value, display.metres)) for value in spec.at])
    turn = rotation_deg(spec.rotate_deg) if any(spec.rotate_deg) else np.eye(3)
    return Placed(shape, linear @ turn, applied(linear, at) + shift)


def projection_charts(spec: Any, display: DisplayFile) -> list[tuple[str, Chart]]:
    """Name and chart of every facet of a projection: one, or one for each page of a cube map."""
    heading = rotation_deg((0.0, spec.heading_deg, 0.0)) if spec.heading_deg else np.eye(3)

    def chart(shape: Shape) -> Chart:
        turned = Placed(shape, heading, np.zeros(3))
        return Chart(
            shape=turned,
            size=spec.pixels,
            follows=spec.follows,
            mask=_defined(turned, spec.pixels),
            wraps=_wraps(turned),
            cuts=_cuts(spec),
            omni=_omnistereo(spec),
            record=record_of(spec, display),
        )

    if spec.kind == "cubemap" and spec.layout == "pages":
        return [(name, chart(cube_face(spec, name))) for name in FACES]
    return [(spec.kind, chart(PROJECTIONS[spec.kind](spec)))]


def _omnistereo(spec: Any) -> Omnistereo | None:
    """The eyes beside the head that a projection asks for."""
    if not getattr(spec, "omnistereo", False):
        return None
    first, last = np.radians(spec.pole_merge_deg or MERGE_DEG).tolist()
    return Omnistereo((first, last))


def _cuts(spec: Any) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Where a cube map's faces end in its picture."""
    if spec.kind != "cubemap" or spec.layout == "pages":
        return (), ()
    across, down = (4, 3) if spec.layout == "cross" else (6, 1)
    width, height = spec.pixels
    return (
        tuple(width // across * k for k in range(1, across)),
        tuple(height // down * k for k in range(1, down)),
    )


def record_of(spec: Any, display: DisplayFile) -> str:
    """A surface or a projection as JSON that does not depend on where its files lie, only on their bytes."""
    data = {"units": display.metres, **plain(spec, file_sha256)}
    data.pop("place", None)
    if not data.get("omnistereo", True):
        del data["omnistereo"]
    matrix = display.world_from_local
    if matrix is not None:
        data["world_from_local"] = matrix.tolist()
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


class _Blame:
    """What to say of a surface, and where."""

    def __init__(self, spec: Any, number: int, display: DisplayFile) -> None:
        self._number, self._display = number, display
        self.name = f"surface {number + 1}" + (f" ({spec.name})" if spec.name else "")

    def problem(self, key: str, message: str) -> Problem:
        """A problem with one of the surface's keys."""
        where = ("surfaces", self._number) + ((key,) if key else ())
        return self._display.source.problem(where, f"{self.name}: {message}" if not key else message)


def _runs_left(spec: Any) -> bool:
    """Whether columns of a round surface must be turned over for its lit side not to be mirrored."""
    return spec.kind in OUTWARD and (OUTWARD[spec.kind] > 0) != (spec.lit == "outside")


def _size_of(shape: Shape) -> tuple[int, int]:
    """Width and height of a shape that is a map; nothing of others."""
    height, width = (0, 0) if shape.known is None else shape.known.shape
    return width, height


def _mask(spec: Any, shape: Placed, size: tuple[int, int], blame: _Blame) -> BoolArray | None:
    """Pixels that there are: where the mask is bright and opaque, and the map has points."""
    known = None if shape.known is None or shape.known.all() else shape.known
    if spec.mask is None:
        return known
    picture = read_numbers(spec.mask, 1)
    if picture.size != size:
        found = f"is {picture.size[0]} × {picture.size[1]} pixels"
        raise DisplayError(
            blame.problem("mask", f"{found} (expected {size[0]} × {size[1]}, as the surface has)")
        )
    bright: BoolArray = np.asarray(picture.values.max(axis=0) >= 0.5)
    if picture.alpha is not None:
        bright &= picture.alpha >= 0.5
    if known is not None:
        bright &= known
    if not bright.any():
        raise DisplayError(blame.problem("mask", "leaves no pixel (expected some that are bright)"))
    return bright


def _defined(shape: Shape, size: tuple[int, int]) -> BoolArray | None:
    """Pixels that have a direction; None where all have."""
    width, height = size
    if shape.known is not None:
        return None if shape.known.all() else shape.known
    found = np.empty((height, width), dtype=np.bool_)
    x = ((np.arange(width) + 0.5) / width)[None, :]
    for first in range(0, height, 64):
        y = ((np.arange(first, min(first + 64, height)) + 0.5) / height)[:, None]
        found[first : first + 64] = np.isfinite(shape.at(x, y).sum(axis=0))
    return None if found.all() else found


def _checked_normals(
    shape: Placed, size: tuple[int, int], mask: BoolArray | None, blame: _Blame
) -> FloatArray:
    """Normals (3, n) of the shape at a grid of places, once it has been found to have a plane everywhere."""
    s, t = np.meshgrid(_inner(size[0]), _inner(size[1]))
    x, y = s * size[0], t * size[1]
    chosen = np.ones(s.shape, dtype=np.bool_)
    if mask is not None:
        chosen = mask[np.minimum(y.astype(int), size[1] - 1), np.minimum(x.astype(int), size[0] - 1)]
    points = shape.at(s, t)
    bad = chosen & ~np.isfinite(points.sum(axis=0))
    if bad.any():
        where = _where(s[bad][0], t[bad][0])
        raise DisplayError(
            blame.problem("", f"has no point at {where} (its formulas give nothing finite there)")
        )
    if np.abs(points[:, chosen]).max(initial=0) > FARTHEST:
        words = f"reaches {np.abs(points[:, chosen]).max():.3g} m from the world's origin"
        raise DisplayError(blame.problem("", f"{words} (expected at most {FARTHEST:.0f})"))
    extent = float(np.ptp(points[:, chosen], axis=1).max()) if chosen.any() else 0.0
    if not extent > 1e-9:
        raise DisplayError(blame.problem("", f"is {extent:.3g} m large (expected 1e-09 or more)"))
    normal = shape.normal(s, t)
    length = np.sqrt((normal**2).sum(axis=0))
    inner = np.zeros(s.shape, dtype=np.bool_)
    inner[1:-1, 1:-1] = True
    along, down = slopes(shape, s, t)
    area = np.sqrt((np.cross(down.T, along.T) ** 2).sum(axis=2)).T
    flat = chosen & inner & ~((length > 0) & (area > _FLAT * extent**2))
    if flat.any():
        where = _where(s[flat][0], t[flat][0])
        raise DisplayError(blame.problem("", f"is degenerate at {where}: it has no area there"))
    n = normal / np.where(length > 0, length, 1.0)
    _check_folds(n, s, t, chosen & inner, blame)
    return np.asarray(normal[:, chosen & inner])


def _check_folds(n: FloatArray, s: FloatArray, t: FloatArray, chosen: BoolArray, blame: _Blame) -> None:
    """Neighbours of a grid whose normals are opposite lie on two sides of a fold."""
    for axis in (1, 2):
        here = (slice(None), slice(0, -1)) if axis == 1 else (slice(None), slice(None), slice(0, -1))
        there = (slice(None), slice(1, None)) if axis == 1 else (slice(None), slice(None), slice(1, None))
        both = chosen[here[1:]] & chosen[there[1:]]
        folded = both & ((n[here] * n[there]).sum(axis=0) < -0.5)
        if folded.any():
            where = _where(s[here[1:]][folded][0], t[here[1:]][folded][0])
            raise DisplayError(
                blame.problem("", f"is folded over near {where} (expected one side to be lit everywhere)")
            )


def _inner(count: int) -> FloatArray:
    """Places of the checks, from the first pixel's centre to the last one's."""
    return np.linspace(0.5 / count, 1 - 0.5 / count, GRID)


def _where(s: float, t: float) -> str:
    return f"s = {s:.4g}, t = {t:.4g}"


def _lit_side(spec: Any, shape: Placed, normals: FloatArray, blame: _Blame) -> int:
    """The lit side: 1 where s runs right there, −1 where the picture is mirrored and meant to be.

    Args:
        spec: the surface.
        shape: its shape, whose s may have been turned over.
        normals: (3, n) ∂X/∂t × ∂X/∂s.
        blame: whom to blame.
    """
    turn = -1 if shape.reversed else 1
    if spec.lit in ("above", "below"):
        upward = normals[1]
        if (upward > 0).any() and (upward < 0).any():
            words = f"says {spec.lit}, but parts of the surface face up and parts down (say front or back)"
            raise DisplayError(blame.problem("lit", words))
        side = (1 if (upward > 0).all() else -1) * (1 if spec.lit == "above" else -1)
    elif spec.kind in OUTWARD:
        side = turn * OUTWARD[spec.kind] * (1 if spec.lit == "outside" else -1)
        for name in ("arc_deg", "zenith_deg", "tube_deg", "latitude_deg"):
            first, last = getattr(spec, name, (0.0, 1.0))
            if hasattr(spec, name) and (first > last) != (name == "latitude_deg"):
                side = -side
    else:
        side = turn * (-1 if spec.lit == "back" else 1)
    if side < 0 and not spec.mirror:
        fix = "say mirror: true, or let s run the other way"
        if spec.kind in OUTWARD:
            fix = "say mirror: true, or give the last angle first"
        raise DisplayError(blame.problem("lit", f"the picture is mirrored as seen from {spec.lit} ({fix})"))
    return side


def _wraps(shape: Shape) -> bool:
    """Whether the left and the right edge are one line."""
    t = np.linspace(0.0, 1.0, GRID)
    left, right = shape.at(np.zeros(GRID), t), shape.at(np.ones(GRID), t)
    s, down = np.meshgrid(np.linspace(0, 1, GRID), t)
    points = shape.at(s, down)
    known = np.isfinite(points.sum(axis=0))
    if not known.any() or not np.isfinite(left + right).all():
        return False
    extent = float(np.ptp(points[:, known], axis=1).max())
    away = np.sqrt(((left - right) ** 2).sum(axis=0))
    # A patch whose sides are both points is no ring.
    return bool((away < _MEETS * extent).all() and np.ptp(points[:, known], axis=1).max() > 0)


def _check_equation(spec: Any, shape: Placed, display: DisplayFile, blame: _Blame) -> None:
    """The points must lie where the equation is 0: how far they are off is F over its slope."""
    zero = parse(spec.zero, ["x", "y", "z", *spec.constants])
    s, t = np.meshgrid(np.linspace(0, 1, GRID), np.linspace(0, 1, GRID))
    points = shape.shape.at(s, t) / display.metres
    size = float(np.ptp(points.reshape(3, -1), axis=1).max())

    def value(at: FloatArray) -> FloatArray:
        return zero({**spec.constants, "x": at[0], "y": at[1], "z": at[2]})

    slope = np.zeros(s.shape)
    for axis in range(3):
        step = np.zeros((3, 1, 1))
        step[axis] = 1e-5 * size
        slope += ((value(points + step) - value(points - step)) / (2e-5 * size)) ** 2
    with np.errstate(all="ignore"):
        away = np.abs(value(points)) / np.sqrt(slope)
    away = np.where(np.isfinite(away), away, np.where(value(points) == 0, 0.0, np.inf))
    if away.max() > _IMPLICIT * size:
        k = int(away.argmax())
        where = _where(s.flat[k], t.flat[k])
        words = f"is not 0 on the surface: at {where} it is {away.flat[k]:.3g} units off"
        raise DisplayError(blame.problem("zero", f"{words} (expected at most {_IMPLICIT * size:.3g})"))
