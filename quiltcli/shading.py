"""Shading: the light that leaves each visible point towards the eye.

Surfaces reflect as a Lambert base under a GGX layer. Nothing casts a shadow and light is not passed on
from surface to surface. Every sum is written out in a fixed order of single-precision operations, so a
pixel's value depends neither on the machine nor on which other pixels are shaded with it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array
from quiltcli.raster.hits import Hits
from quiltcli.scene import Materials, Scene

# Arrays of this many pixels stay in the second-level cache from one operation to the next.
BLOCK = 16384
# Irradiance of the light at the eye; a white surface that faces it comes out near 1.
HEADLIGHT = 3.0
# Lights have no size: below this roughness their image in a surface would be too bright for half floats.
LEAST_ROUGHNESS = 0.09
# The largest finite half float; brighter values are written as this.
MOST_HALF = np.float32(65504)
_DIELECTRIC = 0.04
_LEAST_COSINE = np.float32(1e-4)
_LEAST_DISTANCE2 = np.float32(1e-6)

Values: TypeAlias = "Float32Array | np.float32"


@dataclass(frozen=True)
class _Points:
    """Visible points in n groups of k, like the hits they come from.

    What a material says is (n,), or a number where all points agree; vertex colours make it (k, n).

    Attributes:
        normal: (3, k, n) unit shading normals, on the side of the eye.
        eyeward: (3, k, n) unit directions to the eye.
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


def shade(scene: Scene, eye: FloatArray, hits: Hits) -> Float32Array:
    """Linear RGB (3, k, G) float32 of every hit.

    Args:
        scene: the scene.
        eye: (3,) world metres.
        hits: G groups of k visible points.
    """
    table = _material_table(scene.materials, scene.lights.ambient)
    result = np.empty((3, *hits.pixel.shape), dtype=np.float32)
    for part in _blocks(hits):
        points = _points(scene, table, hits, part)
        result[:, :, part] = _radiance(scene, eye, hits.position[:, :, part], points)
    return result


def shading_normals(scene: Scene, hits: Hits) -> Float32Array:
    """Unit normals (3, k, G) float32 as shading uses them: interpolated, on the side of the eye."""
    result = np.empty((3, *hits.pixel.shape), dtype=np.float32)
    for part in _blocks(hits):
        result[:, :, part] = _normals(scene, hits, part)[0]
    return result


def _blocks(hits: Hits) -> Iterator[slice]:
    """Groups of hits, about `BLOCK` pixels at a time."""
    pixels, groups = hits.pixel.shape
    step = max(BLOCK // pixels, 1)
    for start in range(0, groups, step):
        yield slice(start, start + step)


def _points(scene: Scene, table: Float32Array, hits: Hits, part: slice) -> _Points:
    normal, eyeward = _normals(scene, hits, part)
    triangle = hits.triangle[part]
    rows = _materials_at(table, scene.material.take(triangle))
    base, ambient, emission = rows[0:3], rows[3:6], rows[6:9]
    diffuse, metallic, dielectric, specular90, alpha2 = rows[9:14]
    if scene.corner_colors is not None:
        color = _interpolated(scene.corner_colors, triangle, hits, part)
        base = tuple(v * c for v, c in zip(base, color, strict=True))
        ambient = tuple(v * c for v, c in zip(ambient, color, strict=True))
    return _Points(
        normal=normal,
        eyeward=eyeward,
        base=base,
        steady=tuple(a + e for a, e in zip(ambient, emission, strict=True)),
        diffuse=diffuse,
        specular0=tuple(dielectric + metallic * v for v in base),
        specular90=specular90,
        alpha2=alpha2,
    )


def _normals(scene: Scene, hits: Hits, part: slice) -> tuple[Float32Array, Float32Array]:
    """Unit shading normals on the side of the eye, and unit directions to the eye, both (3, k, n).

    The triangle's own normal decides which side the eye is on, so interpolation cannot turn a
    silhouette inside out.
    """
    eyeward = hits.position[:, :, part].astype(np.float32)
    eyeward *= np.float32(-1) / np.sqrt(_dot(eyeward, eyeward))
    normal, own = _interpolated(scene.corner_normals, hits.triangle[part], hits, part, extra=True)
    length = np.sqrt(_dot(normal, normal) + np.float32(1e-30))
    normal *= np.copysign(np.float32(1), _dot(own, eyeward)) / length
    return normal, eyeward


def _radiance(scene: Scene, eye: FloatArray, position: FloatArray, points: _Points) -> Float32Array:
    """Light (3, k, n) towards the eye from all lamps and from none."""
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
        offset = (place - eye).astype(np.float32)[:, None, None] - position.astype(np.float32)
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
        result: (3, k, n), added to.
        points: the points.
        nv: (k, n) cosine between normal and eye; below 0 where interpolation turns a normal away.
        light: (3, k, n) unit directions to the lamp, or (3,) for all.
        color: (3,) irradiance on a surface that faces the lamp.
        falloff: (k, n) factor of `color`.
    """
    one, half = np.float32(1), np.float32(0.5)
    nl = np.maximum(_dot(points.normal, light), np.float32(0))
    half_angle = np.maximum(one + _dot(points.eyeward, light), _LEAST_COSINE)
    # From the cosines as they are: a normal that is bent past the silhouette must not pretend to face
    # the half vector, or light from behind would glint along every outline.
    total = np.maximum(nl + nv, np.float32(0))
    nv = np.maximum(nv, _LEAST_COSINE)
    nh2 = np.minimum(half * total * total / half_angle, one)
    a2 = points.alpha2
    rest = one - a2
    spread = one - nh2 * rest
    masking = nl * np.sqrt(a2 + rest * nv * nv) + nv * np.sqrt(a2 + rest * nl * nl)
    received = nl if falloff is None else nl * falloff
    specular = received * a2 * np.float32(0.5 / math.pi) / (spread * spread * masking)
    grazing = _fifth(one - np.sqrt(half * half_angle))
    layer = specular * (one - grazing)
    rim = specular * grazing * points.specular90
    base = received * points.diffuse * (one - _fifth(one - nl)) * (one - _fifth(one - nv))
    for k in range(3):
        result[k] += color[k] * (points.base[k] * base + points.specular0[k] * layer + rim)


def _dot(a: Float32Array, b: Float32Array) -> Float32Array:
    """Dot products along the first axis of (3, …) arrays or a (3,), summed in the order x, y, z."""
    result: Float32Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def _fifth(x: Float32Array) -> Float32Array:
    square = x * x
    return square * square * x


def _interpolated(
    table: Float32Array, triangle: Int32Array, hits: Hits, part: slice, *, extra: bool = False
) -> Any:
    """Values (3, k, n) between a triangle's corners; with `extra` also the table's last columns (3, 1, n)."""
    rows = np.ascontiguousarray(table.take(triangle, axis=0).T)[:, None]
    value = hits.b[:, part] * rows[3:6]
    value += rows[0:3]
    value += hits.c[:, part] * rows[6:9]
    return (value, rows[9:12]) if extra else value


def _material_table(materials: Materials, ambient: Float32Array) -> Float32Array:
    """The materials as the lamp loop wants them (M, 14): the values of `_Points`, in its order."""
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
    """The columns of the table at each point, as plain numbers where one material has all points."""
    first = material[0]
    if len(table) == 1 or bool((material == first).all()):
        return tuple(table[first])
    return tuple(np.ascontiguousarray(table.take(material, axis=0).T))
