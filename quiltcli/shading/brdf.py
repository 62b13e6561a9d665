r"""How surfaces reflect: a Lambert base under a GGX layer, matte ones (`specular: 0`) the base alone.

The base gets the light that the layer lets in and out again, so no surface returns more than it receives.

          l  n  v           F  Fresnel (Schlick 1994)
           \ | /            D  normals of the layer (GGX)
    layer ───\|/─── D·F·G    G  masking and shadowing (Smith, height-correlated: Heitz 2014, eq. 99)
    base  ━━━━━━━━━ color/π
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, replace
from functools import lru_cache

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, Int32Array
from quiltcli.scene import Scene
from quiltcli.shading.materials import (
    Colors,
    Parameters,
    Values,
    at_materials,
    occlusion_at,
    parameters_of,
    tint_at,
    varied_emission,
    varied_parameters,
)
from quiltcli.shading.surface import Surface
from quiltcli.visibility.resolve.hits import Points

# Lights have no size: below this roughness their image in a surface would be too bright for half floats.
LEAST_ROUGHNESS = 0.09
_DIELECTRIC = 0.04
_LEAST_COSINE = np.float32(1e-4)
_ONE, _HALF, _ROOT2 = np.float32(1), np.float32(0.5), np.float32(math.sqrt(2))


@dataclass(frozen=True)
class Lobes:
    """What light needs to know of materials, at points or a row a material (M,).

    Attributes:
        paint: the base's colour, but for `tint`.
        emission: light that needs no lamp: what is emitted, or an unlit surface's colour.
        diffuse: share of light for the Lambert base, over π.
        metallic: how much of the layer has the base's colour.
        dielectric: what else the layer reflects at normal incidence.
        specular90: what it reflects at grazing incidence, 0 where there is none.
        coat: how much of the base the layer covers, 0 where there is none.
        alpha2: the square of GGX's alpha.
        tint: what varies and multiplies the colour, (n, k) each; None where nothing does.
        open: (n, k) share of the light from everywhere that arrives; None where all does.
    """

    paint: Colors
    emission: Colors
    diffuse: Values
    metallic: Values
    dielectric: Values
    specular90: Values
    coat: Values
    alpha2: Values
    tint: Colors | None = None
    open: Float32Array | None = None

    @property
    def base(self) -> Colors:
        """The base's colour."""
        if self.tint is None:
            return self.paint
        return tuple(p * t for p, t in zip(self.paint, self.tint, strict=True))


def lobes_of(parameters: Parameters) -> Lobes:
    """What light needs to know of parameters of any shape."""
    lit, metallic, specular = parameters.lit, parameters.metallic, parameters.specular
    alpha = np.maximum(parameters.roughness, np.float32(LEAST_ROUGHNESS)) ** 2
    paint, coat = lit * (_ONE - metallic), np.float32(_DIELECTRIC) * specular
    shown = zip(parameters.emission, parameters.color, strict=True)
    return Lobes(
        paint=tuple(color * lit for color in parameters.color),
        emission=tuple(np.where(lit > 0, emission, color) for emission, color in shown),
        diffuse=paint * (_ONE - coat) / np.float32(math.pi),
        metallic=lit * metallic,
        dielectric=paint * coat,
        specular90=np.asarray(lit * metallic + paint * specular),
        coat=specular,
        alpha2=np.where(lit > 0, alpha * alpha, _ONE),
    )


@lru_cache(maxsize=1)
def _lobe_table(scene: Scene) -> Float32Array:
    """The lobes of the scene's materials side by side (M, 12), for one look-up a point."""
    paint, emission, *others, _, _ = astuple(lobes_of(parameters_of(scene.materials)))
    return np.stack((*paint, *emission, *others), axis=1)


def lobes_at(scene: Scene, seen: Points) -> Lobes:
    """What light needs to know at points: worked out once a material where textures vary colours alone."""
    tint = tint_at(scene, seen)
    varied = varied_parameters(scene, seen)
    if varied is not None:
        lobes = replace(lobes_of(varied), tint=tint)
    else:
        table = at_materials(scene, _lobe_table(scene), seen.triangle)
        diffuse, metallic, dielectric, specular90, coat, alpha2 = table[6:]
        paint, emission = table[0:3], table[3:6]
        lobes = Lobes(paint, emission, diffuse, metallic, dielectric, specular90, coat, alpha2, tint)
    if tint is None and scene.textures is None:
        return lobes
    emission = varied_emission(scene, seen, lobes.emission, tint)
    return replace(lobes, emission=emission, open=occlusion_at(scene, seen))


def alpha(scene: Scene, triangle: Int32Array) -> Values:
    """GGX's alpha of the triangles' materials, or a number where all have one."""
    return np.sqrt(at_materials(scene, _lobe_table(scene), triangle)[-1])


def mirrors(scene: Scene, triangle: Int32Array) -> BoolArray:
    """Whether the triangles' materials have a layer that reflects."""
    return np.asarray(at_materials(scene, _lobe_table(scene), triangle)[9]) > 0


@dataclass(frozen=True)
class Layer:
    """The GGX layer of n groups of k points, and what of it depends on the eye alone.

    Attributes:
        specular0: values by colour, what it reflects at normal incidence.
        specular90: what it reflects at grazing incidence.
        coat: how much of the base it covers.
        alpha2: the square of GGX's alpha.
        nv: (n, k) cosine between normal and eye; below 0 where interpolation turns a normal away.
        front: (n, k) the same where the eye is in front, almost 0 elsewhere.
        root: (n, k) root of `_masking_root` of the eye.
        leaving: (n, k) share of the base's light that the layer lets out to the eye.
    """

    specular0: Colors
    specular90: Values
    coat: Values
    alpha2: Values
    nv: Float32Array
    front: Float32Array
    root: Float32Array
    leaving: Float32Array


def layer_of(surface: Surface, lobes: Lobes, base: Colors) -> Layer | None:
    """The layer of points whose base has a colour; None where all of them are matte."""
    if not np.any(lobes.specular90):
        return None
    # One for all colours where nothing is metal.
    specular0: Colors = (lobes.dielectric,) * len(base)
    if np.any(lobes.metallic):
        specular0 = tuple(lobes.dielectric + lobes.metallic * value for value in base)
    front = np.maximum(surface.facing, _LEAST_COSINE)
    return Layer(
        specular0=specular0,
        specular90=lobes.specular90,
        coat=lobes.coat,
        alpha2=lobes.alpha2,
        nv=surface.facing,
        front=front,
        root=_masking_root(front, lobes.alpha2),
        leaving=_let_through(front, lobes.coat),
    )


def let_in_and_out(layer: Layer, nl: Float32Array, received: Float32Array) -> Float32Array:
    """What the base under a layer gets of `received` light, less what does not come out to the eye."""
    result: Float32Array = layer.leaving * (_let_through(nl, layer.coat) * received)
    return result


def glints(
    layer: Layer,
    nl: Float32Array,
    vl: Float32Array,
    received: Float32Array,
    color: Float32Array,
    out: Float32Array | None = None,
) -> tuple[Float32Array, ...]:
    """Red, green and blue, or grey, (n, k) that a layer reflects.

    The half vector is needed only through its products with the others.

    Args:
        layer: the layer.
        nl: (n, k) or (n, 1) cosine between normal and light, 0 where it is behind.
        vl: (n, k) cosine between eye and light.
        received: (n, k) or (n, 1) share of the light's irradiance.
        color: (3,) the irradiance.
        out: (n, k) memory to work in, `vl` itself where nobody needs it any more.
    """
    a2 = layer.alpha2
    half_angle = np.add(vl, _ONE, out=out)
    np.maximum(half_angle, _LEAST_COSINE, out=half_angle)  # 1 + v·l, which is 2 (v·h)²
    # D: from the cosines as they are: a normal that is bent past the silhouette must not pretend to face
    # the half vector, or light from behind would glint along every outline.
    spread = layer.nv + nl  # twice (n·h)² after the next four lines
    np.maximum(spread, np.float32(0), out=spread)
    spread *= spread
    spread /= half_angle
    np.minimum(spread, np.float32(2), out=spread)
    spread = _scaled(spread, (a2 - _ONE) * _HALF)
    spread += _ONE
    spread *= spread
    # G over 4 (n·l)(n·v), whose numerator and denominator share factors.
    masking = layer.front * _masking_root(nl, a2)
    masking += layer.root * nl
    spread *= masking
    strength = np.divide(received, spread, out=spread)  # but for a factor α²/2π
    # F: once for all colours where these agree.
    rim = _fifth(np.subtract(_ROOT2, np.sqrt(half_angle, out=half_angle), out=half_angle))
    factor = a2 * np.float32(0.5 / math.pi)
    first, colors = layer.specular0[0], len(layer.specular0)
    if color[0] == color[1] == color[2] and all(value is first for value in layer.specular0):
        return (_fresnel(first, layer, rim, factor * color[0], strength, rim),) * colors
    return tuple(_fresnel(layer.specular0[k], layer, rim, factor * color[k], strength) for k in range(colors))


def _fresnel(
    specular0: Values,
    layer: Layer,
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
    root = _scaled(cosine * cosine, _ONE - alpha2)
    root += alpha2
    result: Float32Array = np.sqrt(root, out=root)
    return result


def _let_through(cosine: Float32Array, coat: Values) -> Float32Array:
    """What a layer lets through at an angle: 1 less the rise of its reflection towards the rim."""
    result = _scaled(_fifth(_ONE - cosine), -coat)
    result += _ONE
    return result


def _scaled(values: Float32Array, factor: Values) -> Float32Array:
    """Values times what may vary more than they do; they make way for the result if it has room there."""
    room = isinstance(factor, np.float32) or factor.size == 1 or values.shape == factor.shape
    room = room or (values.shape[1] >= factor.shape[1] and values.shape[0] == factor.shape[0])
    return np.multiply(values, factor, out=values if room else None)


def _fifth(value: Float32Array) -> Float32Array:
    """The fifth power: of 1 − cosine, in Schlick's approximation."""
    result: Float32Array = value * value
    result *= result
    result *= value
    return result
