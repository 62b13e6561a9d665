"""What the visible pixels see."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import Float32Array, FloatArray, Int32Array, IntArray


@dataclass(frozen=True)
class Hits:
    """R rows of k quilt pixels; all pixels of a row see one triangle.

    A row is a microtile of 64 pixels that one triangle fills, or a single pixel: what belongs to the
    triangle is looked up once a row and broadcast over its pixels.

    Attributes:
        pixel: (R, k) flat quilt address.
        facet: (R,) facet index.
        triangle: (R,) triangle index.
        b: (R, k) barycentric weight of the triangle's second vertex, perspective-correct.
        c: (R, k) barycentric weight of its third vertex; the first has 1 − b − c.
        position: (3, R, k) the point that is seen minus the eye, world axes, metres.
        inside: how many of the pixels lie in their facet's polygon, not in its bleed.
    """

    pixel: IntArray
    facet: Int32Array
    triangle: Int32Array
    b: Float32Array
    c: Float32Array
    position: FloatArray
    inside: int
