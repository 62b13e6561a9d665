"""Where rays meet a surface: a net of triangles for a first guess, and Newton's steps from there."""

from __future__ import annotations

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.shapes import crossed
from quiltcli.geometry import FloatArray, Int32Array

CELLS = 128
"""Cells of a net from side to side."""

_STEPS = 5
_FARTHEST = 0.05  # of the raster, that a step may go
_CLOSE = 1e-7  # of a ray's length, that a point may be off it
_VERY_CLOSE = 1e-11  # likewise, after steps with slopes of another place
_CHORDS = 4
_AT_A_TIME = 1 << 15  # rays, so that what is worked out of them stays near


def net(chart: Chart, cells: int = CELLS) -> tuple[FloatArray, FloatArray, Int32Array]:
    """Triangles that stand for a chart, wound as its lit side sees the raster turn from up to left.

    Returns:
        points (V, 3), or directions; facet pixels (V, 2); triangles (T, 3). Cells without a point, or outside
        the chart's mask, are left out.
    """
    width, height = chart.size
    columns, rows = min(cells, width), min(cells, height)
    x, y = np.meshgrid(np.linspace(0, width, columns + 1), np.linspace(0, height, rows + 1))
    # A fisheye's rim, and a map's, is where its outermost pixels end.
    points = chart.points(x, y)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    known = np.isfinite(points.sum(axis=0)).reshape(-1)
    keep = known[np.stack((a, b, c, d))].all(axis=0)
    if chart.mask is not None:
        middle = np.meshgrid(
            (np.arange(columns) + 0.5) * width / columns, (np.arange(rows) + 0.5) * height / rows
        )
        keep &= chart.mask[middle[1].astype(int), middle[0].astype(int)]
    triangles = np.stack((np.stack((a, b, c), axis=-1)[keep], np.stack((a, c, d), axis=-1)[keep]), axis=1)
    flat = np.where(known, points.reshape(3, -1), 0.0).T
    pixels = np.stack((x.reshape(-1), y.reshape(-1)), axis=1)
    return np.ascontiguousarray(flat), pixels, triangles.reshape(-1, 3).astype(np.int32)


def meet(chart: Chart, origin: FloatArray, rays: FloatArray, guess: FloatArray) -> FloatArray:
    """Facet pixels (2, P) where rays (3, P) from `origin` (3,) meet a chart, from guesses (2, P).

    Newton's steps on X(x, y) − o − τd = 0; where they lead nowhere, as on the rim, the guess stays.
    """
    place = guess.copy()
    length = np.sqrt((rays**2).sum(axis=0))
    limit = np.array(chart.size)[:, None] * _FARTHEST
    for _ in range(_STEPS):
        off, along, down = _linear(chart, origin, place)
        # Cramer's rule for x, y in X + x·Xx + y·Xy = τ d.
        normal = crossed(along, down)
        det = (normal * rays).sum(axis=0)
        with np.errstate(all="ignore"):
            dx = -(crossed(off, down) * rays).sum(axis=0) / det
            dy = -(crossed(along, off) * rays).sum(axis=0) / det
        step = np.clip(np.nan_to_num(np.stack((dx, dy)), nan=0.0, posinf=0.0, neginf=0.0), -limit, limit)
        place += step
    off = _linear(chart, origin, place)[0]
    share = (off * rays).sum(axis=0) / length**2
    away = np.sqrt(((off - share * rays) ** 2).sum(axis=0))
    with np.errstate(invalid="ignore"):
        good = (away <= _CLOSE * np.sqrt((off**2).sum(axis=0))) & (share > 0)
    return np.where(good, place, guess)


def meet_near(chart: Chart, origin: FloatArray, rays: FloatArray, guess: FloatArray) -> FloatArray:
    """As `meet`, for guesses from a net: slopes are taken once, and where that is not enough once more.

    A net is off by its sagitta, some ten-thousandth of its size; with the slopes of the guess each step
    leaves as small a share of the error (the simplified method of Newton), at a quarter of the price.
    """
    place = guess.copy()
    for first in range(0, place.shape[1], _AT_A_TIME):
        some = np.s_[:, first : first + _AT_A_TIME]
        place[some] = _nearer(chart, origin, rays[some], guess[some])
    off = chart.points(*place) - origin[:, None]
    share = (off * rays).sum(axis=0) / (rays * rays).sum(axis=0)
    away = ((off - share * rays) ** 2).sum(axis=0)
    with np.errstate(invalid="ignore"):
        far = np.flatnonzero(~((away <= (_VERY_CLOSE**2) * (off * off).sum(axis=0)) & (share > 0)))
    place[:, far] = meet(chart, origin, rays[:, far], guess[:, far])
    return place


def _nearer(chart: Chart, origin: FloatArray, rays: FloatArray, guess: FloatArray) -> FloatArray:
    """Guesses (2, P) after some steps with the slopes that they have."""
    off, along, down = _linear(chart, origin, guess)
    with np.errstate(all="ignore"):
        det = (crossed(along, down) * rays).sum(axis=0)
        # dx = −(off × down)·d / det, dy = −(along × off)·d / det, as products with `off`.
        to_x, to_y = -crossed(down, rays) / det, -crossed(rays, along) / det
    limit = np.array(chart.size)[:, None] * _FARTHEST
    place = guess.copy()
    for step in range(_CHORDS):
        if step:
            off = chart.points(*place) - origin[:, None]
        moved = np.stack(((to_x * off).sum(axis=0), (to_y * off).sum(axis=0)))
        place += np.clip(np.nan_to_num(moved, nan=0.0, posinf=0.0, neginf=0.0), -limit, limit)
    return place


def _linear(chart: Chart, origin: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points minus the origin (3, P) and their slopes by pixels."""
    x, y = place
    h = 0.01
    along = (chart.points(x + h, y) - chart.points(x - h, y)) / (2 * h)
    down = (chart.points(x, y + h) - chart.points(x, y - h)) / (2 * h)
    return chart.points(x, y) - origin[:, None], along, down
