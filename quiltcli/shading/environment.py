"""Light of an environment at surfaces: what the base receives, and what the layer above it reflects.

The split sum of Karis (2013) with what is reflected several times between the layer's microfacets
(Fdez-Agüera, A Multiple-Scattering Microfacet Model for Real-Time Image-Based Lighting, JCGT 8(1), 2019):
a white body, metal or not, of any roughness, is as bright as the white around it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene.lights import Environment
from quiltcli.shading.brdf import LEAST_ROUGHNESS, Layer, Lobes
from quiltcli.shading.materials import Values
from quiltcli.shading.surface import Surface
from quiltcli.visibility.resolve.vectors import sum_of_products, vector_values

_ONE = np.float32(1)
_TABLE = 32
_STRATA = 32
_LEAST = np.float32(1e-20)


@dataclass(frozen=True)
class Around:
    """What of an environment matters at n groups of k points, whatever they are made of.

    Attributes:
        light: the environment.
        normal: (3, n, k) unit normals.
        shown: (n, k) share of it that nothing hides; None for all.
    """

    light: Environment
    normal: Float32Array
    shown: Float32Array | None = None


def around(light: Environment, surface: Surface) -> Around:
    """What matters of an environment at surfaces."""
    return Around(light, vector_values(surface.normal) * surface.normal_scale)


def from_around(
    found: Around, surface: Surface, lobes: Lobes, base: tuple[Values, ...], layer: Layer | None
) -> Iterator[tuple[int, Float32Array, Float32Array | None]]:
    """For each colour its number, what the base returns, and what the layer reflects."""
    diffuse = looked_up(found.light.maps.diffuse, found.normal)
    glints: list[Float32Array | None] = [None, None, None]
    through: list[Values] = [_ONE] * 3
    if layer is not None:
        glints, through = _reflected(found, surface, lobes, layer, diffuse)
    body = lobes.diffuse * np.float32(math.pi) + lobes.dielectric
    for k in range(3):
        part = diffuse[k] * (base[k % len(base)] * (body * (through[k] * found.light.color[k])))
        glint = glints[k]
        if glint is not None:
            glint = glint * found.light.color[k]
        if found.shown is not None:
            part = part * found.shown
            glint = None if glint is None else glint * found.shown
        yield k, part, glint


def _reflected(
    found: Around, surface: Surface, lobes: Lobes, layer: Layer, diffuse: Float32Array
) -> tuple[list[Float32Array | None], list[Values]]:
    """What the layer reflects of radiance 1 in each colour, and the share that it leaves to the base."""
    roughness = np.sqrt(np.sqrt(np.asarray(layer.alpha2, dtype=np.float32)))
    first, second = _albedo_parts(np.minimum(layer.front, _ONE), roughness)
    missing = _ONE - (first + second)
    mirrored = _mirrored(found, surface, roughness)
    glints: list[Float32Array | None] = []
    through: list[Values] = []
    count = len(layer.specular0)
    for k in range(3):
        specular0 = layer.specular0[k % count]
        single = specular0 * first + layer.specular90 * second
        mean = specular0 + (layer.specular90 - specular0) * np.float32(1 / 21)
        again = missing * (single * mean / np.maximum(_ONE - missing * mean, _LEAST))
        glints.append(single * mirrored[k] + again * diffuse[k])
        through.append(_ONE - (single + again))
    return glints, through


def reflected_share(layer: Layer) -> tuple[Float32Array, ...]:
    """What a layer reflects of even light once, by colour."""
    roughness = np.sqrt(np.sqrt(np.asarray(layer.alpha2, dtype=np.float32)))
    first, second = _albedo_parts(np.minimum(layer.front, _ONE), roughness)
    return tuple(specular0 * first + layer.specular90 * second for specular0 in layer.specular0)


def _mirrored(found: Around, surface: Surface, roughness: Values) -> Float32Array:
    """Radiance (3, n, k) as a mirror shows it that is as rough as the layer."""
    ray, normal = vector_values(surface.ray), found.normal
    way = ray - normal * (sum_of_products(normal, ray) * np.float32(2))
    return _between_levels(found.light.maps.mirrors, way.astype(np.float32, copy=False), roughness)


def _between_levels(mirrors: tuple[Float32Array, ...], way: Float32Array, roughness: Values) -> Float32Array:
    """Radiance (3, n, k) between the two maps whose roughness is next."""
    level = np.broadcast_to(np.minimum(np.asarray(roughness) * 5, np.float32(5)), way.shape[1:])
    below = np.minimum(level.astype(np.int32), len(mirrors) - 2)
    share = level - below.astype(np.float32)
    used = np.unique(below).tolist()
    if len(used) == 1:
        low, high = (looked_up(mirrors[used[0] + k], way) for k in (0, 1))
        return np.asarray(low + (high - low) * share)
    result = np.empty_like(way)
    for each in used:
        some = np.nonzero(below == each)
        part = way[:, some[0], some[1]][:, :, None]
        low, high = (looked_up(mirrors[each + k], part)[:, :, 0] for k in (0, 1))
        result[:, some[0], some[1]] = low + (high - low) * share[some]
    return result


def looked_up(texels: Float32Array, way: Float32Array) -> Float32Array:
    """Values (3, …) between the places of a map, in directions (3, …) of any length."""
    size = len(texels)
    x, y, z = way
    over = np.reciprocal(np.maximum(np.abs(x) + np.abs(y) + np.abs(z), _LEAST))
    u, v = x * over, z * over
    folded_u = np.copysign(_ONE - np.abs(v), u)
    folded_v = np.copysign(_ONE - np.abs(u), v)
    under = y < 0
    u, v = np.where(under, folded_u, u), np.where(under, folded_v, v)
    half = np.float32((size - 1) / 2)
    u, v = u * half + half, v * half + half
    column, row = (np.clip(each.astype(np.int32), 0, size - 2) for each in (u, v))
    u, v = u - column.astype(np.float32), v - row.astype(np.float32)
    flat, stride = texels.reshape(-1, 3), size
    corner = row * stride + column

    def taken(offset: int) -> Float32Array:
        return np.moveaxis(flat.take(corner + offset, axis=0), -1, 0)

    upper, lower = taken(0), taken(stride)
    upper = upper + (taken(1) - upper) * u
    lower = lower + (taken(stride + 1) - lower) * u
    return np.asarray(upper + (lower - upper) * v)


def _albedo_parts(cosine: Float32Array, roughness: Values) -> tuple[Float32Array, Float32Array]:
    """What a layer reflects of even light: the factors of its reflection at normal and grazing incidence."""
    table = albedo_table()
    across = cosine * np.float32(_TABLE - 1)
    down = np.minimum(np.asarray(roughness), _ONE) * np.float32(_TABLE - 1)
    column = np.minimum(across.astype(np.int32), _TABLE - 2)
    row = np.minimum(down.astype(np.int32), _TABLE - 2)
    u, v = across - column.astype(np.float32), down - row.astype(np.float32)
    corner = row * _TABLE + column

    def part(values: Float32Array) -> Float32Array:
        upper, lower = values.take(corner), values.take(corner + _TABLE)
        upper = upper + (values.take(corner + 1) - upper) * u
        lower = lower + (values.take(corner + _TABLE + 1) - lower) * u
        return np.asarray(upper + (lower - upper) * v)

    return part(table[0]), part(table[1])


@lru_cache(maxsize=1)
def albedo_table() -> Float32Array:
    """Both factors (2, 32 · 32) by roughness and cosine: the integral of what the layer reflects.

    Half vectors are spread as GGX's (Karis 2013), by the middles of 32 × 32 strata; the masking is
    Smith's, height-correlated (Heitz 2014).
    """
    middle = (np.arange(_STRATA) + 0.5) / _STRATA
    u, turn = (each.ravel() for each in np.meshgrid(middle, 2 * np.pi * middle))
    result = np.empty((2, _TABLE, _TABLE))
    for row in range(_TABLE):
        alpha2 = max(row / (_TABLE - 1), LEAST_ROUGHNESS) ** 4
        cosine = np.sqrt((1 - u) / (1 + (alpha2 - 1) * u))
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
        for column in range(_TABLE):
            nv = max(column / (_TABLE - 1), 1e-3)
            vh = sine * np.cos(turn) * math.sqrt(1 - nv * nv) + cosine * nv
            nl = 2 * vh * cosine - nv
            lit = (nl > 0) & (vh > 0)
            nl, vh, nh = nl[lit], vh[lit], cosine[lit]
            weight = 2 * nl * vh / (nh * (nl * _root(nv, alpha2) + nv * _root(nl, alpha2)))
            rim = (1 - vh) ** 5
            result[:, row, column] = (weight * (1 - rim)).sum() / u.size, (weight * rim).sum() / u.size
    # No more than there is, whatever the sum's error; on a grid, so that it is the same everywhere.
    result /= np.maximum(result.sum(axis=0), 1)
    return np.asarray(np.rint(result * 2**20) / 2**20).reshape(2, -1).astype(np.float32)


def _root(cosine: FloatArray | float, alpha2: float) -> FloatArray:
    return np.sqrt(alpha2 + (1 - alpha2) * np.square(cosine))
