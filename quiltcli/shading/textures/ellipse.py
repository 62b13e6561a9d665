"""The footprints of pixels in a texture: ellipses, by the singular values of how its coordinates change.

Several places along the longer axis, each about as wide as the shorter, fill an ellipse (Schilling, Knittel &
Straßer 1996: Texram). The level is the one whose texels are as large as places are apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, IntArray

_ONE, _HALF = np.float32(1), np.float32(0.5)
_MOST_STEP = np.float32(1e8)  # texels from pixel to pixel; the smallest level shows wherever it is more
_TINY = np.float32(1e-20)
_DENSE = np.float32(0.75)  # places in as much of the longer axis as the shorter is long


@dataclass(frozen=True)
class Ellipses:
    """The footprints of n pixels, in texels of the largest level.

    Attributes:
        uu: (n,) squared length of how u changes.
        vv: (n,) the same of v.
        uv: (n,) the product of both.
        longer2: (n,) square of the longer axis.
        places: (n,) places to look at along it, 0 where texels are enlarged.
        level: (n,) level, 0 for the largest.
    """

    uu: Float32Array
    vv: Float32Array
    uv: Float32Array
    longer2: Float32Array
    places: NDArray[np.uint16]
    level: Float32Array

    def axes(self, some: Any) -> tuple[Float32Array, Float32Array]:
        """The longer axes of some, along u and along v, texels."""
        p, r, q, longer2 = (values[some] for values in (self.uu, self.vv, self.uv, self.longer2))
        # An eigenvector, by the row that says more of it.
        steep = p >= r
        x, y = np.where(steep, longer2 - r, q), np.where(steep, q, longer2 - p)
        scale = np.sqrt(longer2 / np.maximum(x * x + y * y, _TINY))
        return x * scale, y * scale


def ellipses(slopes: Float32Array, wide: Float32Array, high: Float32Array, most: int) -> Ellipses:
    """Footprints from slopes.

    Args:
        slopes: (4, n) ∂u/∂x, ∂u/∂y, ∂v/∂x and ∂v/∂y.
        wide: (n,) or (1,) texels of the largest level.
        high: the same.
        most: places at most.
    """
    ux, uy = (np.clip(slope * wide, -_MOST_STEP, _MOST_STEP) for slope in slopes[:2])
    vx, vy = (np.clip(slope * high, -_MOST_STEP, _MOST_STEP) for slope in slopes[2:])
    q = ux * vx
    q += uy * vy
    p, r = _squares(ux, uy), _squares(vx, vy)
    mean = (p + r) * _HALF
    spread = (p - r) * _HALF
    spread *= spread
    spread += q * q
    np.sqrt(spread, out=spread)
    longer2 = mean + spread
    reach2 = longer2
    places = np.ones(p.size, dtype=np.uint16)
    if most > 1:
        mean -= spread
        ratio2 = np.divide(longer2, np.maximum(mean, _ONE, out=mean), out=mean)
        count = np.ceil(_DENSE * np.sqrt(ratio2, out=ratio2), out=ratio2)
        np.clip(count, _ONE, np.float32(most), out=count)
        places = count.astype(np.uint16)
        count *= count
        reach2 = np.divide(longer2, count, out=count)
    level = _log2(np.maximum(reach2, _ONE))
    level *= _HALF
    places[longer2 <= _ONE] = 0
    return Ellipses(p, r, q, longer2, places, level)


def between_levels(level: Float32Array, last: IntArray) -> tuple[IntArray, Float32Array]:
    """The nearer level (n,) below, and how much of the next one there is (n,).

    Levels are blended in the middle half between them alone: elsewhere one of them is enough.

    Args:
        level: (n,).
        last: (n,) or (1,) the smallest level there is.
    """
    whole = np.floor(level)
    share = level - whole
    share *= np.float32(2)
    share -= _HALF
    near = whole.astype(np.int64)
    near += share >= _ONE
    share[share >= _ONE] = 0
    share[near >= last] = 0
    return np.minimum(near, last), np.maximum(share, np.float32(0), out=share)


def _squares(a: Float32Array, b: Float32Array) -> Float32Array:
    """a² + b², of arrays that make way."""
    a *= a
    b *= b
    a += b
    return a


def _log2(value: Float32Array) -> Float32Array:
    """Binary logarithm of numbers from 1 on, to 0.008: the exponent, and a polynomial of the rest."""
    bits = value.view(np.int32)
    result = ((bits >> 23) - 127).astype(np.float32)
    part = ((bits & 0x7FFFFF) | 0x3F800000).view(np.float32)
    rest = np.float32(1.6838) - np.float32(0.3419) * part
    part -= _ONE
    part *= rest
    result += part
    return result
