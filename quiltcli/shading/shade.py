"""Shading: the light that leaves each visible point towards the eye.

Surfaces reflect as a Lambert base under a GGX layer, matte ones (`specular: 0`) as the base alone.
Nothing casts a shadow and light is not passed on from surface to surface. Every sum is written out in a
fixed order of single-precision operations, so a pixel's value depends neither on the machine nor on
which other pixels are shaded with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, Int32Array
from quiltcli.scene import Scene
from quiltcli.visibility.resolve.hits import Hits, Points, Wanted
from quiltcli.visibility.resolve.vectors import PointVectors, Vectors, along, products, vector_values

# Irradiance of the light at the eye; a white surface that faces it comes out near 1.
HEADLIGHT = 3.0
# Lights have no size: below this roughness their image in a surface would be too bright for half floats.
LEAST_ROUGHNESS = 0.09
# Nearer to a point light than this, in metres, its light does not grow any more.
LEAST_DISTANCE = 1e-3
_DIELECTRIC = 0.04
_LEAST_COSINE = np.float32(1e-4)
_LEAST_DISTANCE2 = np.float32(LEAST_DISTANCE**2)
_LEAST_LENGTH2 = np.float32(1e-30)
_ONE, _HALF, _ROOT2 = np.float32(1), np.float32(0.5), np.float32(math.sqrt(2))

Values: TypeAlias = "Float32Array | np.float32"


@dataclass(frozen=True)
class _Layer:
    """The GGX layer of n groups of k visible points, and what of it depends on the eye alone.

    What a material says is (n, 1), or a number where all points agree.

    Attributes:
        specular0: values by colour, what it reflects at normal incidence.
        specular90: what it reflects at grazing incidence, 0 where there is none.
        coat: how much of the base it covers, 0 where there is none.
        alpha2: the square of GGX's alpha.
        nv: (n, k) cosine between normal and eye; below 0 where interpolation turns a normal away.
        front: (n, k) the same where the eye is in front, almost 0 elsewhere.
        root: (n, k) root of `masking_root` of the eye.
        leaving: (n, k) share of the base's light that the layer lets out to the eye.
    """

    specular0: tuple[Values, ...]
    specular90: Values
    coat: Values
    alpha2: Values
    nv: Float32Array
    front: Float32Array
    root: Float32Array
    leaving: Float32Array


@dataclass(frozen=True)
class _Surface:
    """What light meets at visible points in n groups of k.

    What a material says is (n, 1), or a number where all points agree; vertex colours make it (n, k).
    Vectors are not of unit length: their products are divided by their lengths, which takes less time.

    Attributes:
        normal: shading normals on the side of the eye.
        normal_scale: (n, k), (n, 1) or (1, 1) one over their lengths.
        ray: directions from the eye.
        ray_scale: (n, k) one over their lengths, negative: towards the eye; None where nobody asks for it.
        base: base colour, 3 values, or 1 where all is grey.
        steady: as many values, light that needs no lamp: ambient and emission, or an unlit surface's colour.
        diffuse: share of light for the Lambert base, over π.
        layer: what lies on the base; None where all points are matte.
    """

    normal: Vectors
    normal_scale: Float32Array
    ray: Vectors
    ray_scale: Float32Array | None
    base: tuple[Values, ...]
    steady: tuple[Values, ...]
    diffuse: Values
    layer: _Layer | None


def shading_wants(scene: Scene) -> Wanted:
    """What shading asks of hits."""
    wanted = Wanted.NORMAL
    if scene.corner_colors is not None:
        wanted |= Wanted.WEIGHTS
    if len(scene.lights.point_color):
        wanted |= Wanted.POSITION
    return wanted


def shade(scene: Scene, eye: FloatArray, seen: Points) -> tuple[Float32Array, ...]:
    """Linear red, green and blue of points: (n, k), (n, 1) or (1, k) where others agree, float32.

    Of what is grey at all points there is one array, not three.

    Args:
        scene: the scene.
        eye: (3,) world metres.
        seen: n groups of k visible points, with what `shading_wants` asks for.
    """
    points = _points(scene, seen)
    lights = scene.lights
    total: list[Values] = list(points.steady)
    for direction, color in zip(lights.directional_direction, lights.directional_color, strict=True):
        nl = along(points.normal, -direction)
        _add_light(total, points, nl, along(points.ray, -direction) if points.layer else None, color)
    for place, color in zip(lights.point_position, lights.point_color, strict=True):
        assert seen.position is not None
        offset = (place - eye).astype(np.float32)[:, None, None] - seen.position.astype(np.float32)
        towards = PointVectors(offset)
        nearness = np.reciprocal(np.maximum(products(towards, towards), _LEAST_DISTANCE2))
        offset *= np.sqrt(nearness)
        nl, rl = products(points.normal, towards), products(points.ray, towards)
        _add_light(total, points, nl, rl, color, nearness)
    if lights.headlight:
        assert points.ray_scale is not None
        nl = products(points.normal, points.ray)
        nl *= points.ray_scale
        _add_light(total, points, nl, np.reciprocal(points.ray_scale), np.full(3, HEADLIGHT, np.float32))
    return tuple(np.full(seen.triangle.shape, v) if isinstance(v, np.float32) else v for v in total)


def shading_normals(hits: Hits) -> Float32Array:
    """Unit normals (3, G, k), or (3, 1, 1) one for all, as shading uses them: on the side of the eye."""
    assert hits.normal is not None
    return np.multiply(vector_values(hits.normal), _over_length(hits.normal))


def _points(scene: Scene, seen: Points) -> _Surface:
    assert seen.normal is not None
    rows = _materials_of(scene, seen.triangle)
    base, ambient, emission = rows[0:3], rows[3:6], rows[6:9]
    diffuse, metallic, dielectric, specular90, coat, alpha2 = rows[9:15]
    if scene.corner_colors is not None:
        color = vertex_colors(scene.corner_colors, seen)
        base = tuple(v * c for v, c in zip(base, color, strict=True))
        ambient = tuple(v * c for v, c in zip(ambient, color, strict=True))
    steady = tuple(a + e for a, e in zip(ambient, emission, strict=True))
    if _is_grey(base) and _is_grey(steady) and scene.lights.grey:
        base, steady = base[:1], steady[:1]
    normal_scale = _over_length(seen.normal)
    shiny = bool(np.any(specular90))
    ray_scale = _over_length(seen.ray, -_ONE) if shiny or scene.lights.headlight else None
    layer = None
    if shiny and ray_scale is not None:
        nv = products(seen.normal, seen.ray)
        nv *= normal_scale
        nv *= ray_scale
        front = np.maximum(nv, _LEAST_COSINE)
        layer = _Layer(
            specular0=_reflected(dielectric, metallic, base),
            specular90=specular90,
            coat=coat,
            alpha2=alpha2,
            nv=nv,
            front=front,
            root=_masking_root(front, alpha2),
            leaving=_let_through(front, coat),
        )
    return _Surface(
        normal=seen.normal,
        normal_scale=normal_scale,
        ray=seen.ray,
        ray_scale=ray_scale,
        base=base,
        steady=steady,
        diffuse=diffuse,
        layer=layer,
    )


def _is_grey(color: tuple[Values, ...]) -> bool:
    """Whether three values are one number."""
    red = color[0]
    return all(isinstance(value, np.float32) and value == red for value in color)


def _reflected(dielectric: Values, metallic: Values, base: tuple[Values, ...]) -> tuple[Values, ...]:
    """What the layer reflects at normal incidence; one for all colours where nothing is metal."""
    if not np.any(metallic):
        return (dielectric,) * len(base)
    return tuple(dielectric + metallic * v for v in base)


def _over_length(vectors: Vectors, sign: np.float32 = _ONE) -> Float32Array:
    """`sign` over the lengths (…) of vectors."""
    length2 = products(vectors, vectors)
    length2 += _LEAST_LENGTH2
    result: Float32Array = np.divide(sign, np.sqrt(length2, out=length2), out=length2)
    return result


def vertex_colors(table: Float32Array, seen: Points) -> Float32Array:
    """Colours (3, n, k) between the corners of triangles, by the scene's `corner_colors`."""
    assert seen.weights is not None
    rows = _columns(table, seen.triangle)
    value: Float32Array = rows[3:6] * seen.weights[0]
    value += rows[0:3]
    value += rows[6:9] * seen.weights[1]
    return value


def _add_light(
    total: list[Values],
    points: _Surface,
    nl: Float32Array,
    rl: Float32Array | None,
    color: Float32Array,
    falloff: Float32Array | None = None,
) -> None:
    """Add what one lamp sends to the eye by way of each point.

    The base gets the light that the layer lets in and out again, so no surface returns more than it
    receives.

    Args:
        total: red, green and blue, or grey, added to.
        points: the points.
        nl: (n, k) or (n, 1) products of normals and unit directions to the lamp; used up.
        rl: (n, k) products of rays and unit directions to the lamp; used up. A layer needs them.
        color: (3,) irradiance on a surface that faces the lamp.
        falloff: (n, k) factor of `color`.
    """
    nl *= points.normal_scale
    np.maximum(nl, np.float32(0), out=nl)
    received = nl if falloff is None else nl * falloff
    layer = points.layer
    glints: tuple[Float32Array | None, ...] = (None,) * len(total)
    base = received
    if layer is not None:
        assert rl is not None
        assert points.ray_scale is not None
        rl *= points.ray_scale
        glints = _glints(layer, nl, rl, received, color)
        base = layer.leaving * (_let_through(nl, layer.coat) * received)
    for k, glint in enumerate(glints):
        part = base * (color[k] * points.base[k] * points.diffuse)
        if glint is not None:
            part += glint
        total[k] = np.add(part, total[k], out=part if part.size >= np.size(total[k]) else None)


def _glints(
    layer: _Layer, nl: Float32Array, vl: Float32Array, received: Float32Array, color: Float32Array
) -> tuple[Float32Array, ...]:
    """Red, green and blue, or grey, (n, k) that a layer reflects.

    GGX with Smith's height-correlated shadowing (Heitz 2014, equation 99) and Schlick's Fresnel term
    (1994); the half vector is needed only through its products with the others.

    Args:
        layer: the layer.
        nl: (n, k) or (n, 1) cosine between normal and lamp, 0 where it is behind.
        vl: (n, k) cosine between eye and lamp; used up.
        received: (n, k) or (n, 1) share of the lamp's irradiance.
        color: (3,) the irradiance.
    """
    a2 = layer.alpha2
    vl += _ONE
    half_angle = np.maximum(vl, _LEAST_COSINE, out=vl)  # 1 + v·l, which is 2 (v·h)²
    # From the cosines as they are: a normal that is bent past the silhouette must not pretend to face
    # the half vector, or light from behind would glint along every outline.
    spread = layer.nv + nl  # twice (n·h)² after the next four lines
    np.maximum(spread, np.float32(0), out=spread)
    spread *= spread
    spread /= half_angle
    np.minimum(spread, np.float32(2), out=spread)
    spread *= (a2 - _ONE) * _HALF
    spread += _ONE
    spread *= spread
    masking = layer.front * _masking_root(nl, a2)
    masking += layer.root * nl
    spread *= masking
    strength = np.divide(received, spread, out=spread)  # but for a factor α²/2π
    rim = _fifth(np.subtract(_ROOT2, np.sqrt(half_angle, out=half_angle), out=half_angle))
    factor = a2 * np.float32(0.5 / math.pi)
    first, colors = layer.specular0[0], len(layer.specular0)
    if color[0] == color[1] == color[2] and all(value is first for value in layer.specular0):
        return (_fresnel(first, layer, rim, factor * color[0], strength, rim),) * colors
    return tuple(_fresnel(layer.specular0[k], layer, rim, factor * color[k], strength) for k in range(3))


def _fresnel(
    specular0: Values,
    layer: _Layer,
    rim: Float32Array,
    factor: Values,
    strength: Float32Array,
    out: Float32Array | None = None,
) -> Float32Array:
    """`factor`·`strength`·(F₀ + (F₉₀ − F₀)(1 − v·h)⁵), given `rim`, the fifth power of √2 − √2·v·h."""
    level0 = factor * specular0
    result = np.multiply(rim, (factor * layer.specular90 - level0) * np.float32(2**-2.5), out=out)
    result += level0
    result *= strength
    return result


def _masking_root(cosine: Float32Array, alpha2: Values) -> Float32Array:
    """√(α² + (1 − α²)·cosine²), of Smith's masking and shadowing."""
    root = cosine * cosine
    root *= _ONE - alpha2
    root += alpha2
    result: Float32Array = np.sqrt(root, out=root)
    return result


def _let_through(cosine: Float32Array, coat: Values) -> Float32Array:
    """What a layer lets through at an angle: 1 less the rise of its reflection towards the rim."""
    result = _fifth(_ONE - cosine)
    result *= -coat
    result += _ONE
    return result


def _fifth(value: Float32Array) -> Float32Array:
    """The fifth power: of 1 − cosine, in Schlick's approximation."""
    result: Float32Array = value * value
    result *= result
    result *= value
    return result


@lru_cache(maxsize=1)
def _material_table(scene: Scene) -> Float32Array:
    """The materials as the lamp loop wants them (M, 15), in the order in which `_points` takes them."""
    materials, ambient = scene.materials, scene.lights.ambient
    lit = (~materials.unlit).astype(np.float32)
    alpha = np.maximum(materials.roughness, np.float32(LEAST_ROUGHNESS)) ** 2
    paint, coat = lit * (1 - materials.metallic), np.float32(_DIELECTRIC) * materials.specular
    table = np.empty((len(lit), 15), dtype=np.float32)
    table[:, 0:3] = materials.color * lit[:, None]
    table[:, 3:6] = materials.color * np.where(materials.unlit[:, None], np.float32(1), ambient)
    table[:, 6:9] = materials.emission * lit[:, None]
    table[:, 9] = paint * (1 - coat) / np.float32(math.pi)
    table[:, 10] = lit * materials.metallic
    table[:, 11] = paint * coat
    table[:, 12] = lit * materials.metallic + paint * materials.specular
    table[:, 13] = materials.specular
    table[:, 14] = np.where(materials.unlit, np.float32(1), alpha * alpha)
    return table


def alpha(scene: Scene, triangle: Int32Array) -> Values:
    """GGX's alpha of the triangles' materials, or a number where all have one."""
    return np.sqrt(_materials_of(scene, triangle)[14])


def _materials_of(scene: Scene, triangle: Int32Array) -> tuple[Values, ...]:
    """The columns of the table at triangles of any shape, as plain numbers where one material has all."""
    table = _material_table(scene)
    if len(table) == 1:
        return tuple(table[0])
    material = scene.material.take(triangle)
    first = material.flat[0]
    if bool((material == first).all()):
        return tuple(table[first])
    return tuple(_columns(table, material))


def _columns(table: Float32Array, rows: Int32Array) -> Float32Array:
    """The table's columns (columns, …) at some of its rows (…)."""
    return np.ascontiguousarray(table.take(rows.ravel(), axis=0).T).reshape(-1, *rows.shape)
