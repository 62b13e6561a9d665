"""Surfaces at visible points: their normals, and how these lie to the eye.

Vectors are not of unit length: their products are divided by their lengths, which takes less time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.visibility.resolve.hits import Points
from quiltcli.visibility.resolve.vectors import Vectors, products, vector_values

_ONE = np.float32(1)
_LEAST_LENGTH2 = np.float32(1e-30)


@dataclass(frozen=True)
class Surface:
    """The surfaces that n groups of k points lie on, seen from an eye.

    What is only asked for by some lights or materials is worked out when it is first asked for.

    Attributes:
        points: the points; their normals are on the side of the eye.
        eye: (3,) world metres.
    """

    points: Points
    eye: FloatArray

    @property
    def normal(self) -> Vectors:
        """Shading normals, of any length."""
        assert self.points.normal is not None
        return self.points.normal

    @property
    def ray(self) -> Vectors:
        """Directions from the eye, of any length."""
        return self.points.ray

    @cached_property
    def normal_scale(self) -> Float32Array:
        """One over the normals' lengths (n, k), (n, 1) or (1, 1)."""
        return over_length(self.normal)

    @cached_property
    def ray_scale(self) -> Float32Array:
        """One over the rays' lengths (n, k), negative: towards the eye."""
        return over_length(self.ray, -_ONE)

    @cached_property
    def facing(self) -> Float32Array:
        """Cosine (n, k) between normal and eye; below 0 where interpolation turns a normal away."""
        result = products(self.normal, self.ray)
        result *= self.normal_scale
        result *= self.ray_scale
        return result


def shading_normals(points: Points) -> Float32Array:
    """Unit normals (3, G, k), or (3, 1, 1) one for all, as shading uses them: on the side of the eye."""
    assert points.normal is not None
    return np.multiply(vector_values(points.normal), over_length(points.normal))


def over_length(vectors: Vectors, sign: np.float32 = _ONE) -> Float32Array:
    """`sign` over the lengths (…) of vectors."""
    length2 = products(vectors, vectors)
    length2 += _LEAST_LENGTH2
    result: Float32Array = np.divide(sign, np.sqrt(length2, out=length2), out=length2)
    return result
