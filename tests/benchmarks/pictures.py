"""Small charts as SVG, drawn without any library so that their bytes depend on nothing but the numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

_WIDTH, _HEIGHT = 760, 380
_LEFT, _RIGHT, _TOP, _BOTTOM = 70, 190, 46, 64
_COLORS = (
    *("#3b6fb6", "#d9822b", "#4a9a5b", "#b8453e", "#7d5ba6", "#8a6d5a", "#d36ba6", "#7f7f7f"),
    *("#a8a832", "#3ba6a6", "#c0c0c0"),
)


@dataclass(frozen=True)
class Axis:
    """Numbers along a side of the chart, on a logarithmic scale: end to end `length` pixels."""

    low: float
    high: float
    length: float

    def at(self, value: float) -> float:
        """Pixels from the axis's begin."""
        return math.log(value / self.low) / math.log(self.high / self.low) * self.length

    def ticks(self) -> list[float]:
        """Round numbers 1, 2 and 5 in every decade that lie on the axis."""
        decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        marks = [m * 10.0**d for d in decades for m in (1, 2, 5)]
        return [mark for mark in marks if self.low * 0.999 <= mark <= self.high * 1.001]


def lines_chart(
    title: str,
    labels: Sequence[str],
    series: Mapping[str, Sequence[float]],
    across: Sequence[float] | None = None,
    caption: str = "",
) -> str:
    """Seconds (on a logarithmic scale, in milliseconds) over `across`, or over equal steps.

    Args:
        title: above the chart.
        labels: of every step.
        series: name → seconds of every step; NaN leaves a step out.
        across: (steps,) numbers to place the steps by, on a logarithmic scale.
        caption: below the labels.
    """
    values = [v * 1e3 for line in series.values() for v in line if not math.isnan(v)]
    up = Axis(min(values) / 1.3, max(values) * 1.3, _HEIGHT - _TOP - _BOTTOM)
    width = _WIDTH - _LEFT - _RIGHT
    if across is None:
        places = [(k + 0.5) * width / len(labels) for k in range(len(labels))]
    else:
        axis = Axis(min(across) / 1.2, max(across) * 1.2, width)
        places = [axis.at(value) for value in across]
    parts = [_grid(up), *_labels(labels, places)]
    for color, line in zip(_COLORS, series.values(), strict=False):
        points = [
            (_LEFT + x, _HEIGHT - _BOTTOM - up.at(v * 1e3))
            for x, v in zip(places, line, strict=True)
            if not math.isnan(v)
        ]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{color}"/>' for x, y in points]
    return _page(title, caption, parts, list(series))


def bars_chart(title: str, labels: Sequence[str], series: Mapping[str, Sequence[float]]) -> str:
    """Stacked bars of seconds, in milliseconds; one bar a label, one piece a series."""
    totals = [sum(values) * 1e3 for values in zip(*series.values(), strict=True)]
    step = 10.0 ** math.floor(math.log10(max(totals)))
    step = next(s for s in (step / 5, step / 2, step, step * 2) if max(totals) / s <= 8)
    top = math.ceil(max(totals) / step) * step
    scale = (_HEIGHT - _TOP - _BOTTOM) / top
    width = (_WIDTH - _LEFT - _RIGHT) / len(labels)
    places = [(k + 0.5) * width for k in range(len(labels))]
    parts = [_line(k * step, _HEIGHT - _BOTTOM - k * step * scale) for k in range(round(top / step) + 1)]
    base = [float(_HEIGHT - _BOTTOM)] * len(labels)
    for color, values in zip(_COLORS, series.values(), strict=False):
        for k, value in enumerate(values):
            height = value * 1e3 * scale
            base[k] -= height
            corner = f'x="{_LEFT + places[k] - width * 0.35:.1f}" y="{base[k]:.1f}"'
            extent = f'width="{width * 0.7:.1f}" height="{height:.1f}"'
            parts.append(f'<rect {corner} {extent} fill="{color}"/>')
    return _page(title, "", [*parts, *_labels(labels, places)], list(series))


def _page(title: str, caption: str, parts: Sequence[str], names: Sequence[str]) -> str:
    """The whole picture: white paper, title, chart and legend."""
    right = _WIDTH - _RIGHT + 18
    legend = []
    for k, (color, name) in enumerate(zip(_COLORS, names, strict=False)):
        y = _TOP + 8 + 20 * k
        legend.append(f'<rect x="{right}" y="{y - 9}" width="12" height="12" fill="{color}"/>')
        legend.append(_text(right + 18, y + 2, name))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}"'
        ' font-family="sans-serif" font-size="12" fill="#222">'
    )
    paper = f'<rect width="{_WIDTH}" height="{_HEIGHT}" rx="6" fill="#fff"/>'
    words = [
        _text(_LEFT, 24, title, 'font-size="15" font-weight="bold"'),
        _text(_LEFT - 8, 30, "ms", 'text-anchor="end"'),
    ]
    words.append(_text((_LEFT + _WIDTH - _RIGHT) / 2, _HEIGHT - 10, caption, 'text-anchor="middle"'))
    return "\n".join([head, paper, *words, *parts, *legend, "</svg>"]) + "\n"


def _grid(up: Axis) -> str:
    return "\n".join(_line(mark, _HEIGHT - _BOTTOM - up.at(mark)) for mark in up.ticks())


def _line(mark: float, y: float) -> str:
    """A line across the chart with its number before it."""
    line = f'<path d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}" stroke="#ddd"/>'
    return line + _text(_LEFT - 8, y + 4, f"{mark:g}", 'text-anchor="end"')


def _labels(labels: Sequence[str], places: Sequence[float]) -> list[str]:
    """Labels below the chart, a second line after a line break."""
    found = []
    for label, x in zip(labels, places, strict=True):
        for row, words in enumerate(label.split("\n")):
            found.append(
                _text(
                    _LEFT + x, _HEIGHT - _BOTTOM + 18 + 15 * row, words, 'text-anchor="middle" font-size="11"'
                )
            )
    return found


def _text(x: float, y: float, words: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(words)}</text>'.replace(" >", ">")
