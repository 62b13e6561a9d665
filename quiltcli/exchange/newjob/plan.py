"""The plan of a set-up: from above and from the front, with dimensions in metres."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from quiltcli.display import Facets
from quiltcli.exchange.newjob.stand import Stand
from quiltcli.formats.drawing.shapes import Drawing, Label, Shape
from quiltcli.geometry import FloatArray

PAPER = "#ffffff"
_INK, _FAINT, _PANEL, _EDGE, _EYE = "#222222", "#8a8f98", "#cfe0f5", "#0072b2", "#d55e00"
_WIDTH, _MARGIN, _HEADER, _GAP = 1200, 90, 70, 60
_TALLEST = 640
_HEADING = 90  # pixels from a view's heading to the view: a dimension stands between
_NAMED = 16  # facets that are still named one by one


@dataclass(frozen=True)
class _View:
    """A view along one axis: metres of two axes to the picture's pixels.

    Attributes:
        axes: world axes across and down.
        sign: -1 where the axis down of the picture is the world's axis turned over.
        low: (2,) least of both, metres, as drawn.
        scale: pixels a metre.
        corner: (2,) picture pixels of `low`.
        size: (2,) pixels of the drawn box.
    """

    axes: tuple[int, int]
    sign: int
    low: FloatArray
    scale: float
    corner: FloatArray
    size: FloatArray

    def at(self, points: FloatArray) -> FloatArray:
        """Picture pixels (n, 2) of world points (n, 3)."""
        flat = points[:, self.axes] * (1, self.sign)
        return np.asarray(self.corner + (flat - self.low) * self.scale)


def draw_plan(title: str, facets: Facets, stand: Stand) -> Drawing:
    """Draw the display and the viewer's spot from above, and below it from the front.

    Panels that face a view are filled; each has its name and its size, where there are few.
    """
    above = _view(facets, stand, (0, 2), 1, _HEADER + _GAP + _HEADING)
    front = _view(facets, stand, (0, 1), -1, above.corner[1] + above.size[1] + _GAP + 30 + _HEADING)
    items: list[Shape | Label] = [
        Label(30, 30, 22, title, _INK, "start"),
        Label(30, 54, 14, _summary(facets, stand), _FAINT, "start"),
    ]
    for view, name in ((above, "from above (the viewer looks up the page)"), (front, "from the front")):
        items.append(Label(30, view.corner[1] - _HEADING, 15, name, _INK, "start"))
        viewer, words = _viewer(stand, view)
        drawn = [*_panels(facets, view), *_dimensions(facets, view), *viewer]
        items += drawn
        items += apart([(words,), *_names(facets, view)], drawn)
    return Drawing(_WIDTH, math.ceil(front.corner[1] + front.size[1] + 80), tuple(items))


def _summary(facets: Facets, stand: Stand) -> str:
    pixels = int(facets.size.astype(np.int64).prod(axis=1).sum())
    count = f"{facets.count} panel" + "s" * (facets.count > 1)
    eye = ", ".join(f"{c:g}" for c in stand.eye)
    return (
        f"{count}, {pixels:,} pixels; eye at x, y, z = {eye} m (x to the right, y up, z towards the viewer)"
    )


def _view(facets: Facets, stand: Stand, axes: tuple[int, int], sign: int, top: float) -> _View:
    """A view that holds the display and the eye, as large as the paper allows."""
    points = np.vstack((facets.corners, [stand.eye]))
    if axes == (0, 1):
        points = np.vstack((points, [(stand.eye[0], min(0.0, float(facets.corners[:, 1].min())), 0.0)]))
    flat = points[:, axes] * (1, sign)
    low, span = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-6)
    scale = float(min((_WIDTH - 2 * _MARGIN - 80) / span[0], _TALLEST / span[1]))
    size = span * scale
    return _View(axes, sign, low, scale, np.array(((_WIDTH - size[0]) / 2, top)), size)


def _panels(facets: Facets, view: _View) -> Iterator[Shape | Label]:
    """The panels, those far from the one who looks at the plan first."""
    depth = ({0, 1, 2} - set(view.axes)).pop()
    middles = np.array([facets.polygon(k).mean(axis=0) for k in range(facets.count)])
    for k in np.argsort(middles[:, depth], kind="stable"):
        outline = view.at(facets.polygon(int(k)))
        faces = facets.normal[k, depth] > 1e-6
        yield Shape(outline, _PANEL if faces else "#eeeeee", _EDGE, 2.5)


def _names(facets: Facets, view: _View) -> Iterator[tuple[Label, ...]]:
    """Names of the panels; of two panels behind one another the nearer is named."""
    depth = ({0, 1, 2} - set(view.axes)).pop()
    if facets.count <= _NAMED:
        for k in np.flatnonzero(facets.normal[:, depth] > -1e-6).tolist():
            yield tuple(_name(facets, k, view))


def _name(facets: Facets, k: int, view: _View) -> Iterator[Label]:
    """A panel's name and size, beside it where it is seen edge on."""
    (x, y), polygon = view.at(facets.polygon(k)).mean(axis=0), facets.polygon(k)
    wide, high = (math.dist(polygon[0], polygon[1]), math.dist(polygon[1], polygon[2]))
    size = f"{_metres(wide)} x {_metres(high)} m, {facets.size[k, 0]} x {facets.size[k, 1]} px"
    name = facets.names[k] or str(k + 1)
    box = np.ptp(view.at(polygon), axis=0)
    if facets.count <= 6 and box.min() > 44 and box[0] > 230:
        yield Label(x, y - 9, 15, name, _INK, "middle")
        yield Label(x, y + 11, 13, size, _INK, "middle")
    elif box.min() > 20:
        yield Label(x, y, 14, name, _INK, "middle")
    elif view.axes == (0, 2) and facets.count <= 6:
        out = facets.normal[k, [0, 2]]
        yield Label(x + 46 * out[0], y + 26 * out[1], 14, name, _INK, "middle")


def apart(groups: Iterable[tuple[Label, ...]], drawn: Sequence[Shape | Label]) -> Iterator[Label]:
    """Labels moved, group by group, to the nearest place where nothing lies over or under them.

    Args:
        groups: labels that stay together.
        drawn: what is there; of shapes their outlines are in the way.
    """
    taken = [_box(item) for item in drawn if isinstance(item, Label)]
    taken += [piece for item in drawn if isinstance(item, Shape) for piece in _pieces(item.points)]
    for group in groups:
        boxes = [_box(label) for label in group]
        free = (o for o in _OFFSETS if not any(_meet(box + (*o, *o), one) for box in boxes for one in taken))
        offset = next(free, (0.0, 0.0))
        taken += [box + (*offset, *offset) for box in boxes]
        for label in group:
            yield replace(label, x=label.x + offset[0], y=label.y + offset[1])


_OFFSETS = sorted(
    ((20.0 * i, 14.0 * j) for i in range(-9, 10) for j in range(-9, 10)),
    key=lambda offset: (math.hypot(offset[0], 3 * offset[1]), offset),  # rather aside, to stay in its row
)


def _box(label: Label) -> FloatArray:
    """Least x, y and greatest x, y (4,) of a label, a little wide."""
    wide, high = 0.56 * label.size * len(label.text), 0.6 * label.size
    left = label.x - (wide / 2 if label.anchor == "middle" else 0)
    return np.array((left - 4, label.y - high - 2, left + wide + 4, label.y + high + 2))


def _pieces(points: FloatArray) -> list[FloatArray]:
    """Boxes (4,) along the outline of a shape, or along a line."""
    found = []
    for start, end in pairwise(np.vstack((points, points[:1]))):
        count = max(int(np.hypot(*(end - start)) / 12), 1)
        along = start + np.linspace(0, 1, count + 1)[:, None] * (end - start)
        found += [np.concatenate((np.minimum(a, b), np.maximum(a, b))) for a, b in pairwise(along)]
    return found


def _meet(a: FloatArray, b: FloatArray) -> bool:
    return bool((a[:2] <= b[2:]).all() and (b[:2] <= a[2:]).all())


def _dimensions(facets: Facets, view: _View) -> Iterator[Shape | Label]:
    """The display's width over it, and its depth or height to its right."""
    flat = view.at(facets.corners)
    (x0, y0), (x1, y1) = flat.min(axis=0), flat.max(axis=0)
    world = np.ptp(facets.corners, axis=0)
    across, down = (float(world[axis]) for axis in view.axes)
    room = 48 if view.axes == (0, 2) and facets.count <= _NAMED else 24
    if x1 - x0 > 1:
        yield from _arrow(np.array((x0, y0 - room)), np.array((x1, y0 - room)))
        yield Label((x0 + x1) / 2, y0 - room - 12, 14, f"{_metres(across)} m", _INK, "middle")
    if y1 - y0 > 1:
        aside = x1 + room + 30 * (room > 24)
        yield from _arrow(np.array((aside, y0)), np.array((aside, y1)))
        yield Label(aside + 10, (y0 + y1) / 2, 14, f"{_metres(down)} m", _INK, "start")
    low = float(facets.corners[:, 1].min())
    if view.axes == (0, 1) and low > 1e-6:
        ground = y1 + low * view.scale
        yield from _arrow(np.array((x1 + 24, y1)), np.array((x1 + 24, ground)))
        yield Label(x1 + 34, (y1 + ground) / 2, 14, f"{_metres(low)} m", _FAINT, "start")


def _viewer(stand: Stand, view: _View) -> tuple[list[Shape], Label]:
    """The eye and the line along which it looks; and how far off, or how high, it is."""
    eye, aim = view.at(np.array([stand.eye, stand.look_at]))
    turn = np.linspace(0, 2 * math.pi, 24, endpoint=False)
    shapes = [Shape(eye + 7 * np.column_stack((np.cos(turn), np.sin(turn))), _EYE, _EYE, 1)]
    words = f"eye, {_metres(stand.eye[1])} m up"
    if view.axes == (0, 2):
        shapes.insert(0, _line(eye, aim, _EYE, 1))
        words = f"eye, {_metres(math.dist(stand.eye, stand.look_at))} m from what is looked at"
    return shapes, Label(float(eye[0]) + 14, float(eye[1]) + 14, 14, words, _EYE, "start")


def _arrow(a: FloatArray, b: FloatArray) -> Iterator[Shape]:
    """A line of dimension with a stroke across each end."""
    yield _line(a, b, _FAINT, 1.2)
    along = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
    across = 5 * np.array((-along[1], along[0]))
    yield _line(a - across, a + across, _FAINT, 1.2)
    yield _line(b - across, b + across, _FAINT, 1.2)


def _line(a: FloatArray, b: FloatArray, color: str, width: float) -> Shape:
    return Shape(np.array((a, b)), color, color, width)


def _metres(value: float) -> str:
    """Metres to a millimetre."""
    return f"{value:.3f}".rstrip("0").rstrip(".")
