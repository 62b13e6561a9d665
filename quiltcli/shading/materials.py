"""Materials at visible points: the parameters of a surface, by name.

A material is a row of the scene's table. What varies over its triangles multiplies it point by point: the
colours of vertices and textures of the base colour (`tint`), textures of emission and occlusion, and those
of roughness and metal, in `Parameters` at points from which `brdf.lobes_of` makes all that light needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, Int32Array
from quiltcli.scene import Materials, Scene
from quiltcli.shading.textures.lookup import ALPHA, COLOR, texels_at, value_at
from quiltcli.visibility.resolve.hits import Points, Wanted

_ONE = np.float32(1)
Values: TypeAlias = "Float32Array | np.float32"
"""A number where all points agree, (n, 1) one a group, or (n, k)."""
Colors: TypeAlias = tuple[Values, ...]
"""Red, green and blue; or one for all three where all is grey."""


@dataclass(frozen=True)
class Parameters:
    """What a material says, by name; each a row a material (M,), or at points.

    Attributes:
        color: base colour, what of diffuse light a surface returns.
        emission: radiance that it gives by itself.
        metallic: 0 to 1.
        roughness: 0 to 1.
        specular: 0 to 1, strength of the layer that reflects; metals reflect all the same.
        lit: 1 where light matters, 0 where the surface shows exactly `color`.
    """

    color: Colors
    emission: Colors
    metallic: Float32Array
    roughness: Float32Array
    specular: Float32Array
    lit: Float32Array


def parameters_of(materials: Materials) -> Parameters:
    """The parameters of all materials (M,)."""
    return Parameters(
        color=tuple(materials.color.T),
        emission=tuple(materials.emission.T),
        metallic=materials.metallic,
        roughness=materials.roughness,
        specular=materials.specular,
        lit=(~materials.unlit).astype(np.float32),
    )


def tint_at(scene: Scene, seen: Points) -> Colors | None:
    """What multiplies the materials' colours at points, by colour (n, k); None where nothing does."""
    texels = texels_at(scene, seen, "color", COLOR)
    if scene.corner_colors is None:
        return None if texels is None else tuple(texels)
    own = between_corners(scene.corner_colors, seen)
    return tuple(own if texels is None else own * texels)


def albedo_at(scene: Scene, seen: Points) -> Colors:
    """The base colour of points."""
    color = at_materials(scene, scene.materials.color, seen.triangle)
    tint = tint_at(scene, seen)
    return color if tint is None else tuple(c * t for c, t in zip(color, tint, strict=True))


def albedo_wants(scene: Scene) -> Wanted:
    """What `albedo_at` asks of hits."""
    wanted = Wanted.NOTHING if scene.corner_colors is None else Wanted.WEIGHTS
    return wanted if scene.textures is None else wanted | Wanted.EDGES


def alpha_at(scene: Scene, seen: Points) -> Values:
    """Alpha of textures at points, straight as files have it; 1 where there is none."""
    texels, own = texels_at(scene, seen, "color", ALPHA), value_at(scene, seen, "opacity")
    alpha: Values = np.float32(1) if texels is None else texels[0]
    return alpha if own is None else alpha * own


def emission_at(scene: Scene, seen: Points) -> Colors:
    """Light that points give by themselves; the colour of those whose material is unlit."""
    table = np.where(scene.materials.unlit[:, None], scene.materials.color, scene.materials.emission)
    emission = at_materials(scene, table, seen.triangle)
    return varied_emission(scene, seen, emission, tint_at(scene, seen))


def varied_emission(scene: Scene, seen: Points, emission: Colors, tint: Colors | None) -> Colors:
    """The materials' emission times what varies it at points: its textures, or `tint` where it is unlit."""
    texels = texels_at(scene, seen, "emission", COLOR)
    if texels is not None:
        emission = tuple(e * t for e, t in zip(emission, texels, strict=True))
    if tint is None or not scene.materials.unlit.any():
        return emission
    lit = lit_at(scene, seen)
    return tuple(e * np.where(lit > 0, _ONE, t) for e, t in zip(emission, tint, strict=True))


def occlusion_at(scene: Scene, seen: Points) -> Float32Array | None:
    """How much of the light from everywhere arrives at points (n, k), by textures; None where all does."""
    value = value_at(scene, seen, "occlusion")
    if value is None:
        return None
    assert scene.textures is not None
    assert seen.edges is not None
    strength = scene.textures.slots["occlusion"].strength.take(scene.material.take(seen.edges.triangle))
    return np.asarray(_ONE + seen.edges.each(strength) * (value - _ONE))


def varied_parameters(scene: Scene, seen: Points) -> Parameters | None:
    """The parameters of points, but for what tints them, where textures vary metal or roughness."""
    metallic, roughness = value_at(scene, seen, "metallic"), value_at(scene, seen, "roughness")
    if metallic is None and roughness is None:
        return None
    table = columns(_parameter_table(scene), scene.material.take(seen.triangle))
    own_metallic, own_roughness, specular, lit = table[6:]
    return Parameters(
        color=tuple(table[0:3]),
        emission=tuple(table[3:6]),
        metallic=own_metallic if metallic is None else own_metallic * metallic,
        roughness=own_roughness if roughness is None else own_roughness * roughness,
        specular=specular,
        lit=lit,
    )


@lru_cache(maxsize=1)
def _parameter_table(scene: Scene) -> Float32Array:
    """The parameters of the scene's materials side by side (M, 10)."""
    own = parameters_of(scene.materials)
    return np.stack(
        (*own.color, *own.emission, own.metallic, own.roughness, own.specular, own.lit), axis=1
    ).astype(np.float32)


def lit_at(scene: Scene, seen: Points) -> Values:
    """1 at points where light matters, 0 at those of unlit materials."""
    lit = (~scene.materials.unlit).astype(np.float32)
    return at_materials(scene, lit[:, None], seen.triangle)[0]


def between_corners(table: Float32Array, seen: Points) -> Float32Array:
    """Values (3, n, k) between the corners of triangles, by a table (T, 9) such as `Scene.corner_colors`."""
    assert seen.weights is not None
    rows = columns(table, seen.triangle)
    value: Float32Array = rows[3:6] * seen.weights[0]
    value += rows[0:3]
    value += rows[6:9] * seen.weights[1]
    return value


def at_materials(scene: Scene, table: NDArray[np.float32], triangle: Int32Array) -> tuple[Values, ...]:
    """The columns of a table (M, c) of the materials at triangles of any shape; numbers where one has all."""
    if len(table) == 1:
        return tuple(table[0])
    material = scene.material.take(triangle)
    first = material.flat[0]
    if bool((material == first).all()):
        return tuple(table[first])
    return tuple(columns(table, material))


def columns(table: Float32Array, rows: Int32Array) -> Float32Array:
    """The table's columns (columns, …) at some of its rows (…)."""
    return np.ascontiguousarray(table.take(rows.ravel(), axis=0).T).reshape(-1, *rows.shape)
