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

from quiltcli.binning.broad import candidate_pairs
from quiltcli.binning.cones import Cones, Parts, facet_parts, lit_cones, overlapping
from quiltcli.binning.cores import facet_cores
from quiltcli.geometry import FloatArray, Int32Array, IntArray, segments

__all__ = [
    "Cones",
    "Cores",
    "Pairs",
    "Parts",
    "facet_parts",
    "lit_cones",
    "pairs_of",
]

_CHUNK = 1 << 17


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
    a, b, c = core.take(triangles.take(drawn, axis=0).T)
    same = (a == b) & (b == c) & (a >= 0)
    settled, rest = np.flatnonzero(same), np.flatnonzero(~same)
    second = list(_second_pass(vertices, triangles, drawn[rest], cones))
    found = np.concatenate([_key(cones.facet.take(a[settled]), drawn[settled]), *second])
    found.sort()
    found = found[np.diff(found, prepend=-1) != 0]
    triangle = found & 0xFFFFFFFF
    reaching = np.zeros(int(drawn.max(initial=-1)) + 1, dtype=np.bool_)
    reaching[triangle] = True
    return Pairs(
        facet=(found >> 32).astype(np.int32),
        triangle=triangle.astype(np.int32),
        settled=settled.size,
        reaching=int(np.count_nonzero(reaching)),
    )


class Cores:
    """What the first pass casts rays at: of every lit part, what no other facet overlaps."""

    def __init__(self, cones: Cones) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        corners, counts = facet_cores(cones)
        part, rank = segments(np.concatenate(([0], np.cumsum(np.maximum(counts - 2, 0)))))
        first = part * corners.shape[1]
        faces = np.stack((first, first + rank + 1, first + rank + 2), axis=1).astype(np.int32)
        self._part = np.append(part, -1).astype(np.int32)
        self._scene = EmbreeScene()
        if part.size:
            TriangleMesh(self._scene, corners.reshape(-1, 3).astype(np.float32), faces)

    def met_by(self, vertices: FloatArray) -> Int32Array:
        """The part (V,) whose core the ray from the eye through each vertex (V, 3) meets, −1 for none."""
        if self._part.size == 1:
            return np.full(len(vertices), -1, dtype=np.int32)
        origin = np.zeros((1, 3), dtype=np.float32)
        met = self._scene.run(np.broadcast_to(origin, vertices.shape), vertices.astype(np.float32))
        result: Int32Array = self._part.take(met)
        return result


def _second_pass(
    vertices: FloatArray, triangles: Int32Array, rest: IntArray, cones: Cones
) -> Iterator[IntArray]:
    """Keys of the pairs of the triangles that the first pass left, by the exact cone test."""
    for at in range(0, rest.size, _CHUNK):
        chunk = rest[at : at + _CHUNK]
        corners = vertices[triangles[chunk]]
        first, second = candidate_pairs(corners, cones.grids)
        meets = overlapping(corners, cones.planes, cones.wide, first, second)
        yield _key(cones.facet[second[meets]], chunk[first[meets]])


def _key(facet: Int32Array, triangle: IntArray) -> IntArray:
    """Facet and triangle in one number that sorts by facet, then triangle."""
    result: IntArray = facet.astype(np.int64) << 32 | triangle
    return result
