"""Light of a rectangle: what a surface receives of it, in closed form, and where it is seen in a mirror.

Everything is sums, products and square roots in double precision, the same on every machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, cross, normalized
from quiltcli.scene.lights import Area
from quiltcli.shading.surface import Surface
from quiltcli.visibility.resolve.vectors import sum_of_products, vector_values

_ARC = (
    0.9999999997,
    0.3333334129,
    0.133329575,
    0.05721190793,
    0.02474692273,
    0.01511631415,
    -0.006956933355,
    0.02979744819,
    -0.0382546968,
    0.03650708059,
    -0.01881736001,
    0.004782655276,
)
"""arccos(1 − y) / √(1 − (1 − y)²) by powers of y from 0 to 1, to within 4·10⁻¹⁰ (at Chebyshev's nodes)."""


@dataclass(frozen=True)
class Received:
    """What surfaces receive of a rectangle of radiance 1.

    Attributes:
        received: (n, k) irradiance.
        angle: (n, k) irradiance of a surface that faces it as well as any can: the solid angle that is
            above the horizon, less what aslant rays lose.
    """

    received: Float32Array
    angle: Float32Array


def received_from(light: Area, surface: Surface) -> Received:
    """What points receive of a rectangle.

    The irradiance of a polygon is half the sum over its edges of the angle each is seen under, times the
    normal of the plane through it and the point (Lambert 1760); first what is below the point's horizon
    is cut off.
    """
    centre = (light.position - surface.eye)[:, None, None] - _positions(surface)
    unit = vector_values(surface.normal) * surface.normal_scale
    normal: FloatArray = np.broadcast_to(unit, centre.shape).astype(np.float64)
    total = _polygon(_corners(light, centre), normal)
    shines = normalized(cross(light.across, light.along))[:, None, None]
    total *= np.where(sum_of_products(centre, shines) < 0, 0.5, 0.0)
    received = np.maximum(sum_of_products(total, normal), 0)
    angle = np.sqrt(sum_of_products(total, total))
    return Received(received.astype(np.float32), np.maximum(angle, received).astype(np.float32))


def _corners(light: Area, centre: FloatArray) -> list[FloatArray]:
    """The corners of a rectangle about its middle (3, n, k), anticlockwise as seen from where it shines."""
    ways = ((-1, 1), (1, 1), (1, -1), (-1, -1))
    return [centre + (s * light.across + t * light.along)[:, None, None] for s, t in ways]


def _polygon(corners: list[FloatArray], normal: FloatArray) -> FloatArray:
    """Sum (3, n, k) over the edges of what is above horizons of these normals (3, n, k)."""
    height = [sum_of_products(corner, normal) for corner in corners]
    total = np.zeros_like(corners[0])
    leaving, entering = np.zeros_like(total), np.zeros_like(total)
    for k, corner in enumerate(corners):
        after, h0, h1 = corners[(k + 1) % 4], height[k], height[(k + 1) % 4]
        crosses = (h0 > 0) != (h1 > 0)
        share = np.divide(h0, h0 - h1, out=np.zeros_like(h0), where=crosses)
        horizon = corner + (after - corner) * share
        begin = np.where(h0 > 0, corner, horizon)
        end = np.where(h1 > 0, after, horizon)
        total += np.where((h0 > 0) | (h1 > 0), _edge(begin, end), 0)
        leaving += np.where(crosses & (h0 > 0), horizon, 0)
        entering += np.where(crosses & (h1 > 0), horizon, 0)
    # The horizon is an edge of what is left above it.
    cut = sum_of_products(leaving, leaving) > 0
    if cut.any():
        total += np.where(cut, _edge(leaving, entering), 0)
    return total


def _edge(begin: FloatArray, end: FloatArray) -> FloatArray:
    """The angle (3, n, k) an edge is seen under, times the unit normal of the plane through it."""
    over = 1 / np.sqrt(
        np.maximum(sum_of_products(begin, begin) * sum_of_products(end, end), 1e-200),
    )
    normal: FloatArray = np.stack(_crossed(begin, end)) * over
    cosine = np.clip(sum_of_products(begin, end) * over, -1, 1)
    size = np.abs(cosine)
    arc = np.full_like(size, _ARC[-1])
    for factor in reversed(_ARC[:-1]):
        arc *= 1 - size
        arc += factor
    sine = np.sqrt(np.maximum(1 - size * size, 1e-12))
    return np.asarray(normal * np.where(cosine < 0, np.pi / sine - arc, arc))


def _crossed(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The cross product of vectors along the first axis."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def mirrored_share(light: Area, surface: Surface, alpha: FloatArray) -> Float32Array:
    """Share (n, k) of a layer's reflection, of GGX's alpha (n, k), that shows a rectangle.

    By the slopes of half vectors, GGX's lobe is a cosine's that is drawn in: to twice alpha in the plane of
    incidence, to that times the cosine of incidence across it. So the share is Lambert's formula for a
    rectangle drawn out as much (Heitz et al., Real-Time Polygonal-Light Shading with Linearly Transformed
    Cosines, 2016; theirs are fitted, these are the lobe's own near its middle).
    """
    centre = (light.position - surface.eye)[:, None, None] - _positions(surface)
    normal = (vector_values(surface.normal) * surface.normal_scale).astype(np.float64)
    ray = vector_values(surface.ray).astype(np.float64)
    ray = ray / np.sqrt(sum_of_products(ray, ray) + 1e-300)
    facing = np.maximum(-sum_of_products(normal, ray), 1e-4)
    way = ray + 2 * facing * normal
    aside = np.stack(_crossed(way, np.broadcast_to(normal, way.shape)))
    spare = np.stack(_crossed(way, np.broadcast_to(light.across[:, None, None], way.shape)))
    aside = np.where(sum_of_products(aside, aside) > 1e-10, aside, spare)
    aside = aside / np.sqrt(sum_of_products(aside, aside) + 1e-300)
    inward = np.stack(_crossed(aside, way))
    wide = 1 / (2 * alpha)
    corners = [
        np.stack(
            np.broadcast_arrays(
                sum_of_products(corner, inward) * wide,
                sum_of_products(corner, aside) * (wide / facing),
                sum_of_products(corner, way),
            )
        )
        for corner in _corners(light, centre)
    ]
    ahead = np.zeros_like(corners[0])
    ahead[2] = 1
    share = _polygon(corners, ahead)[2] * (0.5 / np.pi)
    return np.asarray(np.clip(share, 0, 1), dtype=np.float32)


def _positions(surface: Surface) -> Any:
    assert surface.points.position is not None
    return surface.points.position
