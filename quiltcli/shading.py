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
    Vectors are not of unit length: their products are divided by their lengths, which takes less time.

    Attributes:
        normal: (3, n, k) shading normals on the side of the eye; (3, n, 1) where flat.
        normal_scale: (n, k) or (n, 1) one over their lengths.
        ray: (3, n, k) directions from the eye.
        ray_scale: (n, k) one over their lengths, negative: towards the eye.
        nv: (n, k) cosine between normal and eye; below 0 where interpolation turns a normal away.
        base: 3 values, base colour.
        steady: 3 values, light that needs no lamp: ambient and emission, or the colour of an unlit surface.
        diffuse: share of light for the Lambert base, over π.
        specular0: 3 values, what the layer reflects at normal incidence.
        specular90: what it reflects at grazing incidence, 0 on an unlit surface.
        alpha2: the square of GGX's alpha.
    """

    normal: Float32Array
    normal_scale: Float32Array
    ray: Float32Array
    ray_scale: Float32Array
    nv: Float32Array
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
    return np.multiply(hits.normal, _over_length(hits.normal))


def _points(scene: Scene, hits: Hits) -> _Points:
    assert hits.normal is not None
    rows = _materials_at(_material_table(scene), scene.material.take(hits.triangle))
    base, ambient, emission = rows[0:3], rows[3:6], rows[6:9]
    diffuse, metallic, dielectric, specular90, alpha2 = rows[9:14]
    if scene.corner_colors is not None:
        color = _colors(scene.corner_colors, hits)
        base = tuple(v * c for v, c in zip(base, color, strict=True))
        ambient = tuple(v * c for v, c in zip(ambient, color, strict=True))
    normal_scale, ray_scale = _over_length(hits.normal), _over_length(hits.ray, -_ONE)
    nv = _dot(hits.normal, hits.ray)
    nv *= normal_scale
    nv *= ray_scale
    return _Points(
        normal=hits.normal,
        normal_scale=normal_scale,
        ray=hits.ray,
        ray_scale=ray_scale,
        nv=nv,
        base=base,
        steady=tuple(a + e for a, e in zip(ambient, emission, strict=True)),
        diffuse=diffuse,
        specular0=_reflected(dielectric, metallic, base),
        specular90=specular90,
        alpha2=alpha2,
    )


def _reflected(dielectric: Values, metallic: Values, base: tuple[Values, ...]) -> tuple[Values, ...]:
    """What the layer reflects at normal incidence; one for all colours where nothing is metal."""
    if not np.any(metallic):
        return (dielectric,) * 3
    return tuple(dielectric + metallic * v for v in base)


def _over_length(vectors: Float32Array, sign: np.float32 = _ONE) -> Float32Array:
    """`sign` over the lengths (…) of vectors along the first axis."""
    length2 = _dot(vectors, vectors)
    length2 += _LEAST_LENGTH2
    result: Float32Array = np.divide(sign, np.sqrt(length2, out=length2), out=length2)
    return result


def _colors(table: Float32Array, hits: Hits) -> Float32Array:
    """Vertex colours (3, n, k) between a triangle's corners."""
    assert hits.weights is not None
    rows = np.ascontiguousarray(table.take(hits.triangle, axis=0).T)[:, :, None]
    value: Float32Array = rows[3:6] * hits.weights[0]
    value += rows[0:3]
    value += rows[6:9] * hits.weights[1]
    return value


def _radiance(scene: Scene, eye: FloatArray, hits: Hits, points: _Points) -> Float32Array:
    """Light (3, n, k) towards the eye from all lamps and from none."""
    lights = scene.lights
    result = np.empty(points.ray.shape, dtype=np.float32)
    for k in range(3):
        result[k] = points.steady[k]
    for direction, color in zip(lights.directional_direction, lights.directional_color, strict=True):
        _add_light(result, points, -direction, color)
    for place, color in zip(lights.point_position, lights.point_color, strict=True):
        assert hits.position is not None
        offset = (place - eye).astype(np.float32)[:, None, None] - hits.position.astype(np.float32)
        nearness = np.reciprocal(np.maximum(_dot(offset, offset), _LEAST_DISTANCE2))
        offset *= np.sqrt(nearness)
        _add_light(result, points, offset, color, nearness)
    if lights.headlight:
        eyeward = points.ray * points.ray_scale
        _add_light(result, points, eyeward, np.full(3, HEADLIGHT, np.float32))
    return result


def _add_light(
    result: Float32Array,
    points: _Points,
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
        light: (3, n, k) unit directions to the lamp, or (3,) for all.
        color: (3,) irradiance on a surface that faces the lamp.
        falloff: (n, k) factor of `color`.
    """
    nl = _dot(points.normal, light) * points.normal_scale
    np.maximum(nl, np.float32(0), out=nl)
    vl = _dot(points.ray, light)
    vl *= points.ray_scale
    vl += _ONE
    half_angle = np.maximum(vl, _LEAST_COSINE, out=vl)  # 1 + v·l, which is 2 (v·h)²
    # From the cosines as they are: a normal that is bent past the silhouette must not pretend to face
    # the half vector, or light from behind would glint along every outline.
    nh2 = nl + points.nv  # from here on twice (n·h)²
    np.maximum(nh2, np.float32(0), out=nh2)
    nh2 *= nh2
    nh2 /= half_angle
    np.minimum(nh2, np.float32(2), out=nh2)
    a2 = points.alpha2
    rest = _ONE - a2
    spread = np.multiply(nh2, rest * _HALF, out=nh2)
    np.subtract(_ONE, spread, out=spread)
    nv = np.maximum(points.nv, _LEAST_COSINE)
    received = nl if falloff is None else nl * falloff
    spread *= spread
    spread *= _shadowing(nl, nv, a2, rest) + _shadowing(nv, nl, a2, rest)
    specular = np.divide(received * (a2 * np.float32(0.5 / math.pi)), spread, out=spread)
    cosine = np.sqrt(half_angle, out=half_angle)
    cosine *= np.float32(math.sqrt(0.5))
    rim = _fifth(cosine)
    rim *= specular
    specular -= rim
    away = _fifth(nv)
    away -= _ONE
    base = away * ((_fifth(nl) - _ONE) * received)
    _add_parts(result, points, color, base, specular, rim * points.specular90)


def _add_parts(
    result: Float32Array,
    points: _Points,
    color: Float32Array,
    base: Float32Array,
    specular: Float32Array,
    rim: Float32Array,
) -> None:
    """Add the parts of a lamp's light: what takes the surface's colour, what the layer reflects, the rim."""

    def layer(k: int) -> Float32Array:
        light: Float32Array = (color[k] * points.specular0[k]) * specular
        light += color[k] * rim
        return light

    same = color[0] == color[1] == color[2] and points.specular0[0] is points.specular0[1]
    shared = layer(0) if same else None
    for k in range(3):
        result[k] += layer(k) if shared is None else shared
        result[k] += (color[k] * points.base[k] * points.diffuse) * base


def _shadowing(one: Float32Array, other: Float32Array, a2: Values, rest: Values) -> Float32Array:
    """The first cosine times √(a² + (1 − a²)·other²), a term of Smith's masking and shadowing."""
    root = other * other * rest
    root += a2
    result: Float32Array = one * np.sqrt(root, out=root)
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
