"""Texels of a picture with a margin, looked up through kernels that fit the local stretch.

The margin of two texels holds what lies beyond an edge: the other side of a panorama, the neighbouring faces
of a cube, or the edge again. So no look-up asks whether it is inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.channels import MOST_HALF
from quiltcli.exchange.project.lenses import Cube, Lens, Place
from quiltcli.geometry import Float32Array, FloatArray, IntArray

MARGIN = 2


@dataclass(frozen=True)
class Texels:
    """Pictures, one after another, as flat rows.

    Attributes:
        light: (n, 4) float32, premultiplied.
        width: of a row with its margins, texels.
        height: of a picture with its margins.
        size: width and height of a picture without.
    """

    light: Float32Array
    width: int
    height: int
    size: tuple[int, int]

    def first(self, place: Place, reach: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """Address of the first texel of a kernel, and where in it the place lies, 0 to 1 each.

        Args:
            place: where.
            reach: texels of the kernel before the place: 1 of a tent, 2 of a cubic.
        """
        width, height = self.size
        # Counted from the margin's first texel nothing is negative, and cutting off is rounding down.
        x, y = np.clip(place.x, 0, width), np.clip(place.y, 0, height)
        x += MARGIN + 0.5 - reach
        y += MARGIN + 0.5 - reach
        left, row = x.astype(np.int64), y.astype(np.int64)
        x -= left
        y -= row
        if place.face is not None:
            row += place.face * self.height
        row *= self.width
        row += left
        return row, x, y

    def linear(self, place: Place) -> Float32Array:
        """Light (P, 4) between the four texels around."""
        at, tx, ty = self.first(place, 1)
        right, below = _wide(tx), _wide(ty)
        upper = self._between(at, right)
        lower = self._between(at + self.width, right)
        lower -= upper
        lower *= below
        upper += lower
        return upper

    def _between(self, at: IntArray, right: Float32Array) -> Float32Array:
        """Light (P, 4) between a texel and the one after it."""
        left, step = self.light.take(at, axis=0), self.light.take(at + 1, axis=0)
        step -= left
        step *= right
        left += step
        return left

    def cubic(self, place: Place, blur: tuple[float, float]) -> Float32Array:
        """Light (P, 4) by cubics over the 16 texels around; `blur` is B of the kernels across and down."""
        at, tx, ty = self.first(place, 2)
        across = cubic_weights(_wide(tx), blur[0])
        light = np.zeros((at.size, 4), dtype=np.float32)
        # Into buffers that are there: whole rows of four numbers in one run is what this is fast by.
        line, texel = np.empty_like(light), np.empty_like(light)
        for row, weight in enumerate(cubic_weights(_wide(ty), blur[1])):
            start = at + row * self.width
            self.light.take(start, axis=0, out=line, mode="clip")
            line *= across[0]
            for column in (1, 2, 3):
                self.light.take(start + column, axis=0, out=texel, mode="clip")
                texel *= across[column]
                line += texel
            line *= weight
            light += line
        # Its lobes dip below black beside what is bright, and rise above that.
        return np.clip(light, 0, MOST_HALF, out=light)


def _wide(share: FloatArray) -> Float32Array:
    """A number (P,) once for each channel (P, 4)."""
    wide = np.empty((share.size, 4), dtype=np.float32)
    wide[...] = share[:, None]
    return wide


def cubic_weights(t: Float32Array, b: float) -> tuple[Float32Array, ...]:
    """Weights of four texels for places `t` (...) after the second: Mitchell & Netravali's cubics.

    Of "Reconstruction Filters in Computer Graphics" (1988), with their 2C = 1 − B, of which B = 0 is Catmull
    and Rom's, which goes through the texels. The variance is B / 3. Their pieces are multiplied out in t, by
    the texel; the weights sum to 1.
    """
    c = (1 - b) / 2
    before = _cubic(t, b / 6, -b / 2 - c, b / 2 + 2 * c, -b / 6 - c)
    own = _cubic(t, 1 - b / 3, 0.0, -3 + 2 * b + c, 2 - 1.5 * b - c)
    last = _cubic(t, 0.0, 0.0, -c, b / 6 + c)
    following = 1 - before
    following -= own
    following -= last
    return before, own, following, last


def _cubic(t: Float32Array, c0: float, c1: float, c2: float, c3: float) -> Float32Array:
    """A polynomial of t, by Horner's rule."""
    value = t * c3
    for c in (c2, c1):
        value += c
        value *= t
    value += c0
    return value


def texels(pictures: list[Float32Array], lens: Lens) -> Texels:
    """Pictures (H, W, 4) of a lens with their margins; one, or the six faces of a cube."""
    height, width = pictures[0].shape[:2]
    m = MARGIN
    light = np.zeros((len(pictures), height + 2 * m, width + 2 * m, 4), dtype=np.float32)
    for inner, picture in zip(light, pictures, strict=True):
        # No number and too bright a one would spread over their neighbours.
        np.fmax(picture, 0, out=inner[m:-m, m:-m])
        np.minimum(inner, MOST_HALF, out=inner)
        if lens.wraps == "sphere":
            _around(inner)
        else:
            inner[m:-m, :m], inner[m:-m, -m:] = inner[m:-m, m : m + 1], inner[m:-m, -m - 1 : -m]
            inner[:m], inner[-m:] = inner[m], inner[-m - 1]
    found = Texels(light.reshape(-1, 4), width + 2 * m, height + 2 * m, (width, height))
    if isinstance(lens, Cube):
        _neighbours(light, found, lens)
    return found


def _around(inner: Float32Array) -> None:
    """The margins of a panorama: the other side, and beyond a pole the opposite longitude."""
    m = MARGIN
    inner[m:-m, :m], inner[m:-m, -m:] = inner[m:-m, -2 * m : -m], inner[m:-m, m : 2 * m]
    width = inner.shape[1] - 2 * m
    opposite = np.roll(inner[:, m:-m], width // 2, axis=1)
    for k in range(m):
        for to, since in ((m - 1 - k, m + k), (-m + k, -m - 1 - k)):
            inner[to, m:-m] = opposite[since]
            inner[to, :m], inner[to, -m:] = inner[to, -2 * m : -m], inner[to, m : 2 * m]


def _neighbours(light: Float32Array, found: Texels, lens: Cube) -> None:
    """The margins of a cube's faces: what their neighbours show in the directions of these texels."""
    m, side = MARGIN, lens.side
    y, x = np.arange(light.shape[1])[:, None], np.arange(light.shape[2])
    margin = (x < m) | (x >= side + m) | (y < m) | (y >= side + m)
    rows, columns = np.nonzero(margin)
    across, down = (columns - m + 0.5) / side * 2 - 1, (rows - m + 0.5) / side * 2 - 1
    ones = np.ones_like(across)
    filled = np.empty((6, across.size, 4), dtype=np.float32)
    for face in range(6):
        # Of in_face the inverse: right, up, ahead of what lies across, down and 1 deep.
        local = (
            (ones, -down, -across),
            (-ones, -down, across),
            (across, ones, down),
            (across, -ones, -down),
            (across, -down, ones),
            (-across, -down, -ones),
        )[face]
        world = np.einsum("ij,i...->j...", lens.axes, np.stack(local))
        filled[face] = found.linear(lens.place(world))
    for face in range(6):
        light[face][margin] = filled[face]
