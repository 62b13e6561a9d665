"""Binning: which triangles may show on which facets (Harish & Narayanan, §3.2.1).

First pass: a ray from the eye through every vertex, against the cores of the lit facets. Three
vertices on one core settle the triangle: it shows there and nowhere else. Second pass: the rest goes
through a grid over directions and an exact test of cones. All facets whose lit side faces the eye
take part, hidden behind others or not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, IntArray, gather_corners, offsets, segments
from quiltcli.visibility.binning.broad import candidate_pairs
from quiltcli.visibility.binning.cones import Cones, Parts, facet_parts, lit_cones, overlapping
from quiltcli.visibility.binning.cores import facet_cores
from quiltcli.visibility.rays.embree import embree_scene, has_embree

__all__ = [
    "Cones",
    "Cores",
    "Pairs",
    "Parts",
    "common_value",
    "facet_parts",
    "lit_cones",
    "pairs_of",
]

_CHUNK = 1 << 17
_FEW = 4
_MANY = 1 << 16


@dataclass(frozen=True)
class Pairs:
    """N pairs of a triangle and a facet it may show on, by facet, then triangle.

    Attributes:
        facet: (N,) facet index.
        triangle: (N,) triangle index.
        settled: triangles that the first pass settled.
        reaching: triangles that reach any facet.
    """

    facet: Int32Array
    triangle: Int32Array
    settled: int
    reaching: int


def pairs_of(
    vertices: FloatArray, triangles: Int32Array, drawn: IntArray, core: Int32Array, cones: Cones
) -> Pairs:
    """Sort triangles to the facets on which the eye may see them.

    Args:
        vertices: (V, 3) world minus eye, metres.
        triangles: (T, 3).
        drawn: (D,) the triangles that are asked about, indices into `triangles`.
        core: (V,) the cores that the vertices' rays meet, by `Cores.met_by`.
        cones: of the lit parts of the display, as this eye sees them.
    """
    met = common_value(core, triangles, drawn)
    settled, rest = np.flatnonzero(met >= 0), np.flatnonzero(met < 0)
    # Of very many, a triangle with few candidates is small: its own edges would reject next to nothing.
    few = _FEW if len(triangles) > _MANY else 0
    keys = [_key(cones.facet.take(met[settled]), drawn[settled])]
    reached = np.zeros(rest.size, dtype=np.bool_)
    rest = drawn[rest]
    for place, part in _second_pass(vertices, triangles, rest, cones, few):
        keys.append(_key(cones.facet.take(part), rest.take(place)))
        reached[place] = True
    found = np.concatenate(keys)
    found.sort()
    if cones.facet.size > np.unique(cones.facet).size:  # a facet of several parts may meet with more than one
        found = found[np.diff(found, prepend=-1) != 0]
    return Pairs(
        facet=(found >> 32).astype(np.int32),
        triangle=(found & 0xFFFFFFFF).astype(np.int32),
        settled=settled.size,
        reaching=settled.size + int(np.count_nonzero(reached)),
    )


def common_value(values: Int32Array, triangles: Int32Array, drawn: IntArray) -> Int32Array:
    """What the three corners of triangles agree on.

    Args:
        values: (V,) a number of every vertex, negative for none.
        triangles: (T, 3).
        drawn: (D,) the triangles that are asked about.

    Returns:
        (D,) the number of all three corners, −1 where they differ or have none.
    """
    corner = triangles if drawn.size == len(triangles) else triangles.take(drawn, axis=0)
    a, b, c = (values.take(corner[:, k]) for k in range(3))
    return np.where((a == b) & (b == c) & (a >= 0), a, np.int32(-1))


class Cores:
    """What the first pass casts rays at: of every lit part, what no other facet overlaps.

    Where there is no Embree, nothing is met, and the second pass does all.
    """

    def __init__(self, cones: Cones) -> None:
        self._part = np.full(1, -1, dtype=np.int32)
        if not has_embree():
            return
        corners, counts = facet_cores(cones)
        part, rank = segments(offsets(np.maximum(counts - 2, 0)))
        first = part * corners.shape[1]
        faces = np.stack((first, first + rank + 1, first + rank + 2), axis=1).astype(np.int32)
        self._part = np.append(part, -1).astype(np.int32)
        self._scene = embree_scene(corners.reshape(-1, 3), faces)

    def met_by(self, vertices: FloatArray) -> Int32Array:
        """The part (V,) whose core the ray from the eye through each vertex (V, 3) meets, −1 for none."""
        if self._part.size == 1:
            return np.full(len(vertices), -1, dtype=np.int32)
        origin = np.zeros((1, 3), dtype=np.float32)
        met = self._scene.run(np.broadcast_to(origin, vertices.shape), vertices.astype(np.float32))
        result: Int32Array = self._part.take(met)
        return result


def _second_pass(
    vertices: FloatArray, triangles: Int32Array, rest: IntArray, cones: Cones, few: int
) -> Iterator[tuple[IntArray, IntArray]]:
    """Places in `rest`, the triangles that the first pass left, and the parts that the cone test finds."""
    for at in range(0, rest.size, _CHUNK):
        chunk = rest[at : at + _CHUNK]
        corners = gather_corners(vertices, triangles.take(chunk, axis=0))
        first, second = candidate_pairs(corners, cones.grids)
        meets = overlapping(corners, cones.planes, cones.wide, first, second, few)
        yield at + first[meets], second[meets]


def _key(facet: Int32Array, triangle: IntArray) -> IntArray:
    """Facet and triangle in one number that sorts by facet, then triangle."""
    result: IntArray = facet.astype(np.int64) << 32 | triangle
    return result
