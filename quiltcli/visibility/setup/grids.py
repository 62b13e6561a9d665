"""Planes and quadratics at all pixels of squares, on grids on which every sum is exact.

A form is a plane a·x + b·y + c, or a quadratic with x², x·y and y² before these. Where its coefficients are
multiples of one power of two and small enough, no sum over a square's pixels is ever rounded: a product of
matrices gives the same bytes in any order, on any machine.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.visibility.setup.planes import power_of_two

# Three numbers below 2 rounded to 2⁻⁵⁰, or six to 2⁻⁴⁹, have sums that are exact in double precision.
_ROUND_TO = {3: 6.0, 6: 12.0}


@lru_cache
def _basis(terms: int, side: int) -> FloatArray:
    """x, y and 1, or x², xy, y², x, y and 1, (terms, 64·side²) at the pixels of squares, row by row."""
    place = np.arange(8.0 * side)
    x, y = np.tile(place, place.size), np.repeat(place, place.size)
    linear = (x, y, np.ones(x.size))
    return np.stack(linear if terms == 3 else (x * x, x * y, y * y, *linear))


BASIS: FloatArray = _basis(3, 1)
"""Column, row and 1 (3, 64) of the pixels of a microtile, whose 64 pixels are neighbours in memory."""


@lru_cache
def _reach(terms: int, side: int) -> FloatArray:
    """What the terms are below (terms, 1): powers of two."""
    line = 8.0 * side
    linear = (line, line, 1.0)
    return np.array(linear if terms == 3 else (line**2, line**2, line**2, *linear))[:, None]


def grid_values(form: FloatArray, side: int = 1) -> FloatArray:
    """Values (G, 64·side²) of forms at the pixels of squares, row by row, from their first pixel.

    Args:
        form: planes (3, G) of x, y and 1, or quadratics (6, G) of x², xy, y², x, y and 1; on grids on which
            every sum is exact, so that neither the order of the sums nor the machine can be told.
        side: how many microtiles are the side of a square.
    """
    return np.asarray(form.T @ _basis(len(form), side))


def exact_values(form: FloatArray, side: int = 1) -> FloatArray:
    """As `grid_values`, of any forms: they are rounded to such grids before."""
    return grid_values(on_grid(form, side), side)


def on_grid(form: FloatArray, side: int = 1) -> FloatArray:
    """Forms (..., 3 or 6, G) rounded to grids on which every sum over a square is exact."""
    terms = form.shape[-2]
    reach = np.abs(form)
    reach *= _reach(terms, side)
    greatest = reach.max(axis=-2, keepdims=True)
    scale = power_of_two(np.maximum(greatest, 1e-300, out=greatest))  # at or below the greatest term
    grid = form / scale
    grid += _ROUND_TO[terms]
    grid -= _ROUND_TO[terms]
    grid *= scale
    return grid


def single_values(form: FloatArray, side: int = 1) -> Float32Array:
    """As `exact_values`, rounded once to single precision."""
    return exact_values(form, side).astype(np.float32)
