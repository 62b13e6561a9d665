"""The plan of a sweet spot as a list of things to draw: the floor seen from above, −Z up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.sweetspot.distortion import MEASURES
from quiltcli.analysis.sweetspot.floor import DIRECTIONS, contour, directions
from quiltcli.analysis.sweetspot.scale import COLOURS, STEPS, UNSEEN, heat, ticks
from quiltcli.analysis.sweetspot.study import SweetSpot
from quiltcli.charts.lattice import chart_lines
from quiltcli.display import Facets, display_points
from quiltcli.geometry import FloatArray, dot, normalized
from quiltcli.layout.picture.drawing import FAINT, INK, PAGE_EDGE, PAPER, Label, Shape

BEST, CONTENT = "#ffd43b", "#7ee2b8"
_LONGEST = 860  # pixels of the plan's longer side
_LEFT, _TOP, _BOTTOM, _SIDE = 70, 96, 56, 300
_DASH = (9.0, 6.0)
_FEW = 50  # facets: thick lines, and their content is drawn


@dataclass(frozen=True)
class Lines:
    """Polylines (n, 2) of one colour and width, in picture pixels; `dash` is drawn and left out in turn."""

    paths: tuple[FloatArray, ...]
    color: str
    width: float
    dash: tuple[float, float] | None = None


@dataclass(frozen=True)
class Bitmap:
    """Pixels (H, W, 3) with their top left corner at whole picture pixels."""

    x: int
    y: int
    pixels: NDArray[np.uint8]


Item: TypeAlias = Shape | Label | Lines | Bitmap


@dataclass(frozen=True)
class Plan:
    """Everything to draw, back to front, on a picture of `width` × `height` pixels."""

    width: int
    height: int
    items: tuple[Item, ...]


@dataclass(frozen=True)
class _Frame:
    """Where the floor is on the picture: pixels a metre, and the least x and z."""

    scale: float
    low: FloatArray
    size: FloatArray

    def at(self, places: FloatArray) -> FloatArray:
        """Picture pixels (n, 2) of places (n, 2) in x, z or (n, 3)."""
        flat = places[:, [0, 2]] if places.shape[1] == 3 else places
        result: FloatArray = (flat - self.low) * self.scale + (_LEFT, _TOP)
        return result


def draw_plan(spot: SweetSpot, measure: str = "p95") -> Plan:
    """The map of one measure with the display, the eye, the limit's contour and a legend."""
    content = _content(spot)
    frame = _frame(spot, content)
    width, height = (int(side) for side in frame.size)
    items: list[Item] = [*_header(spot, measure)]
    items += _grid(frame)
    items += _heat(spot, measure, frame)
    items += _display(spot, frame)
    items.append(Lines(tuple(map(frame.at, content)), CONTENT, 2, _DASH))
    items += _people(spot, frame)
    items += _rooms(spot, measure, frame)
    items += _legend(spot, measure, _LEFT + width + 36, bool(content))
    return Plan(_LEFT + width + _SIDE, max(_TOP + height + _BOTTOM, 620), tuple(items))


def _frame(spot: SweetSpot, content: list[FloatArray]) -> _Frame:
    """Room for the map, the display, the content, the eyes and the audience."""
    x0, z0, x1, z1 = spot.floor.area
    spots = [
        np.array([[x0, z0], [x1, z1]]),
        display_points(spot.display)[:, [0, 2]],
        spot.shown.eye[None, [0, 2]],
    ]
    spots += content
    if spot.audience is not None:
        spots.append(np.array(spot.audience).reshape(2, 2))
    every = np.concatenate(spots)
    low, high = every.min(axis=0), every.max(axis=0)
    edge = 0.04 * float((high - low).max())
    low, high = low - edge, high + edge
    scale = _LONGEST / float((high - low).max())
    return _Frame(scale, low, np.ceil((high - low) * scale))


def _header(spot: SweetSpot, measure: str) -> Iterator[Label]:
    reach = spot.reach[measure]
    title = f"{Path(spot.display.path).name}   {reach.area:.3g} sq m within {spot.limit_deg:g}°"
    yield Label(_LEFT, 32, 24, title, INK, "start")
    eye = ", ".join(f"{value + 0.0:.4g}" for value in spot.shown.eye)
    yield Label(_LEFT, 62, 16, f"drawn for the eye at {eye};  content {spot.content}", FAINT, "start")


def _grid(frame: _Frame) -> Iterator[Item]:
    """Metres along the left and the bottom, with faint lines."""
    wide, high = frame.size
    right, bottom = _LEFT + wide, _TOP + high
    yield Shape(_box(_LEFT, _TOP, right, bottom), "#1c2027", PAGE_EDGE, 1)
    far = frame.low + frame.size / frame.scale
    # As many as have room: a label every hundred pixels.
    most = max(2, int(min(frame.size) // 90))
    for x in ticks(frame.low[0], far[0], most):
        at = _LEFT + (x - frame.low[0]) * frame.scale
        yield Lines((np.array([[at, _TOP], [at, bottom]]),), "#2b313b", 1)
        yield Label(at, bottom + 16, 14, f"{x + 0.0:.4g}", FAINT, "middle")
    for z in ticks(frame.low[1], far[1], max(2, int(high // 90))):
        at = _TOP + (z - frame.low[1]) * frame.scale
        yield Lines((np.array([[_LEFT, at], [right, at]]),), "#2b313b", 1)
        yield Label(_LEFT - 26, at, 14, f"{z + 0.0:.4g}", FAINT, "middle")
    yield Label(_LEFT + wide / 2, bottom + 38, 14, "x, metres", FAINT, "middle")
    yield Label(_LEFT - 26, _TOP - 14, 14, "z, metres", FAINT, "middle")


def _box(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _heat(spot: SweetSpot, measure: str, frame: _Frame) -> Iterator[Item]:
    """The colours of the map and the contours of the limit."""
    x0, z0, x1, z1 = spot.floor.area
    (left, top), (right, bottom) = np.rint(frame.at(np.array([[x0, z0], [x1, z1]]))).astype(int).tolist()
    values = spot.map(measure)
    width, height = max(right - left, 1), max(bottom - top, 1)
    yield Bitmap(left, top, heat(spot.floor, values, spot.limit_deg, width, height))
    found = contour(spot.floor, values, spot.limit_deg)
    paths = tuple(frame.at(segment) for segment in found)
    yield Lines(paths, PAPER, 4.5)
    yield Lines(paths, "#ffffff", 2.2)


def _display(spot: SweetSpot, frame: _Frame) -> Iterator[Item]:
    """Facets from above; those that show the eye something are bright and on top."""
    facets = spot.display
    shown = set(spot.shown.samples.facet[spot.shown.shown].tolist())
    thick = facets.count <= _FEW
    for lit in (False, True):
        mine = [facet for facet in range(facets.count) if (facet in shown) == lit]
        paths = tuple(frame.at(path) for facet in mine for path in _outlines(facets, facet))
        if thick:
            yield Lines(paths, PAPER, 7)
        yield Lines(paths, INK if lit else "#6b7483", 4 if thick else 1)


def _outlines(facets: Facets, facet: int) -> list[FloatArray]:
    """Lines in x and z: what is drawn of a facet; of a surface some rows and columns of its pixels."""
    chart = facets.charts[facet] if facets.charts else None
    if chart is None:
        return [_outline(facets.polygon(facet))]
    # From above an upright column is a point, and is left out.
    return [
        line[:, [0, 2]]
        for line in chart_lines(chart)
        if np.ptp(line[:, [0, 2]], axis=0).max() > 1e-6 * np.ptp(line, axis=0).max()
    ]


def _outline(polygon: FloatArray) -> FloatArray:
    """A facet from above: its closed polygon in x and z, or of an upright wall the line it is, once."""
    flat = polygon[:, [0, 2]]
    first = flat[0] - flat.mean(axis=0)
    along = flat @ first
    aside = (flat - flat[0]) @ np.array([-first[1], first[0]])
    if np.abs(aside).max() <= 1e-9 * max(float(np.ptp(along)), 1e-12):
        return flat[[int(along.argmin()), int(along.argmax())]]
    return _closed(flat)


def _closed(polygon: FloatArray) -> FloatArray:
    return np.concatenate((polygon, polygon[:1]))


def _content(spot: SweetSpot) -> list[FloatArray]:
    """Where the content is, lines in x and z: a plane that faces the eye, or planes behind few facets.

    Empty if it cannot be drawn, or is farther from the facets than the display is large.
    """
    facets, eye, content = spot.display, spot.shown.eye, spot.content
    shown = np.unique(spot.shown.samples.facet[spot.shown.shown]).tolist()
    low, high = (end(display_points(facets), axis=0) for end in (np.min, np.max))
    size = float((high - low).max())
    if content.kind == "plane":
        point = np.array(content.point)
        ahead = normalized((point - eye) * (1, 0, 1))
        near = np.linalg.norm(np.clip(point, low, high) - point)
        ends = np.outer((-0.35 * size, 0.35 * size), (-ahead[2], ahead[0]))
        return [point[[0, 2]] + ends] if ahead.any() and near <= size else []
    if content.kind == "distance" or not 0 < abs(content.metres) <= size or len(shown) > _FEW:
        return []
    if facets.curved[shown].any():
        return []
    side = np.sign(dot(eye - facets.origin, facets.normal))
    behind = -content.metres * side[:, None] * facets.normal
    return [_outline(facets.polygon(facet) + behind[facet]) for facet in shown]


def _inside(path: FloatArray, frame: _Frame) -> bool:
    """Whether a path stays on the plan."""
    away = path - (_LEFT, _TOP)
    return bool(((away >= 0) & (away <= frame.size)).all())


def _people(spot: SweetSpot, frame: _Frame) -> Iterator[Item]:
    """The audience, and the eye that serves it best."""
    if spot.audience is None or spot.best is None:
        return
    (left, top), (right, bottom) = frame.at(np.array(spot.audience).reshape(2, 2)).tolist()
    box = _closed(_box(left, top, right, bottom))
    yield Lines((box,), PAPER, 4)
    yield Lines((box,), BEST, 2, _DASH)
    yield _diamond(*frame.at(spot.best.eye[None])[0])


def _rooms(spot: SweetSpot, measure: str, frame: _Frame) -> Iterator[Item]:
    """The eye, and how far one may go from it to each side."""
    centre = frame.at(spot.shown.eye[None])[0]
    reach = spot.reach[measure]
    ways = directions(spot.shown)[:, [0, 2]]
    for name, way in zip(DIRECTIONS, ways, strict=True):
        length = reach.metres[name] * frame.scale
        if name in reach.open or length < 14:
            continue
        tip, across = centre + way * length, np.array([-way[1], way[0]])
        ends = np.stack((tip - 7 * across, tip + 7 * across))
        if not _inside(ends, frame):
            continue
        yield Lines((np.stack((centre, tip)), ends), PAPER, 1.6)
        x, y = tip + way * (15 + 22 * abs(way[0]))
        yield Label(x, y, 16, f"{reach.metres[name]:.2f} m", INK, "middle")
    yield _disc(*centre)


def _disc(x: float, y: float) -> Shape:
    """The mark of the eye."""
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    return Shape(7 * np.stack((np.cos(turn), np.sin(turn)), axis=1) + (x, y), "#ffffff", PAPER, 2.5)


def _diamond(x: float, y: float) -> Shape:
    """The mark of the best eye."""
    return Shape(np.array([[0, -11], [11, 0], [0, 11], [-11, 0]]) + (x, y), BEST, PAPER, 2)


def _legend(spot: SweetSpot, measure: str, x: float, content: bool) -> Iterator[Item]:
    """What colours and signs mean, and the room in figures."""
    name = {"mean": "mean", "p95": "95 % of it within", "worst": "worst"}[measure]
    yield Label(x, _TOP + 8, 16, "angle beside the right place,", INK, "start")
    yield Label(x, _TOP + 28, 16, f"of what is seen ({name})", INK, "start")
    y = _TOP + 52.0
    bounds = ["0", *(f"{step * spot.limit_deg:g}" for step in STEPS)]
    names = [f"{low}° to {high}°" for low, high in pairwise(bounds)] + [f"above {bounds[-1]}°"]
    for colour, text in zip(COLOURS, names, strict=True):
        yield Shape(_box(x, y, x + 34, y + 20), colour, colour, 0)
        yield Label(x + 46, y + 10, 14, text, INK, "start")
        y += 20
        if colour == COLOURS[STEPS.index(1)]:
            yield Lines((np.array([[x, y], [x + 34, y]]),), "#ffffff", 2.2)
    y += 20
    for sign, text in _signs(spot, x, y, content):
        yield sign
        yield Label(x + 46, y, 14, text, INK, "start")
        y += 24
    y += 12
    for key, label in MEASURES.items():
        text = f"{label}: {spot.reach[key].area:.3g} sq m within {spot.limit_deg:g}°"
        yield Label(x, y, 14, text, INK if key == measure else FAINT, "start")
        y += 22


def _signs(spot: SweetSpot, x: float, y: float, content: bool) -> Iterator[tuple[Item, str]]:
    """Lines and marks, one below the other, and what they are."""

    def line(row: int) -> tuple[FloatArray]:
        return (np.array([[x, y + 24 * row], [x + 34, y + 24 * row]]),)

    row = 0
    if np.isnan(spot.figures.mean).any():
        yield Shape(_box(x, y - 10, x + 34, y + 10), UNSEEN[0], UNSEEN[0], 0), "nothing is seen from here"
        row += 1
    yield _disc(x + 17, y + 24 * row), "the eye"
    yield Lines(line(row + 1), INK, 4), "facets that show something"
    row += 2
    if content:
        yield Lines(line(row), CONTENT, 2, _DASH), "content"
        row += 1
    if spot.audience is not None:
        yield Lines(line(row), BEST, 2, _DASH), "audience"
        yield _diamond(x + 17, y + 24 * (row + 1)), "the audience's best eye"
