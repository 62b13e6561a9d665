"""Looking textures up: bilinear between texels, linear between levels, anisotropic along footprints.

Single precision throughout, by operations that are rounded alike on every machine: roots and products, no
logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, Int32Array, IntArray, slices
from quiltcli.scene.textures.pool import Textures
from quiltcli.shading.textures.ellipse import between_levels, ellipses

_CHUNK = 1 << 14  # places that fit the cache
_ONE, _HALF = np.float32(1), np.float32(0.5)
# Of numbers for how places are filtered.
_TWO_LEVELS, _WRAP, _NEAREST = np.uint16(128), np.uint16(256), np.uint16(16 * 256)
# A half float's bits, moved to where a single's are, are its value times 2⁻¹¹². The weights make up for it:
# a product of two small numbers would be denormal, which is ten times as slow.
_SCALE = np.float32(2.0**112)


def look_up(
    textures: Textures,
    image: Int32Array,
    u: Float32Array,
    v: Float32Array,
    slopes: Float32Array,
    channels: tuple[int, ...],
) -> Float32Array:
    """Filtered texels at n places.

    Args:
        textures: the textures.
        image: (n,) which image, or (1,) for all.
        u: (n,) place in it, from 0 to 1 from its left edge to its right.
        v: (n,) from its upper edge to its lower.
        slopes: (4, n) ∂u/∂x, ∂u/∂y, ∂v/∂x and ∂v/∂y over the pixel.
        channels: which of red, green, blue and alpha (0 to 3).

    Returns:
        (channels, n).
    """
    result = np.empty((len(channels), u.size), dtype=np.float32)
    for part in slices(0, u.size, _CHUNK):
        some = image if image.size == 1 else image[part]
        _filtered(textures, some, u[part], v[part], slopes[:, part], channels, result[:, part])
    return result


@dataclass
class _Levels:
    """The levels of some places: arrays (n,), or numbers where all have one."""

    first: IntArray
    stride: IntArray
    width: Float32Array
    height: Float32Array


def _levels(textures: Textures, rows: IntArray) -> _Levels:
    first, stride = textures.first.take(rows), textures.stride.take(rows)
    return _Levels(first, stride, textures.width.take(rows), textures.height.take(rows))


def _filtered(
    textures: Textures,
    image: Int32Array,
    u: Float32Array,
    v: Float32Array,
    slopes: Float32Array,
    channels: tuple[int, ...],
    out: Float32Array,
) -> None:
    """As `look_up`, of places that fit the cache, into `out`."""
    base = textures.start.take(image).astype(np.int64)
    last = textures.start.take(image + 1) - 1 - base
    wrap = textures.wrap.take(image, axis=0)
    wide, high = textures.width.take(base), textures.height.take(base)
    seen = ellipses(slopes, wide, high, textures.anisotropy)
    near, share = between_levels(seen.level, last)
    near += base
    # All that are filtered alike together: places that show texels enlarged, others by how many places along
    # the ellipse they look at, and whether in one level or in two.
    kind = seen.places + _TWO_LEVELS * (share > 0)
    kind += _WRAP * (3 * wrap[:, 0] + wrap[:, 1]).astype(np.uint16)
    if textures.nearest is not None:
        kind += _NEAREST * (textures.nearest.take(image) & (seen.places == 0))
    count = np.bincount(kind)
    present = np.flatnonzero(count).tolist()
    order = np.argsort(kind, kind="stable") if len(present) > 1 else np.arange(kind.size)
    end = 0
    for which in present:
        start, end = end, end + int(count[which])
        some = order[start:end] if len(present) > 1 else slice(None)
        squares, code = divmod(which, int(_NEAREST))
        code, rest = divmod(code, int(_WRAP))
        two, places = divmod(rest, int(_TWO_LEVELS))
        along = _Along(u[some], v[some], divmod(code, 3))
        if places > 1:
            du, dv = seen.axes(some)
            along.du = du / (wide if wide.size == 1 else wide[some])
            along.dv = dv / (high if high.size == 1 else high[some])
        rows = near[some]
        weight = _SCALE / np.float32(max(places, 1))
        weighted: list[tuple[_Levels, Any]] = [(_levels(textures, rows), weight)]
        if two:
            part = share[some] * weight
            weighted = [(weighted[0][0], weight - part), (_levels(textures, rows + 1), part)]
        along.squares = bool(squares)
        for k, values in enumerate(_sum(textures, along, max(places, 1), weighted, channels)):
            out[k, some] = values


@dataclass
class _Along:
    """Places and the longer axes of their ellipses, with how the texture goes on along u and v.

    Where its texels are `squares`, they are not blended.
    """

    u: Float32Array
    v: Float32Array
    wrap: tuple[int, int]
    du: Float32Array | None = None
    dv: Float32Array | None = None
    squares: bool = False

    def at(self, share: np.float32) -> tuple[Float32Array, Float32Array]:
        """Places so far along, from 0 to 1."""
        u, v = self.u, self.v
        if self.du is not None and self.dv is not None and share:
            u, v = u + share * self.du, v + share * self.dv
        return _WRAPPED[self.wrap[0]](u), _WRAPPED[self.wrap[1]](v)


def _repeated(u: Float32Array) -> Float32Array:
    return np.asarray(u - np.floor(u))


def _held(u: Float32Array) -> Float32Array:
    return np.clip(u, np.float32(0), _ONE)


def _mirrored(u: Float32Array) -> Float32Array:
    u = u - np.float32(2) * np.floor(u * _HALF)
    return np.asarray(_ONE - np.abs(_ONE - u))


_WRAPPED = (_repeated, _held, _mirrored)
"""By the rows of `pool.WRAPS`."""


def _sum(
    textures: Textures,
    along: _Along,
    places: int,
    levels: list[tuple[_Levels, Any]],
    channels: tuple[int, ...],
) -> list[Float32Array]:
    """Bilinear texels of some levels, by weights (n,) of these, at so many places along the ellipse."""
    total = [np.zeros(along.u.size, dtype=np.float32) for _ in channels]
    for place in range(places):
        u, v = along.at(np.float32((place + 0.5) / places - 0.5))
        for level, weight in levels:
            if along.squares:
                # The middle of a texel has the texel's own colour.
                u, v = (
                    (np.floor(each * size) + _HALF) / size
                    for each, size in ((u, level.width), (v, level.height))
                )
            _add_bilinear(textures.texels, level, u, v, weight, channels, total)
    return total


def _add_bilinear(
    texels: NDArray[np.uint64],
    level: _Levels,
    u: Float32Array,
    v: Float32Array,
    weight: Any,
    channels: tuple[int, ...],
    total: list[Float32Array],
) -> None:
    """Add to `total` what lies between the four texels around places (n,) of a level, times `weight`."""
    x, y = u * level.width, v * level.height
    x -= _HALF
    y -= _HALF
    column, row = np.floor(x), np.floor(y)
    x -= column
    y -= row
    index: IntArray = row.astype(np.int64)
    index *= level.stride
    index += level.first
    index += column.astype(np.int64)
    below = weight * y
    above = weight - below
    right = below * x
    left = below - right
    _add(texels, index + level.stride, left, channels, total)
    index += 1
    _add(texels, index + level.stride, right, channels, total)
    right = above * x
    left = above - right
    _add(texels, index, right, channels, total)
    index -= 1
    _add(texels, index, left, channels, total)


def _add(
    texels: NDArray[np.uint64],
    index: IntArray,
    weight: Float32Array,
    channels: tuple[int, ...],
    total: list[Float32Array],
) -> None:
    halves = texels.take(index, mode="wrap").view(np.uint16).reshape(-1, 4)
    for channel, values in zip(channels, total, strict=True):
        bits = halves[:, channel].astype(np.uint32)
        bits <<= np.uint32(13)
        part = bits.view(np.float32)
        part *= weight
        values += part
