"""How much of a pixel's error each neighbour gets, by the level of the pixel's tone.

Ostromoukhov, *A Simple and Efficient Error-Diffusion Algorithm* (SIGGRAPH 2001): the shares depend on the
level, are given at a few key levels, and lie on straight lines between them. A level and its complement
have the same shares.
"""

from __future__ import annotations

from bisect import bisect_right
from fractions import Fraction
from functools import cache
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import Float32Array

LEVELS = 256
"""Levels that tones from 0 to 1 are told apart by, for the choice of shares alone."""

Shares: TypeAlias = tuple[Fraction, Fraction, Fraction]

# Level: shares of the next pixel, the one below behind and the one below, up to their sum.
_KEYS = {
    0: (13, 0, 5),
    1: (13, 0, 5),
    2: (21, 0, 10),
    3: (7, 0, 4),
    4: (8, 0, 5),
    10: (7, 3, 3),
    22: (3, 2, 1),
    36: (5, 3, 3),
    64: (1, 1, 0),
    72: (5, 7, 1),
    77: (4, 1, 1),
    85: (4, 1, 1),
    95: (5, 3, 2),
    107: (5, 3, 2),
    127: (4, 1, 1),
}
_FIXED = (7, 3, 5)


def shares_at(level: int) -> Shares:
    """Exact shares (next, below behind, below) of a level from 0 to 255; their sum is 1."""
    level = min(level, LEVELS - 1 - level)
    known = list(_KEYS)
    at = bisect_right(known, level) - 1
    if known[at] == level:
        return _normal(_KEYS[level])
    low, high = known[at], known[at + 1]
    share = Fraction(level - low, high - low)
    pairs = zip(_normal(_KEYS[low]), _normal(_KEYS[high]), strict=True)
    near, behind, below = (a + share * (b - a) for a, b in pairs)
    return near, behind, below


def _normal(weights: tuple[int, int, int]) -> Shares:
    total = sum(weights)
    return Fraction(weights[0], total), Fraction(weights[1], total), Fraction(weights[2], total)


@cache
def ostromoukhov() -> Float32Array:
    """Shares (256, 3) by level: of the next pixel, the one below behind, the one below."""
    return np.array([shares_at(level) for level in range(LEVELS)], dtype=np.float32)


@cache
def fixed() -> Float32Array:
    """The same shares (256, 3) for every level."""
    return np.array([_normal(_FIXED)] * LEVELS, dtype=np.float32)
