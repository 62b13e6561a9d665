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
        x, y = np.clip(place.x, 0, width) - 0.5, np.clip(place.y, 0, height) - 0.5
        left, top = np.floor(x), np.floor(y)
        start = MARGIN + 1 - reach
        row = top.astype(np.int64) + start
        if place.face is not None:
            row += place.face * self.height
        return row * self.width + (left.astype(np.int64) + start), x - left, y - top

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
        across = [_wide(weight) for weight in cubic_weights(tx, blur[0])]
        light = np.zeros((at.size, 4), dtype=np.float32)
        # Into buffers that are there: whole rows of four numbers in one run is what this is fast by.
        line, texel = np.empty_like(light), np.empty_like(light)
        for row, weight in enumerate(cubic_weights(ty, blur[1])):
            start = at + row * self.width
            self.light.take(start, axis=0, out=line, mode="clip")
            line *= across[0]
            for column in (1, 2, 3):
                self.light.take(start + column, axis=0, out=texel, mode="clip")
                texel *= across[column]
                line += texel
            line *= _wide(weight)
            light += line
        # Its lobes dip below black beside what is bright, and rise above that.
        return np.clip(light, 0, MOST_HALF, out=light)


def _wide(weight: FloatArray) -> Float32Array:
    """A weight (P,) once for each channel (P, 4)."""
    return np.repeat(weight.astype(np.float32), 4).reshape(-1, 4)


def cubic_weights(t: FloatArray, b: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Weights of four texels for a place `t` (P,) after the second: Mitchell & Netravali's cubics.

    Of "Reconstruction Filters in Computer Graphics" (1988), with their 2C = 1 − B, of which B = 0 is Catmull
    and Rom's, which goes through the texels. The variance is B / 3.
    """
    c = (1 - b) / 2

    def near(x: FloatArray) -> FloatArray:
        result: FloatArray = (((12 - 9 * b - 6 * c) * x + (-18 + 12 * b + 6 * c)) * x * x + (6 - 2 * b)) / 6
        return result

    def far(x: FloatArray) -> FloatArray:
        inner = (-b - 6 * c) * x + (6 * b + 30 * c)
        result: FloatArray = ((inner * x + (-12 * b - 48 * c)) * x + (8 * b + 24 * c)) / 6
        return result

    return far(1 + t), near(t), near(1 - t), far(2 - t)


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
