"""The pixels of a facet, tile by tile, each the mean of a picture over what the pixel sees of it.

A pixel should average the picture over its own footprint, a parallelogram whose sides are the derivatives
of the place along the page. The kernel that goes between texels has done a part of that, and variances add
up, as in Heckbert's resampling filter ("Fundamentals of Texture Mapping and Image Warping", 1989). So for a
side of s texels

    s ≤ 1        the picture is magnified: Catmull and Rom's cubic, whose variance is 0;
    s ≤ √2       a cubic of variance (s² − 1) / 6;
    s > √2       a tent, whose variance of 1/6 is that of a box of √2, under a box of √(s² − 2) texels, taken
                 as the mean of ⌈s / √2⌉ samples,

and nothing jumps where one becomes the other. Where both sides run along one direction of the picture, as
near the pole of a panorama, samples on a grid of sides repeat one another: there the box is that square of
the pixel whose sides are mapped to the axes of the ellipse of the same variances, which needs as many
samples as the ellipse is long. All squares have the same variance in all directions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.exchange.project.lenses import Lens, Place, Steps
from quiltcli.exchange.project.sights import Rays, directions_at, moved, slopes_at
from quiltcli.exchange.project.texels import Texels
from quiltcli.geometry import Float32Array, FloatArray

TILE = (128, 32)  # whose arrays of four floats a pixel are 64 KB: the system takes back larger ones
MOST = 16  # samples a side: beyond them a picture is noise, but for poles, where it hardly changes
_SPLIT = 16  # pixels: tiles are not cut smaller
_TENT2 = 2.0  # square of the width of the box whose variance is a tent's


@dataclass(frozen=True)
class Window:
    """Pixels [x0, x1) × [y0, y1) of a page."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.x1 - self.x0, self.y1 - self.y0

    def centres(self) -> tuple[FloatArray, FloatArray]:
        """Centres of its pixels: (w,) across and (h, 1) down."""
        x, y = (np.arange(a, b, dtype=np.float64) for a, b in ((self.x0, self.x1), (self.y0, self.y1)))
        return x + 0.5, y[:, None] + 0.5

    def tiles(self, across: int, down: int) -> Iterator[Window]:
        """Windows of at most so many pixels that make it up."""
        for y in range(self.y0, self.y1, down):
            for x in range(self.x0, self.x1, across):
                yield Window(x, y, min(x + across, self.x1), min(y + down, self.y1))


def tile_light(window: Window, rays: Rays, lens: Lens, texels: Texels) -> Float32Array:
    """Light (h, w, 4) of a window's pixels, premultiplied; alpha is the share that the picture shows.

    Args:
        window: pixels of a page.
        rays: page pixel → direction from the eye.
        lens: where directions lie in the picture.
        texels: the picture.
    """
    width, height = window.size
    d = directions(window, rays)
    place = lens.place(d.reshape(3, -1))
    if not place.inside.any():
        return np.zeros((height, width, 4), dtype=np.float32)
    nx, ny, turned = _counts(window, rays, lens)
    if nx * ny > 4 and min(width, height) > _SPLIT:
        light = np.empty((height, width, 4), dtype=np.float32)
        for part in window.tiles(-(-width // 2), -(-height // 2)):
            rows = slice(part.y0 - window.y0, part.y1 - window.y0)
            light[rows, part.x0 - window.x0 : part.x1 - window.x0] = tile_light(part, rays, lens, texels)
        return light
    if nx * ny == 1:
        blur = _blur(window, rays, lens)
        light = texels.cubic(place, blur)
        if not place.inside.all():
            light *= place.inside[:, None]
    else:
        light = _boxed(window, rays, lens, texels, d, (nx, ny), turned=turned)
    return light.reshape(height, width, 4)


def directions(window: Window, rays: Rays) -> FloatArray:
    """Directions (3, h, w) of the pixels' centres."""
    return directions_at(rays, *window.centres())


def _counts(window: Window, rays: Rays, lens: Lens) -> tuple[int, int, bool]:
    """Samples across and down for the longest steps in texels at 5 × 5 places over a window.

    And whether they are along the axes of the pixels' ellipses, where that takes fewer.
    """
    x = np.linspace(window.x0 + 0.5, window.x1 - 0.5, 5)
    y = np.linspace(window.y0 + 0.5, window.y1 - 0.5, 5)[:, None]
    d = directions_at(rays, x, y)
    inside = lens.place(d).inside
    if not inside.any():
        inside[:] = True  # only a corner of the picture lies between these places
    across, down = (lens.steps(d, slope) for slope in slopes_at(rays, x, y))
    sides = [_samples(float(np.hypot(step.x, step.y)[inside].max())) for step in (across, down)]
    _, long, short = _ellipses(across, down)
    axes = [_samples(float(np.sqrt(axis[inside].max()))) for axis in (long, short)]
    turned = axes[0] * axes[1] < sides[0] * sides[1]
    nx, ny = axes if turned else sides
    return nx, ny, turned


def _ellipses(across: Steps, down: Steps) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of pixels' footprints the angle (...) on the page of what is longest in the picture, and both axes².

    The steps are columns of a matrix; these are its right singular vectors and the squares of its values.
    """
    p, q = across.x**2 + across.y**2, down.x**2 + down.y**2
    r = across.x * down.x + across.y * down.y
    apart = np.sqrt((p - q) ** 2 + 4 * r * r)
    return np.arctan2(2 * r, p - q) / 2, (p + q + apart) / 2, np.maximum((p + q - apart) / 2, 0.0)


def _samples(side: float) -> int:
    return int(np.clip(np.ceil(side / np.sqrt(_TENT2) - 1e-6), 1, MOST)) if np.isfinite(side) else MOST


def _blur(window: Window, rays: Rays, lens: Lens) -> tuple[float, float]:
    """B of the cubics across and down the picture, for the middle of a window."""
    x, y = np.array([(window.x0 + window.x1) / 2]), np.array([(window.y0 + window.y1) / 2])
    d = directions_at(rays, x, y)
    across, down = (lens.steps(d, slope) for slope in slopes_at(rays, x, y))
    sizes = (np.hypot(across.x, down.x)[0], np.hypot(across.y, down.y)[0])
    blur = [float(np.clip((size * size - 1) / 2, 0, 0.5)) for size in sizes]
    return blur[0], blur[1]


def _boxed(
    window: Window,
    rays: Rays,
    lens: Lens,
    texels: Texels,
    d: FloatArray,
    count: tuple[int, int],
    *,
    turned: bool,
) -> Float32Array:
    """Mean light (P, 4) of samples over the pixels' boxes, with sides along the page, or turned."""
    slopes = slopes_at(rays, *window.centres())
    across, down = (lens.steps(d, slope) for slope in slopes)
    cos = sin = across.x
    if turned:
        angle, *squares = _ellipses(across, down)
        cos, sin = np.cos(angle), np.sin(angle)
    else:
        squares = [step.x * step.x + step.y * step.y for step in (across, down)]
    spread = [np.sqrt(np.clip(1 - _TENT2 / np.maximum(square, 1e-30), 0, 1)) for square in squares]
    light = np.zeros((d[0].size, 4), dtype=np.float32)
    for j in range(count[1]):
        second = ((j + 0.5) / count[1] - 0.5) * spread[1]
        for i in range(count[0]):
            first = ((i + 0.5) / count[0] - 0.5) * spread[0]
            x, y = (first * cos - second * sin, first * sin + second * cos) if turned else (first, second)
            place = lens.place(moved(d, slopes, x, y).reshape(3, -1))
            one = texels.linear(place)
            if not place.inside.all():
                one *= place.inside[:, None]
            light += one
    light *= np.float32(1 / (count[0] * count[1]))
    return light


def places(window: Window, rays: Rays, lens: Lens) -> Place:
    """Where the centres of a window's pixels lie in the picture, (h, w)."""
    return lens.place(directions(window, rays))
