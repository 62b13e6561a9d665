"""What is seen of a sky: its panorama where rays leave the scene, averaged over what pixels see of it.

Longitude a and latitude b of a ray d are angles, and with r² = x² + z² their slopes along an axis, on which
d grows by d', are a' = (x z' − z x') / r² and b' = ((x x' + z z') y / r − r y') / (r² + y²).
"""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene.environment.sky import Sky
from quiltcli.shading.textures.filter import look_up

_LEAST = 1e-12  # of a ray's squared length about the vertical, where longitudes are all the same
_ARCTANGENT = (
    0.999999999988737,
    -0.33333332951665584,
    0.19999978337002625,
    -0.1428522562534094,
    0.11105306907877154,
    -0.09049180114773321,
    0.07495266091119122,
    -0.06022205218890623,
    0.043646729133535726,
    -0.02600614172204219,
    0.011427729645781124,
    -0.003195461834616629,
    0.00041923393867625194,
)
"""Of arctan(t) / t as a polynomial of t², t from 0 to 1, through Chebyshev's places: 6e-12 off at most."""


def sky_at(sky: Sky, rays: FloatArray, right: FloatArray, down: FloatArray) -> Float32Array:
    """Radiance (3, n) that comes along rays.

    Args:
        sky: the sky.
        rays: (3, n) directions in the world, of any length.
        right: (3, n) what they gain from a pixel to the next one right.
        down: (3, n) to the next one down.
    """
    d, *steps = (_turned(sky.turn.T, each) for each in (rays, right, down))
    x, y, z = d
    flat2 = np.maximum(x * x + z * z, _LEAST * (y * y) + 1e-300)
    flat = np.sqrt(flat2)
    u = angle(x, -z) / (2 * np.pi) + 0.5
    v = angle(flat, y) / np.pi
    slopes = np.empty((4, u.size), dtype=np.float32)
    for k, (dx, dy, dz) in enumerate(steps):
        slopes[k] = (x * dz - z * dx) / flat2 / (2 * np.pi)
        slopes[2 + k] = ((x * dx + z * dz) * y / flat - flat * dy) / (flat2 + y * y) / np.pi
    u -= np.floor(u)
    image, across, along = np.zeros(1, dtype=np.int32), u.astype(np.float32), v.astype(np.float32)
    return look_up(sky.picture, image, across, along, slopes, (0, 1, 2)) * sky.strength


def angle(y: FloatArray, x: FloatArray) -> FloatArray:
    """The angles (n,) of points (x, y), −π to π, by sums and products that all machines round alike."""
    a, b = np.abs(x), np.abs(y)
    most = np.maximum(a, b)
    t = np.minimum(a, b) / np.where(most > 0, most, 1.0)
    square = t * t
    result = np.full(t.shape, _ARCTANGENT[-1])
    for term in _ARCTANGENT[-2::-1]:
        result *= square
        result += term
    result *= t
    result = np.where(b > a, np.pi / 2 - result, result)
    result = np.where(x < 0, np.pi - result, result)
    return np.where(y < 0, -result, result)


def _turned(matrix: FloatArray, ways: FloatArray) -> FloatArray:
    """Directions (3, n) turned by a matrix (3, 3), every sum in a fixed order."""
    return np.stack([row[0] * ways[0] + row[1] * ways[1] + row[2] * ways[2] for row in matrix])
