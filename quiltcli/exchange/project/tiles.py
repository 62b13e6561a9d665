"""The pixels of a facet, tile by tile, each the mean of a picture over what the pixel sees of it.

A pixel should average the picture over its own footprint, a parallelogram whose sides are the derivatives
of the place along the page. The kernel that goes between texels has done a part of that, and variances add
up, as in Heckbert's resampling filter ("Fundamentals of Texture Mapping and Image Warping", 1989). So for a
side of s texels

    s ≤ 1        the picture is magnified: Catmull and Rom's cubic, whose variance is 0;
    s ≤ √2       a cubic of variance (s² − 1) / 6;
    s > √2       a tent, whose variance of 1/6 is that of a box of √2, under a box of √(s² − 2) texels, taken
                 as the mean of ⌈s / √2⌉ samples,

and nothing jumps where one becomes the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.exchange.project.lenses import Lens, Place
from quiltcli.exchange.project.sights import Rays, directions_at, moved, slopes_at
from quiltcli.exchange.project.texels import Texels
from quiltcli.geometry import Float32Array, FloatArray

TILE = (128, 64)
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
    nx, ny = _counts(window, rays, lens)
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
        light = _boxed(window, rays, lens, texels, d, (nx, ny))
    return light.reshape(height, width, 4)


def directions(window: Window, rays: Rays) -> FloatArray:
    """Directions (3, h, w) of the pixels' centres."""
    return directions_at(rays, *window.centres())


def _counts(window: Window, rays: Rays, lens: Lens) -> tuple[int, int]:
    """Samples across and down for the longest steps in texels at 5 × 5 places over a window."""
    x = np.linspace(window.x0 + 0.5, window.x1 - 0.5, 5)
    y = np.linspace(window.y0 + 0.5, window.y1 - 0.5, 5)[:, None]
    d = directions_at(rays, x, y)
    inside = lens.place(d).inside
    if not inside.any():
        inside[:] = True  # only a corner of the picture lies between these places
    steps = (lens.steps(d, slope) for slope in slopes_at(rays, x, y))
    x_side, y_side = (float(np.hypot(step.x, step.y)[inside].max()) for step in steps)
    return _samples(x_side), _samples(y_side)


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
) -> Float32Array:
    """Mean light (P, 4) of samples over the pixels' boxes."""
    spread = []
    slopes = slopes_at(rays, *window.centres())
    for slope in slopes:
        step = lens.steps(d, slope)
        square = np.maximum(step.x * step.x + step.y * step.y, 1e-30)
        spread.append(np.sqrt(np.clip(1 - _TENT2 / square, 0, 1)))
    light = np.zeros((d[0].size, 4), dtype=np.float32)
    for j in range(count[1]):
        down = ((j + 0.5) / count[1] - 0.5) * spread[1]
        for i in range(count[0]):
            across = ((i + 0.5) / count[0] - 0.5) * spread[0]
            place = lens.place(moved(d, slopes, across, down).reshape(3, -1))
            one = texels.linear(place)
            if not place.inside.all():
                one *= place.inside[:, None]
            light += one
    light *= np.float32(1 / (count[0] * count[1]))
    return light


def places(window: Window, rays: Rays, lens: Lens) -> Place:
    """Where the centres of a window's pixels lie in the picture, (h, w)."""
    return lens.place(directions(window, rays))
