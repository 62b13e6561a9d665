"""The picture of a take: from above, and each coordinate over time, before and after filtering."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quiltcli.analysis.path.study import PathStudy
from quiltcli.analysis.sweetspot.picture import write_plan
from quiltcli.analysis.sweetspot.plan import Item, Lines, Plan
from quiltcli.formats.drawing.charts import ticks
from quiltcli.formats.drawing.shapes import Label, Shape
from quiltcli.geometry import FloatArray
from quiltcli.layout.picture.drawing import FAINT, INK, PAGE, PAGE_EDGE
from quiltcli.viewer.recorded.clean import Run

_WIDTH, _HEIGHT = 1280, 720
_ABOVE = (70.0, 60.0, 470.0, 560.0)  # left, top, width and height of the plan
_OVER_TIME = (650.0, 590.0)  # left edge and width of the curves
_ROWS = ((60.0, "right, m"), (220.0, "up, m"), (380.0, "back, m"), (540.0, "moved, mm"))
_ROW = 120.0
_RAW, _SMOOTH, _DISPLAY = "#8a93a6", "#5ec8f2", "#e69f00"
_BAD = "#3a2a30"
_MOST_POINTS = 4000


@dataclass(frozen=True)
class _Box:
    """A frame of the picture, and the values across and up that its edges stand for."""

    left: float
    top: float
    width: float
    height: float
    across: tuple[float, float]
    up: tuple[float, float]

    def points(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Picture pixels (n, 2) of values."""
        right = self.left + (x - self.across[0]) / (self.across[1] - self.across[0]) * self.width
        down = self.top + (self.up[1] - y) / (self.up[1] - self.up[0]) * self.height
        return np.stack((right, down), axis=1)


def path_picture(study: PathStudy, path: Path) -> None:
    """Draw a take from above and over time, whole or not at all.

    Raises:
        OutputError: the name ends in neither .png nor .svg, or the file cannot be written.
    """
    write_plan(draw_path(study), path)


def draw_path(study: PathStudy) -> Plan:
    """The drawing: the way from above, and its coordinates and how far they were moved over time."""
    title = f"{study.file.name}: {study.head.take.subject}, {len(study.head.take.times):,} samples"
    items: list[Item] = [Label(_ABOVE[0], 26, 17, title, INK, "start")]
    items += _from_above(study)
    items += _over_time(study)
    items += _legend(study)
    return Plan(_WIDTH, _HEIGHT, tuple(items))


def _from_above(study: PathStudy) -> Iterator[Item]:
    """The way, X to the right and Z down, and the outline of the display where there is one."""
    left, top, width, height = _ABOVE
    flat = [study.places[:, [0, 2]], *(outline[:, [0, 2]] for outline in study.outlines)]
    low, high = np.concatenate(flat).min(axis=0), np.concatenate(flat).max(axis=0)
    scale = min(width, height) / max(float((high - low).max()) * 1.15, 1e-3)
    middle, half = (low + high) / 2, np.array([width, height]) / scale / 2
    box = _Box(
        left,
        top,
        width,
        height,
        (middle[0] - half[0], middle[0] + half[0]),
        (-middle[1] - half[1], -middle[1] + half[1]),
    )
    yield from _frame(box, "from above: x, m", "z, m", sign=-1)
    outlines = tuple(box.points(*_closed(outline)) for outline in study.outlines)
    if outlines:
        yield Lines(outlines, _DISPLAY, 2)
    for runs, color, thick in _layers(study):
        yield Lines(
            tuple(box.points(run.positions[:, 0], -run.positions[:, 2]) for run in map(_fewer, runs)),
            color,
            thick,
        )
    start = box.points(study.places[:1, 0], -study.places[:1, 2])[0]
    yield Shape(start + 5 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)]), INK, INK, 0)


def _closed(outline: FloatArray) -> tuple[FloatArray, FloatArray]:
    ring = np.concatenate((outline, outline[:1]))
    return ring[:, 0], -ring[:, 2]


def _layers(study: PathStudy) -> list[tuple[Sequence[Run], str, float]]:
    """What is drawn, back to front: samples, then what the filter makes of them."""
    layers: list[tuple[Sequence[Run], str, float]] = [(study.head.cleaned.runs, _RAW, 1.2)]
    return layers if study.filter == "none" else [*layers, (study.head.runs, _SMOOTH, 1.8)]


def _over_time(study: PathStudy) -> Iterator[Item]:
    """Coordinates over seconds, gaps shaded, and how far the filter moves each sample."""
    left, width = _OVER_TIME
    first, last = study.head.seconds
    across = (first, last if last > first else first + 1)
    for axis, (top, label) in enumerate(_ROWS):
        values = study.moved_mm if axis == 3 else study.places[:, axis]
        low, high = (0.0, float(values.max())) if axis == 3 else (float(values.min()), float(values.max()))
        room = max(0.06 * (high - low), 1e-3 * (1 if axis < 3 else 100))
        box = _Box(left, top, width, _ROW, across, (low - room * (axis < 3), high + room))
        yield from _gaps(study, box)
        yield from _frame(box, "seconds" if axis == 3 else "", label)
        if axis == 3:
            times = np.concatenate([run.times for run in study.head.cleaned.runs])
            yield Lines((box.points(*_peaks(times, values)),), _SMOOTH, 1.2)
            continue
        for runs, color, thick in _layers(study):
            paths = tuple(box.points(run.times, run.positions[:, axis]) for run in map(_fewer, runs))
            yield Lines(paths, color, thick)


def _gaps(study: PathStudy, box: _Box) -> Iterator[Item]:
    """Shades where nothing was seen."""
    gaps = [gap for gap in study.head.cleaned.gaps if not gap.is_jump]
    for gap in (*gaps, *study.head.cleaned.filled):
        x0, x1 = box.points(np.array([gap.first, gap.last]), np.zeros(2))[:, 0]
        low, high = box.top, box.top + box.height
        yield Shape(
            np.array([(x0, low), (max(x1, x0 + 1), low), (max(x1, x0 + 1), high), (x0, high)]), _BAD, _BAD, 0
        )


def _frame(box: _Box, below: str, beside: str, sign: int = 1) -> Iterator[Item]:
    """Edges, ticks and labels; with `sign` −1 the values up are shown negated."""
    x0, y0, x1, y1 = box.left, box.top, box.left + box.width, box.top + box.height
    few = 3 if box.height < 200 else 6
    for value in ticks(*box.up, few):
        y = float(box.points(np.zeros(1), np.array([value]))[0, 1])
        yield Lines((np.array([(x0, y), (x1, y)]),), PAGE, 1)
        yield Label(x0 - 8 - 7 * len(f"{sign * value:g}"), y, 12, f"{sign * value + 0.0:g}", FAINT, "start")
    for value in ticks(*box.across, 7) if below else ():
        x = float(box.points(np.array([value]), np.zeros(1))[0, 0])
        yield Lines((np.array([(x, y1), (x, y1 + 5)]),), PAGE_EDGE, 1)
        yield Label(x, y1 + 16, 12, f"{value:g}", FAINT, "middle")
    yield Lines((np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]),), PAGE_EDGE, 1)
    yield Label((x0 + x1) / 2, y1 + 36, 13, below, INK, "middle")
    yield Label(x0, y0 - 12, 13, beside, INK, "start")


def _legend(study: PathStudy) -> Iterator[Item]:
    """What the colours are."""
    words = [(_RAW, "samples")]
    if study.filter != "none":
        words.append((_SMOOTH, study.filter.replace("_", " ")))
    if study.outlines:
        words.append((_DISPLAY, "display"))
    x = _ABOVE[0]
    for color, text in words:
        yield Lines((np.array([(x, 690.0), (x + 26, 690.0)]),), color, 3)
        yield Label(x + 34, 690, 13, text, INK, "start")
        x += 60 + 8.0 * len(text)


def _fewer(run: Run) -> Run:
    """A run of no more points than a picture can show."""
    step = max(len(run.times) // _MOST_POINTS, 1)
    return Run(run.times[::step], run.positions[::step], None)


def _peaks(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values (n,) with the largest of each few kept, so that none is lost."""
    step = max(len(times) // _MOST_POINTS, 1)
    count = len(times) // step * step
    return times[:count:step], values[:count].reshape(-1, step).max(axis=1)
