"""The levels of a texture: its own texels as half floats, and ever smaller ones by means of areas.

sRGB is decoded before anything is averaged (IEC 61966-2-1). A level is half as wide and high as the one
before, rounded down; where that is odd each texel is the mean over the area it stands for, three texels
wide, so levels of any size lie exactly over one another.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import MOST_HALF
from quiltcli.geometry import Float32Array, slices

Texels: TypeAlias = NDArray[np.uint16]
"""(h, w, 4) bits of half floats: red, green, blue, alpha."""

_LEAST = 2.0**-14  # smaller half floats are denormal, and slow to reckon with
_ROWS = 256


def level_sizes(width: int, height: int, most: int) -> list[tuple[int, int]]:
    """Widths and heights of all levels that are at most `most` wide and high, the largest first."""
    sizes = [(width, height)]
    while width > 1 or height > 1:
        width, height = max(width // 2, 1), max(height // 2, 1)
        sizes.append((width, height))
    return [size for size in sizes if max(size) <= most] or sizes[-1:]


def levels_of(pixels: NDArray[Any], *, srgb: bool) -> Iterator[Texels]:
    """All levels of a picture, the largest first.

    Args:
        pixels: (H, W, channels) as they are stored: grey, grey with alpha, colour, colour with alpha.
        srgb: whether whole numbers are encoded for displays; those of float files never are.
    """
    texels = _own_texels(pixels, srgb)
    yield texels
    if texels.shape[:2] == (1, 1):
        return
    values = _halved_strips(texels)
    while True:
        yield half_bits(values)
        if values.shape[:2] == (1, 1):
            return
        values = halved(values)


def half_bits(values: Float32Array) -> Texels:
    """Numbers from 0 on as half floats, none infinite and none denormal."""
    halves = np.minimum(values, MOST_HALF).astype(np.float16)
    bits = halves.view(np.uint16)
    bits[values < _LEAST] = 0
    return bits


def halved(values: Float32Array) -> Float32Array:
    """The next level of values (h, w, 4): means over areas along one axis, then along the other."""
    return _halved_along(_halved_along(values, 0), 1)


def _halved_strips(texels: Texels) -> Float32Array:
    """The level after these texels, some rows at a time: as floats the whole would take twice the memory."""
    high, wide = texels.shape[:2]
    count = max(high // 2, 1)
    result = np.empty((count, max(wide // 2, 1), 4), dtype=np.float32)
    if high % 2 or high < 2:
        values = texels.view(np.float16).astype(np.float32)
        return halved(values)
    for rows in slices(0, count, _ROWS):
        some = texels[2 * rows.start : 2 * rows.stop].view(np.float16).astype(np.float32)
        result[rows] = halved(some)
    return result


def _halved_along(values: Float32Array, axis: int) -> Float32Array:
    """Half as many values along an axis, rounded down, each the mean over its share of them."""
    size = values.shape[axis]
    if size == 1:
        return values
    count = size // 2
    rows = np.moveaxis(values, axis, 0)
    if size % 2 == 0:
        result = (rows[0::2] + rows[1::2]) * np.float32(0.5)
        return np.moveaxis(result, 0, axis)
    # Texel i stands for (2 + 1/k) of the k·2 + 1: it has 1 − i/k of the first, and (i + 1)/k of the third.
    share = (np.arange(count + 1) / count).astype(np.float32).reshape(-1, *(1,) * (values.ndim - 1))
    result = (np.float32(1) - share[:-1]) * rows[0:-1:2]
    result += rows[1::2]
    result += share[1:] * rows[2::2]
    result *= np.float32(count / size)
    return np.moveaxis(result, 0, axis)


def _own_texels(pixels: NDArray[Any], srgb: bool) -> Texels:
    """The pixels of a picture as texels."""
    high, wide, count = pixels.shape
    colors, alpha = (0, 0, 0) if count < 3 else (0, 1, 2), {2: 1}.get(count, 3 if count > 3 else None)
    result = np.empty((high, wide, 4), dtype=np.uint16)
    for rows in slices(0, high, _ROWS):
        some = pixels[rows]
        for k, channel in enumerate(colors):
            result[rows, :, k] = _bits(some[..., channel], srgb)
        result[rows, :, 3] = half_bits(np.ones(1, np.float32))[0]
        if alpha is not None:
            result[rows, :, 3] = _bits(some[..., alpha], False)
    return result


def _bits(values: NDArray[Any], srgb: bool) -> Texels:
    if values.dtype.kind == "u":
        table = _decoded(values.dtype.itemsize, srgb)
        return table.take(values)
    return half_bits(np.nan_to_num(np.maximum(values, 0), nan=0.0, posinf=np.inf).astype(np.float32))


@lru_cache
def _decoded(size: int, srgb: bool) -> Texels:
    """The half float of every whole number of `size` bytes."""
    most = 256**size - 1
    share = np.arange(most + 1) / most
    if srgb:
        share = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return half_bits(share.astype(np.float32))
