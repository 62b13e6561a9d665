"""Figures of a surface: how large it is, how dense its pixels are, how strongly it is bent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.charts.chart import Chart
from quiltcli.charts.shapes import crossed
from quiltcli.geometry import FloatArray

_GRID = 128


@dataclass(frozen=True)
class Measures:
    """Figures of a surface in the world.

    Attributes:
        area: square metres.
        pitch: least and greatest distance from pixel to pixel, metres; poles are left out.
        radius: least radius of curvature, metres; infinite where it is flat.
        low: (3,) least coordinates, metres.
        high: (3,) greatest.
    """

    area: float
    pitch: tuple[float, float]
    radius: float
    low: FloatArray
    high: FloatArray


def measure(chart: Chart) -> Measures:
    """Measure a surface on a grid of its pixels."""
    width, height = chart.size
    # The middles of cells: means over them are integrals.
    x, y = np.meshgrid(*((np.arange(_GRID) + 0.5) * (side / _GRID) for side in chart.size))
    points = chart.points(x, y)
    known = np.isfinite(points.sum(axis=0))
    if chart.mask is not None:
        known &= chart.mask[y.astype(int), x.astype(int)]
    right, down, bend = _steps(chart, x, y)
    across, along = (np.sqrt((step**2).sum(axis=0)) for step in (right, down))
    cell = np.sqrt((crossed(right, down) ** 2).sum(axis=0))
    # A pole's pixels have no width: they tell nothing of the others.
    plain = known & (cell > 1e-3 * np.maximum(across, along) ** 2)
    steps = np.concatenate((across[plain], along[plain])) if plain.any() else np.zeros(1)
    sharp = float(np.where(plain, bend, 0.0).max())
    shown = points[:, known]
    area = float(cell[known].mean() * known.mean() * width * height) if known.any() else 0.0
    return Measures(
        area=area,
        pitch=(float(steps.min()), float(steps.max())),
        radius=1 / sharp if sharp > 1e-9 else np.inf,
        low=shown.min(axis=1),
        high=shown.max(axis=1),
    )


def _steps(chart: Chart, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Steps to the next pixel right and down (3, ...), and how fast the normal turns (...), 1/metre."""
    h = 0.25
    bend = np.zeros(x.shape)
    found = []
    for dx, dy in ((h, 0.0), (0.0, h)):
        step = chart.points(x + dx, y + dy) - chart.points(x - dx, y - dy)
        turn = chart.normals(x + dx, y + dy) - chart.normals(x - dx, y - dy)
        length2 = (step**2).sum(axis=0)
        rate = np.abs((turn * step).sum(axis=0)) / np.where(length2 > 0, length2, np.inf)
        bend = np.fmax(bend, rate)
        found.append(step / (2 * h))
    return found[0], found[1], bend


def pitch_ratio(chart: Chart) -> float:
    """How many times farther apart the pixels of a surface are in some places than in others, or at poles."""
    x, y = (np.clip(np.linspace(0, side, 33), 0.5, side - 0.5) for side in chart.size)
    places = np.meshgrid(x, y)
    known = np.ones(places[0].shape, dtype=np.bool_)
    if chart.mask is not None:
        known = chart.mask[places[1].astype(int), places[0].astype(int)]
    most = 1.0
    for step in _steps(chart, *places)[:2]:
        length = np.sqrt((step**2).sum(axis=0))
        length = length[known & np.isfinite(length) & (length > 0)]
        if length.size:
            most = max(most, float(length.max() / length.min()))
    return most


def seam_gap(chart: Chart) -> float | None:
    """Pixels between the left and the right edge of a surface that nearly meet; None where they do not."""
    width, height = chart.size
    y = np.clip(np.linspace(0, height, 33), 0.5, height - 0.5)
    left, right = (chart.points(np.full_like(y, x), y) for x in (0.5, width - 0.5))
    beside = chart.points(np.full_like(y, 1.5), y)
    with np.errstate(invalid="ignore"):
        step = np.sqrt(((beside - left) ** 2).sum(axis=0))
        away = np.sqrt(((right - left) ** 2).sum(axis=0))
    known = np.isfinite(step + away) & (step > 0)
    if width < 8 or not known.any():
        return None
    # Between centres of the outermost pixels there is one step where the edges meet.
    gap = float(np.abs(away[known] / step[known] - 1).max())
    return gap if gap < 2 and float((away[known] / step[known]).max()) < 3 else None
