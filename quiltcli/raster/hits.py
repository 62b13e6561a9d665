"""What the visible pixels see."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class Hits:
    """G groups of k quilt pixels; all pixels of a group see one triangle.

    A group is a microtile of 64 pixels that one triangle fills, or a single pixel: what belongs to
    the triangle is looked up once a group and broadcast over its pixels, groups being innermost.

    Attributes:
        pixel: (k, G) flat quilt address.
        facet: (G,) facet index.
        triangle: (G,) triangle index.
        b: (k, G) barycentric weight of the triangle's second vertex, perspective-correct.
        c: (k, G) barycentric weight of its third vertex; the first has 1 − b − c.
        position: (3, k, G) the point that is seen minus the eye, world axes, metres.
        inside: how many of the pixels lie in their facet's polygon, not in its bleed.
    """

    pixel: IntArray
    facet: Int32Array
    triangle: Int32Array
    b: Float32Array
    c: Float32Array
    position: FloatArray
    inside: int
