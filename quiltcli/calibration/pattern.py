"""Test patterns: pictures that show which facet is which, which way up, and where its last pixel is.

A pattern is drawn in a facet's own raster, upright, and carried to the quilt pixel by pixel. What a
technician sees upside down, mirrored or a pixel short on the display is so because of the wiring.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.calibration.markers import MarkerSet, draw_markers
from quiltcli.formats.drawing.font import HEIGHT, text_mask, text_width
from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.images.facets import facet_image
from quiltcli.layout import Layout

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
RED, GREEN, YELLOW = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)
_GREY = 0.18
_HUES = ((1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1))


@dataclass(frozen=True)
class Piece:
    """What a pattern is drawn on: one facet's raster.

    Attributes:
        facet: id, 1-based.
        name: empty when there is none.
        size: W, H pixels.
        polygon: (n, 2) corners in facet pixels.
        inside: (H, W) pixels that belong to the facet.
        step: pixels between lines of a grid, and a field of a checker.
        markers: what is on the display, for the pattern `markers`.
    """

    facet: int
    name: str
    size: tuple[int, int]
    polygon: FloatArray
    inside: BoolArray
    step: int
    markers: MarkerSet | None = None

    @cached_property
    def border(self) -> BoolArray:
        """The facet's outermost pixels (H, W): inside, with one of their four neighbours outside."""
        around = np.pad(self.inside, 1)
        kept = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
        result: BoolArray = self.inside & ~kept
        return result


def piece(
    layout: Layout,
    row: int,
    owners: NDArray[np.integer[Any]],
    name: str = "",
    step: int = 32,
    markers: MarkerSet | None = None,
) -> Piece:
    """The raster of the facet in this row of the layout; `owners` are `pixel_owners(layout)`."""
    here = facet_image({"id": owners}, layout, row, owners)["id"] == layout.facet[row]
    width, height = layout.size[row]
    polygon = layout.outline(row)
    return Piece(int(layout.facet[row]), name, (int(width), int(height)), polygon, here, step, markers)


def draw(kind: str, piece: Piece) -> Float32Array:
    """The pattern `kind` (`MARKERS`, or a key of `KINDS`) of a facet, (H, W, 3) float32, 0 to 1.

    Outside the polygon it is 0.
    """
    width, height = piece.size
    image = np.zeros((height, width, 3), dtype=np.float32)
    if kind == MARKERS and piece.markers is not None:
        draw_markers(piece.markers, piece.facet, image)
    else:
        KINDS[kind](piece, image)
    image[~piece.inside] = 0
    return image


def _identify(piece: Piece, image: Float32Array) -> None:
    """Border, id, name, corner letters, and a mark that no turn and no mirror leaves as it is."""
    image[:] = facet_color(piece.facet)
    image[piece.border] = WHITE
    centre, radius = roomiest(piece.polygon)
    half = radius * math.sqrt(0.5)  # of the square inside the circle
    if piece.name:
        _write(image, piece.name, centre + (0, 0.7 * half), (1.7 * half, 0.5 * half), YELLOW)
    _write(image, str(piece.facet), centre + (0, 0.05 * half), (1.6 * half, 0.75 * half), WHITE)
    _flag(image, centre - (0, 0.68 * half), 0.6 * half)
    for at, corner in enumerate(piece.polygon):
        size = letter_size(corner, centre, radius)
        _write(image, corner_letter(at), beside_corner(piece.polygon, at, size), (size, size), GREEN)


def _mark(piece: Piece, image: Float32Array) -> None:
    """The flag alone, as large as it fits."""
    image[piece.border] = WHITE
    centre, radius = roomiest(piece.polygon)
    _flag(image, centre, 1.3 * radius)


def _border(piece: Piece, image: Float32Array) -> None:
    image[piece.border] = WHITE


def _grid(piece: Piece, image: Float32Array) -> None:
    """Lines a pixel wide, from the raster's first row and column on, in front of grey; every tenth yellow."""
    image[:] = _GREY / 4
    for step, color in ((piece.step, WHITE), (10 * piece.step, YELLOW)):
        image[::step] = color
        image[:, ::step] = color
    image[piece.border] = RED


def _checker(piece: Piece, image: Float32Array) -> None:
    """Fields of `step` pixels; the raster's top-left one is white."""
    width, height = piece.size
    odd = np.arange(height)[:, None] // piece.step + np.arange(width) // piece.step
    image[odd % 2 == 0] = WHITE


def _gradient(piece: Piece, image: Float32Array) -> None:
    """Red is (i + ½)/W, green (j + ½)/H at pixel (i, j), to the last bit of float32; blue is 0."""
    width, height = piece.size
    image[:, :, 0] = (np.arange(width) + 0.5) / width
    image[:, :, 1] = ((np.arange(height) + 0.5) / height)[:, None]


def _white(piece: Piece, image: Float32Array) -> None:
    image[:] = WHITE


KINDS: dict[str, Callable[[Piece, Float32Array], None]] = {
    "id": _identify,
    "marker": _mark,
    "border": _border,
    "grid": _grid,
    "checker": _checker,
    "gradient": _gradient,
    "white": _white,
}
"""Every pattern: what draws it on the (H, W, 3) image of a facet, which starts black."""


MARKERS = "markers"
"""The pattern that a camera reads; it needs the display, and OpenCV for its dictionaries."""


def facet_color(facet: int) -> tuple[float, float, float]:
    """A dark colour, far from that of the facets before and after."""
    place = (facet * 0.6180339887) % 1 * len(_HUES)
    low, part = int(place), place % 1
    a, b = _HUES[low], _HUES[(low + 1) % len(_HUES)]
    red, green, blue = (0.06 + 0.24 * (x + (y - x) * part) for x, y in zip(a, b, strict=True))
    return red, green, blue


def corner_letter(at: int) -> str:
    """A to Z, then AA, AB …: the name of a polygon's corner, in the order of the mesh face."""
    letter = chr(ord("A") + at % 26)
    return letter if at < 26 else corner_letter(at // 26 - 1) + letter


def letter_size(corner: FloatArray, centre: FloatArray, radius: float) -> float:
    """Height of a corner's letter on a facet whose roomiest circle is this, pixels."""
    return min(0.3 * radius, 0.25 * float(np.hypot(*(centre - corner))))


def beside_corner(polygon: FloatArray, at: int, size: float) -> FloatArray:
    """Centre (2,) of a letter of this size in a corner of a polygon: on the bisector, clear of both sides.

    In a corner too sharp for that it stays within three letters of the tip.
    """
    corner = polygon[at]
    sides = np.stack((polygon[at - 1] - corner, polygon[(at + 1) % len(polygon)] - corner))
    sides = sides / np.maximum(np.hypot(sides[:, 0], sides[:, 1]), 1e-12)[:, None]
    x, y = polygon.T
    way = math.copysign(1, float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()))
    # From the side behind to the side ahead, through the inside.
    angle = math.atan2(sides[1, 0] * sides[0, 1] - sides[1, 1] * sides[0, 0], float(sides[0] @ sides[1]))
    half = (angle * way) % (2 * math.pi) / 2
    cos, sin = math.cos(half * way), math.sin(half * way)
    inward = np.array((cos * sides[1, 0] - sin * sides[1, 1], sin * sides[1, 0] + cos * sides[1, 1]))
    result: FloatArray = corner + inward * min(0.9 * size / max(math.sin(half), 1e-9), 3 * size)
    return result


def _write(
    image: Float32Array,
    text: str,
    centre: FloatArray,
    room: tuple[float, float],
    color: tuple[float, float, float],
) -> None:
    """Text as large as the room (width, height) lets it be; none when not even single dots fit."""
    scale = int(min(room[0] / text_width(text), room[1] / HEIGHT))
    if scale > 0:
        _stamp(image, text_mask(text, scale), centre, color)


def _flag(image: Float32Array, centre: FloatArray, size: float) -> None:
    """An arrow up with a red pennant to its right: no turn and no mirror image of it looks the same."""
    half = int(size / 2)
    if half < 3:
        return
    j, i = np.mgrid[-half : half + 1, -half : half + 1]
    thick = max(half // 8, 0)
    head = j <= -half + 2 * max(half // 3, 1)
    pole = np.where(head, 2 * np.abs(i) <= j + half, np.abs(i) <= thick)
    pennant = (i > thick) & (i <= half) & (j >= 0) & (j <= max(half // 2, 1))
    _stamp(image, pole, centre, WHITE)
    _stamp(image, pennant, centre, RED)


def _stamp(
    image: Float32Array, mask: BoolArray, centre: FloatArray, color: tuple[float, float, float]
) -> None:
    """Colour the mask's pixels, centred as well as whole pixels allow and cut at the image's border."""
    height, width = mask.shape
    x, y = math.floor(centre[0] - width / 2 + 0.5), math.floor(centre[1] - height / 2 + 0.5)
    left, top = max(-x, 0), max(-y, 0)
    part = mask[top : max(image.shape[0] - y, 0), left : max(image.shape[1] - x, 0)]
    image[y + top : y + top + part.shape[0], x + left : x + left + part.shape[1]][part] = color


def roomiest(polygon: FloatArray) -> tuple[FloatArray, float]:
    """Centre and radius of about the largest circle inside a polygon (n, 2), tried on a small grid."""
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21)), axis=-1).reshape(-1, 2)
    points = np.concatenate((polygon.mean(axis=0)[None], low + grid * (high - low)))
    a, b = polygon, np.roll(polygon, -1, axis=0)
    run, away = b - a, points[:, None] - a
    along = (away * run).sum(axis=2) / np.maximum((run * run).sum(axis=1), 1e-12)
    nearest = away - np.clip(along, 0, 1)[..., None] * run
    distance = np.sqrt((nearest * nearest).sum(axis=2).min(axis=1))
    distance[~_within(points, a, b)] = 0
    best = int(np.round(distance, 6).argmax())
    return points[best], float(distance[best])


def _within(points: FloatArray, a: FloatArray, b: FloatArray) -> BoolArray:
    """Points (m,) inside the polygon with edges a to b, by the even-odd rule."""
    x, y = points[:, :1], points[:, 1:]
    rise = b[:, 1] - a[:, 1]
    passes = (a[:, 1] <= y) != (b[:, 1] <= y)
    cut = a[:, 0] + (y - a[:, 1]) / np.where(rise == 0, 1, rise) * (b[:, 0] - a[:, 0])
    result: BoolArray = (passes & (x >= cut)).sum(axis=1) % 2 == 1
    return result
