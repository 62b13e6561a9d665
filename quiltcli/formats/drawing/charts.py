"""Charts as SVG: lines over a common axis, and bars of parts laid end to end."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from quiltcli.formats.drawing.svg import svg_element
from quiltcli.geometry import FloatArray

# Okabe & Ito's colours, which most people with any colour vision can tell apart.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#666666", "#8c6d00")
_INK, _FAINT = "#333333", "#dddddd"
_LEFT, _TOP, _RIGHT, _BOTTOM = 64, 16, 150, 44


@dataclass(frozen=True)
class Curve:
    """One line of a chart.

    Attributes:
        name: for the legend.
        values: (N,), not a number where the line is broken.
        dashed: drawn in dashes.
    """

    name: str
    values: FloatArray
    dashed: bool = False


def ticks(low: float, high: float, about: int = 6) -> list[float]:
    """Round numbers from `low` to `high`, about so many."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(size * power for size in (1, 2, 5, 10) if size * power >= raw)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def line_chart(
    across: FloatArray,
    curves: Sequence[Curve],
    labels: tuple[str, str],
    size: tuple[int, int] = (860, 380),
    mark: float | None = None,
) -> str:
    """Curves over common places.

    Args:
        across: (N,) places, ascending.
        curves: the lines.
        labels: of the axis across and of the axis up.
        size: width and height, CSS pixels.
        mark: a place to draw an upright line at.
    """
    values = np.concatenate([curve.values for curve in curves])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    room = 0.05 * (high - low) or 0.5
    frame = _Frame(size, (float(across[0]), float(across[-1])), (low - room, high + room))
    parts = [*frame.grid(labels)]
    if mark is not None:
        x = frame.x(mark)
        parts.append(_line(x, _TOP, x, size[1] - _BOTTOM, _INK, ' stroke-dasharray="3 3"'))
    for k, curve in enumerate(curves):
        color = COLORS[k % len(COLORS)]
        dash = ' stroke-dasharray="6 4"' if curve.dashed else ""
        path = frame.path(across, curve.values)
        parts.append(f'<path d="{path}" fill="none" stroke="{color}" stroke-width="2"{dash}/>')
        x, y = size[0] - _RIGHT + 12, _TOP + 10 + 20 * k
        parts.append(_line(x, y, x + 22, y, color, f' stroke-width="2"{dash}'))
        parts.append(_text(x + 28, y + 4, curve.name))
    return _document(size, parts)


@dataclass(frozen=True)
class _Frame:
    """The axes of a line chart."""

    size: tuple[int, int]
    across: tuple[float, float]
    up: tuple[float, float]

    def x(self, value: float) -> float:
        """Place of a value across."""
        low, high = self.across
        return _LEFT + (value - low) / ((high - low) or 1) * (self.size[0] - _LEFT - _RIGHT)

    def y(self, value: float) -> float:
        """Place of a value up."""
        low, high = self.up
        return self.size[1] - _BOTTOM - (value - low) / ((high - low) or 1) * (self.size[1] - _TOP - _BOTTOM)

    def path(self, across: FloatArray, values: FloatArray) -> str:
        """SVG path of a curve."""
        words, pen = [], "M"
        for place, value in zip(across.tolist(), values.tolist(), strict=True):
            if not math.isfinite(value):
                pen = "M"
                continue
            words.append(f"{pen}{self.x(place):.1f},{self.y(value):.1f}")
            pen = "L"
        return " ".join(words)

    def grid(self, labels: tuple[str, str]) -> list[str]:
        """Lines and numbers of both axes."""
        height = self.size[1]
        marks = []
        for value in ticks(*self.across):
            x = self.x(value)
            marks.append(_line(x, height - _BOTTOM, x, height - _BOTTOM + 5, _INK))
            marks.append(_text(x, height - _BOTTOM + 18, f"{value:g}", "middle"))
        return self.levels(labels, marks)

    def levels(self, labels: tuple[str, str], marks: Sequence[str] = ()) -> list[str]:
        """Lines and numbers of the axis up, marks of the axis across, labels of both."""
        width, height = self.size
        parts = []
        for value in ticks(*self.up):
            y = self.y(value)
            parts += [
                _line(_LEFT, y, width - _RIGHT, y, _FAINT),
                _text(_LEFT - 8, y + 4, f"{value:g}", "end"),
            ]
        parts += marks
        parts.append(_text((_LEFT + width - _RIGHT) / 2, height - 6, labels[0], "middle"))
        middle = (_TOP + height - _BOTTOM) / 2
        turned = f' transform="rotate(-90 14 {middle:.1f})"'
        return [*parts, _text(14, middle, labels[1], "middle", turned)]


def bar_chart(
    rows: Sequence[tuple[str, Mapping[str, float]]], unit: str, width: int = 860, most: float | None = None
) -> str:
    """A bar a row, of named parts laid end to end.

    Args:
        rows: name, and parts by name.
        unit: behind each row's sum.
        width: CSS pixels.
        most: what the longest bar stands for; longer ones are cut and say so by their number.
    """
    names = list(dict.fromkeys(name for _, parts in rows for name in parts))
    totals = [sum(parts.values()) for _, parts in rows]
    full = most or max(totals, default=1.0) or 1.0
    left, right, step = 120, 110, 24
    scale = (width - left - right) / full
    parts = []
    for k, (label, values) in enumerate(rows):
        y, x = 30 + k * step, float(left)
        parts.append(_text(left - 8, y + 12, label, "end"))
        for name, value in values.items():
            length = max(min(value * scale, width - right - x), 0.0)
            color = COLORS[names.index(name) % len(COLORS)]
            parts.append(f'<rect x="{x:.1f}" y="{y}" width="{length:.2f}" height="16" fill="{color}"/>')
            x += length
        parts.append(_text(x + 6, y + 12, f"{totals[k]:.3g} {unit}"))
    x = float(left)
    for k, name in enumerate(names):
        parts.append(f'<rect x="{x:.0f}" y="6" width="12" height="12" fill="{COLORS[k % len(COLORS)]}"/>')
        parts.append(_text(x + 17, 16, name))
        x += 34 + 7 * len(name)
    return _document((width, 40 + len(rows) * step), parts)


@dataclass(frozen=True)
class Bars:
    """Bars of one colour in a chart of groups.

    Attributes:
        name: for the legend.
        values: (N,) a bar in each group, not a number where there is none.
        spread: (N, 2) lower and upper end of the mark about each bar's end, such as an interval of
            confidence; not numbers where there is none. None for no marks.
    """

    name: str
    values: FloatArray
    spread: FloatArray | None = None


def group_chart(
    labels: Sequence[str], bars: Sequence[Bars], up: str, size: tuple[int, int] = (860, 380)
) -> str:
    """Upright bars side by side in groups.

    Args:
        labels: (N,) of the groups.
        bars: one of each stands in every group.
        up: label of the axis up.
        size: width and height, CSS pixels.
    """
    ends = np.concatenate([np.append(one.values, [] if one.spread is None else one.spread) for one in bars])
    ends = ends[np.isfinite(ends)]
    low, high = min(float(ends.min(initial=0.0)), 0.0), float(ends.max(initial=0.0))
    frame = _Frame(size, (0.0, float(len(labels))), (low, (high * 1.05) or 1.0))
    parts = frame.levels(("", up))
    wide = 0.8 / len(bars)
    for k, one in enumerate(bars):
        color = COLORS[k % len(COLORS)]
        for group, value in enumerate(one.values.tolist()):
            if not math.isfinite(value):
                continue
            x0, x1 = (frame.x(group + 0.1 + wide * (k + side)) for side in (0.04, 0.96))
            top, bottom = frame.y(max(value, 0.0)), frame.y(min(value, 0.0))
            at = f'x="{x0:.1f}" y="{top:.1f}" width="{x1 - x0:.1f}" height="{bottom - top:.1f}"'
            parts.append(f'<rect {at} fill="{color}"/>')
            if one.spread is not None and np.isfinite(one.spread[group]).all():
                middle, y0, y1 = (x0 + x1) / 2, *(frame.y(end) for end in one.spread[group].tolist())
                cap = min(5.0, (x1 - x0) / 3)
                parts += [_line(middle, y0, middle, y1, _INK)]
                parts += [_line(middle - cap, y, middle + cap, y, _INK) for y in (y0, y1)]
        y = _TOP + 10 + 20 * k
        left = size[0] - _RIGHT + 12
        parts.append(f'<rect x="{left}" y="{y - 6}" width="12" height="12" fill="{color}"/>')
        parts.append(_text(left + 18, y + 4, one.name))
    for group, label in enumerate(labels):
        parts.append(_text(frame.x(group + 0.5), size[1] - _BOTTOM + 18, label, "middle"))
    return _document(size, parts)


def _line(x0: float, y0: float, x1: float, y1: float, color: str, more: str = "") -> str:
    return f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{color}"{more}/>'


def _text(x: float, y: float, text: str, anchor: str = "start", more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{_INK}"{more}>{escape(text)}</text>'


def _document(size: tuple[int, int], parts: Sequence[str]) -> str:
    return svg_element(*size, parts, ' font-family="sans-serif" font-size="12" role="img"')
