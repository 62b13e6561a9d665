"""Shading: the light that leaves each visible point towards the eye.

Surfaces reflect as a Lambert base under a GGX layer. Nothing casts a shadow and light is not passed on
from surface to surface. Every sum is written out in a fixed order of single-precision operations, so a
pixel's value depends neither on the machine nor on which other pixels are shaded with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array
from quiltcli.raster.hits import Hits, Wanted
from quiltcli.scene import Scene

# Irradiance of the light at the eye; a white surface that faces it comes out near 1.
HEADLIGHT = 3.0
# Lights have no size: below this roughness their image in a surface would be too bright for half floats.
LEAST_ROUGHNESS = 0.09
# The largest finite half float; brighter values are written as this.
MOST_HALF = np.float32(65504)
_DIELECTRIC = 0.04
_LEAST_COSINE = np.float32(1e-4)
_LEAST_DISTANCE2 = np.float32(1e-6)
_LEAST_LENGTH2 = np.float32(1e-30)
_ONE, _HALF = np.float32(1), np.float32(0.5)

Values: TypeAlias = "Float32Array | np.float32"


@dataclass(frozen=True)
class _Points:
    """Visible points in n groups of k, like the hits they come from.

    What a material says is (n, 1), or a number where all points agree; vertex colours make it (n, k).

    Attributes:
        normal: (3, n, k) unit shading normals, on the side of the eye.
        eyeward: (3, n, k) unit directions to the eye.
        base: 3 values, base colour.
        steady: 3 values, light that needs no lamp: ambient and emission, or the colour of an unlit surface.
        diffuse: share of light for the Lambert base, over π.
        specular0: 3 values, what the layer reflects at normal incidence.
        specular90: what it reflects at grazing incidence, 0 on an unlit surface.
        alpha2: the square of GGX's alpha.
    """

    normal: Float32Array
    eyeward: Float32Array
    base: tuple[Values, ...]
    steady: tuple[Values, ...]
    diffuse: Values
    specular0: tuple[Values, ...]
    specular90: Values
    alpha2: Values


def shading_wants(scene: Scene) -> Wanted:
    """What shading asks of hits."""
    return Wanted(
        normals=scene.corner_normals,
        weights=scene.corner_colors is not None,
        position=len(scene.lights.point_color) > 0,
    )


def shade(scene: Scene, eye: FloatArray, hits: Hits) -> Float32Array:
    """Linear RGB (3, G, k) float32 of every hit.

    Args:
        scene: the scene.
        eye: (3,) world metres.
        hits: G groups of k visible points, with what `shading_wants` asks for.
    """
    return _radiance(scene, eye, hits, _points(scene, hits))


def shading_normals(hits: Hits) -> Float32Array:
    """Unit normals (3, G, k) float32 as shading uses them: interpolated, on the side of the eye."""
    assert hits.normal is not None
    return _unit(hits.normal)


def _points(scene: Scene, hits: Hits) -> _Points:
    rows = _materials_at(_material_table(scene), scene.material.take(hits.triangle))
    base, ambient, emission = rows[0:3], rows[3:6], rows[6:9]
    diffuse, metallic, dielectric, specular90, alpha2 = rows[9:14]
    if scene.corner_colors is not None:
        color = _colors(scene.corner_colors, hits)
        base = tuple(v * c for v, c in zip(base, color, strict=True))
        ambient = tuple(v * c for v, c in zip(ambient, color, strict=True))
    return _Points(
        normal=shading_normals(hits),
        eyeward=_unit(hits.ray, -_ONE),
        base=base,
        steady=tuple(a + e for a, e in zip(ambient, emission, strict=True)),
        diffuse=diffuse,
        specular0=tuple(dielectric + metallic * v for v in base),
        specular90=specular90,
        alpha2=alpha2,
    )


def _unit(vectors: Float32Array, sign: np.float32 = _ONE) -> Float32Array:
    """Unit vectors along the first axis, times `sign`."""
    scale = _dot(vectors, vectors)
    scale += _LEAST_LENGTH2
    np.divide(sign, np.sqrt(scale, out=scale), out=scale)
    result: Float32Array = vectors * scale
    return result


def _colors(table: Float32Array, hits: Hits) -> Float32Array:
    """Vertex colours (3, n, k) between a triangle's corners."""
    assert hits.weights is not None
    rows = np.ascontiguousarray(table.take(hits.triangle, axis=0).T)[:, :, None]
    value = rows[3:6] * hits.weights[0]
    value += rows[0:3]
    value += rows[6:9] * hits.weights[1]
    return value


def _radiance(scene: Scene, eye: FloatArray, hits: Hits, points: _Points) -> Float32Array:
    """Light (3, n, k) towards the eye from all lamps and from none."""
    lights = scene.lights
    result = np.empty(points.normal.shape, dtype=np.float32)
    for k in range(3):
        result[k] = points.steady[k]
    if not (lights.headlight or len(lights.directional_color) or len(lights.point_color)):
        return result
    nv = _dot(points.normal, points.eyeward)
    for direction, color in zip(lights.directional_direction, lights.directional_color, strict=True):
        _add_light(result, points, nv, -direction, color)
    for place, color in zip(lights.point_position, lights.point_color, strict=True):
        assert hits.position is not None
        offset = (place - eye).astype(np.float32)[:, None, None] - hits.position.astype(np.float32)
        nearness = np.reciprocal(np.maximum(_dot(offset, offset), _LEAST_DISTANCE2))
        offset *= np.sqrt(nearness)
        _add_light(result, points, nv, offset, color, nearness)
    if lights.headlight:
        _add_light(result, points, nv, points.eyeward, np.full(3, HEADLIGHT, np.float32))
    return result


def _add_light(
    result: Float32Array,
    points: _Points,
    nv: Float32Array,
    light: Float32Array,
    color: Float32Array,
    falloff: Float32Array | None = None,
) -> None:
    """Add what one lamp sends to the eye by way of each point.

    GGX with Smith's height-correlated shadowing (Heitz 2014, equation 99) and Schlick's Fresnel term
    (1994); the half vector is needed only through its products with the others. The base gets the light that
    the layer lets in and out again, so no surface returns more than it receives.

    Args:
        result: (3, n, k), added to.
        points: the points.
        nv: (n, k) cosine between normal and eye; below 0 where interpolation turns a normal away.
        light: (3, n, k) unit directions to the lamp, or (3,) for all.
        color: (3,) irradiance on a surface that faces the lamp.
        falloff: (n, k) factor of `color`.
    """
    nl = np.maximum(_dot(points.normal, light), np.float32(0))
    half_angle = _dot(points.eyeward, light)
    half_angle += _ONE
    np.maximum(half_angle, _LEAST_COSINE, out=half_angle)
    # From the cosines as they are: a normal that is bent past the silhouette must not pretend to face
    # the half vector, or light from behind would glint along every outline.
    nh2 = np.maximum(nl + nv, np.float32(0))
    nv = np.maximum(nv, _LEAST_COSINE)
    nh2 *= nh2
    half_angle *= _HALF
    nh2 /= half_angle
    np.minimum(nh2 * np.float32(0.25), _ONE, out=nh2)
    a2 = points.alpha2
    rest = _ONE - a2
    spread = np.multiply(nh2, rest, out=nh2)
    np.subtract(_ONE, spread, out=spread)
    masking = _shadowing(nl, nv, a2, rest)
    masking += _shadowing(nv, nl, a2, rest)
    received = nl if falloff is None else nl * falloff
    spread *= spread
    spread *= masking
    specular = received * (a2 * np.float32(0.5 / math.pi))
    specular /= spread
    grazing = _fifth(np.sqrt(half_angle, out=half_angle))
    rim = specular * grazing
    specular -= rim
    rim *= points.specular90
    base = _fifth(nl)
    np.subtract(_ONE, base, out=base)
    away = _fifth(nv)
    base *= np.subtract(_ONE, away, out=away)
    base *= received
    for k in range(3):
        result[k] += color[k] * rim
        result[k] += (color[k] * points.base[k] * points.diffuse) * base
        result[k] += (color[k] * points.specular0[k]) * specular


def _shadowing(one: Float32Array, other: Float32Array, a2: Values, rest: Values) -> Float32Array:
    """The first cosine times √(a² + (1 − a²)·other²), a term of Smith's masking and shadowing."""
    result: Float32Array = other * other
    result *= rest
    result += a2
    np.sqrt(result, out=result)
    result *= one
    return result


def _dot(a: Float32Array, b: Float32Array) -> Float32Array:
    """Dot products along the first axis of (3, …) arrays or a (3,), summed in the order x, y, z."""
    result: Float32Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def _fifth(cosine: Float32Array) -> Float32Array:
    """(1 − cosine)⁵, of Schlick's approximation."""
    rest = _ONE - cosine
    result: Float32Array = rest * rest
    result *= result
    result *= rest
    return result


@lru_cache(maxsize=1)
def _material_table(scene: Scene) -> Float32Array:
    """The materials as the lamp loop wants them (M, 14): the values of `_Points`, in its order."""
    materials, ambient = scene.materials, scene.lights.ambient
    lit = (~materials.unlit).astype(np.float32)
    alpha = np.maximum(materials.roughness, np.float32(LEAST_ROUGHNESS)) ** 2
    table = np.empty((len(lit), 14), dtype=np.float32)
    table[:, 0:3] = materials.color * lit[:, None]
    table[:, 3:6] = materials.color * np.where(materials.unlit[:, None], np.float32(1), ambient)
    table[:, 6:9] = materials.emission * lit[:, None]
    table[:, 9] = lit * (1 - materials.metallic) * np.float32((1 - _DIELECTRIC) / math.pi)
    table[:, 10] = lit * materials.metallic
    table[:, 11] = lit * (1 - materials.metallic) * np.float32(_DIELECTRIC)
    table[:, 12] = lit
    table[:, 13] = np.where(materials.unlit, np.float32(1), alpha * alpha)
    return table


def _materials_at(table: Float32Array, material: Int32Array) -> tuple[Values, ...]:
    """The columns of the table at each group, as plain numbers where one material has all groups."""
    if len(table) == 1:
        return tuple(table[0])
    if bool((material == material[0]).all()):
        return tuple(table[material[0]])
    return tuple(np.ascontiguousarray(table.take(material, axis=0).T)[:, :, None])
