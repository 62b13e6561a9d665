"""Looking textures up: bilinear between texels, trilinear between levels, anisotropic along footprints.

A pixel's footprint in a texture is an ellipse, the image of a circle by the Jacobian of the texture's
coordinates. Its axes are singular values; several places along the longer one, each as wide as the shorter,
fill it (Schilling, Knittel & Straßer 1996: Texram). Single precision throughout, by operations that are
rounded alike on every machine: roots and products, no logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, Int32Array, IntArray, slices
from quiltcli.scene.textures.pool import Textures

_CHUNK = 1 << 14  # places that fit the cache
_ONE, _HALF = np.float32(1), np.float32(0.5)
_MOST_STEP = np.float32(1e8)  # texels from pixel to pixel; the smallest level shows wherever it is more
_TINY = np.float32(1e-20)
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

    first: Any
    stride: Any
    width: Any
    height: Any


def _levels(textures: Textures, rows: NDArray[Any]) -> _Levels:
    return _Levels(*(getattr(textures, name).take(rows) for name in ("first", "stride", "width", "height")))


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
    base = textures.start.take(image)
    last = textures.start.take(image + 1) - 1
    wrap = textures.wrap.take(image, axis=0)
    wide, high = textures.width.take(base), textures.height.take(base)
    count, level, du, dv = _ellipse(slopes, wide, high, textures.anisotropy)
    # All that are filtered alike together: places that show texels enlarged, and others by how many
    # places along the ellipse they look at.
    kind = count + np.uint16(128) * (3 * wrap[:, 0] + wrap[:, 1]).astype(np.uint16)
    present = np.flatnonzero(np.bincount(kind))
    order = None if present.size == 1 else np.argsort(kind, kind="stable")
    end = 0
    for which in present.tolist():
        if order is None:
            some: Any = slice(None)
        else:
            start, end = end, end + int(np.count_nonzero(kind == which))
            some = order[start:end]
        code, places = divmod(which, 128)
        one = slice(None) if base.size == 1 else some
        rows = base[one]
        along = _Along(u[some], v[some], du[some], dv[some], divmod(code, 3))
        if not places:
            value = _sum(textures, along, 1, [(_levels(textures, rows), _SCALE)], channels)
        else:
            depth = np.minimum(level[some], (last - base)[one].astype(np.float32))
            whole = np.floor(depth)
            share = depth - whole
            near = rows + whole.astype(np.int32)
            far = np.minimum(near + 1, last[one])
            weight = share * (_SCALE / np.float32(places))
            both = [
                (_levels(textures, near), _SCALE / np.float32(places) - weight),
                (_levels(textures, far), weight),
            ]
            value = _sum(textures, along, places, both, channels)
        for k, values in enumerate(value):
            out[k, some] = values


def _ellipse(
    slopes: Float32Array, wide: Float32Array, high: Float32Array, most: int
) -> tuple[NDArray[np.uint16], Float32Array, Float32Array, Float32Array]:
    """How footprints are looked at.

    Args:
        slopes: (4, n) of u and v.
        wide: (n,) or (1,) texels of the largest level.
        high: the same.
        most: places at most.

    Returns:
        (n,) places, 0 where texels are enlarged; (n,) level, 0 for the largest; the longer axis (n,) in u
        and (n,) in v.
    """
    ux, uy = (np.clip(slope * wide, -_MOST_STEP, _MOST_STEP) for slope in slopes[:2])
    vx, vy = (np.clip(slope * high, -_MOST_STEP, _MOST_STEP) for slope in slopes[2:])
    p, r, q = ux * ux + uy * uy, vx * vx + vy * vy, ux * vx + uy * vy
    mean, half = (p + r) * _HALF, (p - r) * _HALF
    spread = np.sqrt(half * half + q * q)
    long2 = mean + spread
    short2 = np.maximum(mean - spread, _ONE)
    count = np.minimum(np.ceil(np.sqrt(long2 / short2)), np.float32(most))
    np.maximum(count, _ONE, out=count)
    level = np.maximum(_log2(np.maximum(long2 / (count * count), _ONE)) * _HALF, np.float32(0))
    # The eigenvector of the longer axis, by the row that says more of it.
    steep = p >= r
    x, y = np.where(steep, long2 - r, q), np.where(steep, q, long2 - p)
    scale = np.sqrt(long2 / np.maximum(x * x + y * y, _TINY))
    places = count.astype(np.uint16)
    places[long2 <= _ONE] = 0
    return places, level, x * scale / wide, y * scale / high


def _log2(value: Float32Array) -> Float32Array:
    """Binary logarithm of numbers from 1 on, to 0.008: the exponent, and a polynomial of the rest."""
    bits = value.view(np.int32)
    exponent = (bits >> 23) - 127
    part = ((bits & 0x7FFFFF) | 0x3F800000).view(np.float32)
    result: Float32Array = exponent.astype(np.float32)
    result += (part - _ONE) * (np.float32(1.6838) - np.float32(0.3419) * part)
    return result


@dataclass
class _Along:
    """Places and the longer axes of their ellipses, with how the texture goes on along u and v."""

    u: Float32Array
    v: Float32Array
    du: Float32Array
    dv: Float32Array
    wrap: tuple[int, int]

    def at(self, share: np.float32) -> tuple[Float32Array, Float32Array]:
        """Places so far along, from 0 to 1."""
        u, v = self.u, self.v
        if share:
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
