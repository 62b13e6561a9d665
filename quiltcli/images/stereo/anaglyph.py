"""Anaglyphs: both eyes' images in the primaries of one, to be seen through coloured glasses.

A matrix has a row for red, green and blue of the result; three columns for the left eye's, three for the
right's. It works on linear light; every row sums to 1, so that white stays white, but for the green that a
true anaglyph has none of. Dubois' matrices are least-squares fits of what the filters let through on a
display (Dubois, "A projection method to generate anaglyph stereo images", ICASSP 2001, and his matrices
for LCDs of 2009).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray

_LUMA = (0.299, 0.587, 0.114)
_NONE = (0.0, 0.0, 0.0)
_RED, _GREEN, _BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def _matrix(*rows: tuple[tuple[float, ...], tuple[float, ...]]) -> FloatArray:
    return np.array([[*left, *right] for left, right in rows])


MATRICES: Mapping[str, FloatArray] = MappingProxyType(
    {
        "true": _matrix((_LUMA, _NONE), (_NONE, _NONE), (_NONE, _LUMA)),
        "grey": _matrix((_LUMA, _NONE), (_NONE, _LUMA), (_NONE, _LUMA)),
        "color": _matrix((_RED, _NONE), (_NONE, _GREEN), (_NONE, _BLUE)),
        "half-color": _matrix((_LUMA, _NONE), (_NONE, _GREEN), (_NONE, _BLUE)),
        "optimized": _matrix(((0.0, 0.7, 0.3), _NONE), (_NONE, _GREEN), (_NONE, _BLUE)),
        "dubois-red-cyan": _matrix(
            ((0.437, 0.449, 0.164), (-0.011, -0.032, -0.007)),
            ((-0.062, -0.062, -0.024), (0.377, 0.761, 0.009)),
            ((-0.048, -0.050, -0.017), (-0.026, -0.093, 1.234)),
        ),
        "dubois-green-magenta": _matrix(
            ((-0.062, -0.158, -0.039), (0.529, 0.705, 0.024)),
            ((0.284, 0.668, 0.143), (-0.016, -0.015, -0.065)),
            ((-0.015, -0.027, 0.021), (0.009, 0.075, 0.937)),
        ),
        "dubois-amber-blue": _matrix(
            ((1.062, -0.205, 0.299), (-0.016, -0.123, -0.017)),
            ((-0.026, 0.908, 0.068), (0.006, 0.062, -0.017)),
            ((-0.038, -0.173, 0.022), (0.094, 0.185, 0.911)),
        ),
    }
)
"""Matrices (3, 6) by name."""


def anaglyph(left: Float32Array, right: Float32Array, matrix: FloatArray) -> Float32Array:
    """One image (3, H, W) of two, linear light; what a matrix makes negative is black."""
    both = np.concatenate((left, right))
    mixed = np.tensordot(matrix.astype(np.float32), both, axes=1)
    return np.maximum(mixed, np.float32(0))


def luma(image: Float32Array) -> Float32Array:
    """Grey (H, W) of an image (3, H, W)."""
    weights = np.array(_LUMA, dtype=np.float32)
    return np.asarray(np.tensordot(weights, image, axes=1))
