"""Materials at visible points: the parameters of a surface, by name.

A material is a row of the scene's table. What varies over its triangles multiplies it point by point:
today the colours of vertices do (`tint`). An image that is looked up would be another factor of what it
is of: of `color` in `tint`, of roughness or metallic in `Parameters` at points, from which
`brdf.lobes_of` makes all that light needs, whatever their shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, Int32Array
from quiltcli.scene import Materials, Scene
from quiltcli.visibility.resolve.hits import Points, Wanted

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
    return None if scene.corner_colors is None else tuple(between_corners(scene.corner_colors, seen))


def albedo_at(scene: Scene, seen: Points) -> Colors:
    """The base colour of points."""
    color = at_materials(scene, scene.materials.color, seen.triangle)
    tint = tint_at(scene, seen)
    return color if tint is None else tuple(c * t for c, t in zip(color, tint, strict=True))


def albedo_wants(scene: Scene) -> Wanted:
    """What `albedo_at` asks of hits."""
    return Wanted.NOTHING if scene.corner_colors is None else Wanted.WEIGHTS


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
