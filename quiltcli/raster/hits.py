"""What the visible pixels of a batch see."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class Hits:
    """P quilt pixels that see a triangle, each with the point it sees.

    Attributes:
        pixel: (P,) flat quilt address.
        facet: (P,) facet index.
        triangle: (P,) triangle index.
        b: (P,) barycentric weight of the triangle's second vertex, perspective-correct.
        c: (P,) barycentric weight of its third vertex; the first has 1 − b − c.
        position: (3, P) the point that is seen minus the eye, world axes, metres.
    """

    pixel: IntArray
    facet: Int32Array
    triangle: Int32Array
    b: FloatArray
    c: FloatArray
    position: FloatArray
