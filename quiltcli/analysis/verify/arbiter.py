"""The arbiter: where rays and render disagree, who is right, in double precision.

Embree's rays are single precision, so near an edge it may name the neighbour. For the few pixels in
question all triangles that were named, and all that share a corner with them, are tested exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.analysis.verify.tolerances import BESIDE, CLOSE, depth_tolerance
from quiltcli.geometry import BoolArray, FloatArray, IntArray
from quiltcli.shading.along import ABSENT, THERE
from quiltcli.visibility.rays.embree import Target
from quiltcli.visibility.rays.exact import Neighbours, Tests, intersect
from quiltcli.visibility.rays.pixels import Places

FAULT, IMPRECISE, CLOSE_BY = 0, 1, 2
Presence: TypeAlias = Callable[[Places, IntArray, IntArray], NDArray[np.uint8]]


def judge(
    target: Target,
    neighbours: Neighbours,
    pixels: Places,
    named: IntArray,
    drawn: IntArray,
    z: FloatArray,
    presence: Presence | None = None,
) -> tuple[IntArray, IntArray]:
    """Who is right in some pixels.

    Args:
        target: the scene from the eye.
        neighbours: the scene's neighbourhoods.
        pixels: N pixels in question.
        named: (k, N) triangles named by rays, negative for none.
        drawn: (N,) triangle that was drawn, −1 where it is not known or there is none.
        z: (N,) depth that was drawn, infinite where nothing was.
        presence: tells of pixels, rows of them (M,) and triangles (M,) whether these are ABSENT, THERE or
            DOUBTFUL there; by default they are there.

    Returns:
        (N,) FAULT, IMPRECISE where the render is right, or CLOSE_BY where it shows one of two
        surfaces as far away as each other; and (N,) the triangle it shows, −1 for none.
    """
    everything = np.concatenate((named, drawn[None]))
    row, column = np.nonzero(everything.T >= 0)
    tests = intersect(target, pixels, *neighbours.around(row, everything.T[row, column]))
    covered = np.isfinite(z)
    if not tests.row.size:
        return np.where(covered, FAULT, IMPRECISE), np.full(z.size, -1)
    sure = np.ones(tests.row.size, dtype=np.bool_)
    if presence is not None:
        there = presence(pixels, tests.row, tests.triangle)
        tests = replace(tests, inside=np.where(there == ABSENT, -np.inf, tests.inside))
        sure = there == THERE
    shown = _shown(tests, drawn, z)
    seen = shown >= 0
    depth = np.where(seen, tests.depth[shown], np.inf)
    distance = np.where(seen, tests.distance[shown], np.inf)
    hidden = _hidden(tests, distance, shown, sure)
    first = _at(tests, np.arange(z.size), named[0])
    close = seen & (first >= 0) & (first != shown)
    close &= np.abs(distance - tests.distance[first]) <= CLOSE * np.where(seen, distance, 1.0)
    right_depth = np.abs(np.where(covered, z, 0) - np.where(seen, depth, 0)) <= depth_tolerance(
        np.where(seen, depth, 0)
    )
    right = np.where(covered, seen & ~hidden & right_depth, ~hidden)
    verdict = np.where(right, np.where(close & covered, CLOSE_BY, IMPRECISE), FAULT)
    return verdict, np.where(seen, tests.triangle[shown], -1)


def _shown(tests: Tests, drawn: IntArray, z: FloatArray) -> IntArray:
    """Index (N,) into the tests of the triangle each pixel shows, −1 for none.

    The one that was drawn; where that is not known, the nearest that meets the ray at the depth drawn.
    """
    there = tests.inside >= -BESIDE
    known = drawn[tests.row] == tests.triangle
    fits = np.abs(tests.depth - np.where(np.isfinite(z), z, -1e30)[tests.row])
    guess = (drawn[tests.row] < 0) & (fits <= depth_tolerance(np.abs(tests.depth)))
    candidate = np.flatnonzero(there & (known | guess))
    result = np.full(z.size, -1)
    order = candidate[np.lexsort((fits[candidate], tests.row[candidate]))][::-1]
    result[tests.row[order]] = order  # the last write of a row is its best fit
    return result


def _hidden(tests: Tests, distance: FloatArray, shown: IntArray, sure: BoolArray) -> BoolArray:
    """Pixels (N,) whose ray meets a surface nearer than `distance` (N,) that is `sure` (M,) to be there.

    A centre inside one triangle meets it; so does one on the edges of two, where they join.
    """
    nearer = tests.distance < distance[tests.row] * (1 - CLOSE)
    nearer &= sure
    nearer &= shown[tests.row] != np.arange(tests.row.size)
    surely = np.bincount(tests.row, weights=nearer & (tests.inside > BESIDE), minlength=distance.size)
    on_edge = np.bincount(
        tests.row, weights=nearer & (np.abs(tests.inside) <= BESIDE), minlength=distance.size
    )
    result: BoolArray = (surely >= 1) | (on_edge >= 2)
    return result


def _at(tests: Tests, row: IntArray, triangle: IntArray) -> IntArray:
    """Index (N,) of the test of these rows and triangles where they meet, −1 where they do not."""
    key = tests.row * (tests.triangle.max(initial=0) + 1) + tests.triangle
    wanted = row * (tests.triangle.max(initial=0) + 1) + triangle
    place = np.minimum(np.searchsorted(key, wanted), key.size - 1)
    good = (triangle >= 0) & (key[place] == wanted)
    good &= tests.inside[place] >= -BESIDE
    return np.where(good, place, -1)
