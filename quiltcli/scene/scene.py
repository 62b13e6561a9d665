"""The scene: every triangle in world space, with what shading needs to know of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from quiltcli.formats.mesh.coverage import NOTHING, Coverage
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, cross, dot, normalized
from quiltcli.scene.lights import Light

if TYPE_CHECKING:
    from quiltcli.scene.environment.sky import Sky
    from quiltcli.scene.materials import Texture
    from quiltcli.scene.textures.pool import Textures


@dataclass(frozen=True)
class Materials:
    """M surface materials, one row each.

    Attributes:
        color: (M, 3) base colour, linear.
        metallic: (M,) 0 to 1.
        roughness: (M,) 0 to 1.
        emission: (M, 3) emitted radiance, linear.
        unlit: (M,) materials that show exactly `color`.
        specular: (M,) 0 to 1, strength of the layer that reflects; metals reflect all the same.
        textures: the pictures that vary each.
        opacity: (M,) alpha, 0 to 1; None where all are 1.
        alpha: (M,) what alpha means, an index into `ALPHAS`; None where all are opaque.
        cutoff: (M,) the least alpha that `mask` shows.
        one_sided: (M,) surfaces seen from their front alone, where jobs ask for that; None for none.
    """

    color: Float32Array
    metallic: Float32Array
    roughness: Float32Array
    emission: Float32Array
    unlit: BoolArray
    specular: Float32Array
    textures: tuple[tuple[Texture, ...], ...] = ()
    opacity: Float32Array | None = None
    alpha: Int32Array | None = None
    cutoff: Float32Array | None = None
    one_sided: BoolArray | None = None


VARY_ALPHA = ("color", "opacity")
"""Roles of textures that bring an alpha."""
ALPHAS = ("opaque", "mask", "blend")
"""What a material's alpha means: nothing; whether a point is there; what share of light it holds up."""


@dataclass(frozen=True, eq=False)
class Scene:
    """T triangles over V vertices, baked to world space; equal only to itself.

    Attributes:
        vertices: (V, 3) world metres.
        triangles: (T, 3) indices into `vertices`.
        normals: (V, 3) unit shading normals.
        colors: (V, 3) linear vertex colours, 1 where there are none.
        flat: (T,) triangles shaded with their own normal.
        object: (T,) 0-based index into `objects`.
        material: (T,) row of `materials`.
        objects: names of the objects.
        materials: the table of materials.
        lights: the lights, in the order in which they are summed.
        background: (3,) linear colour where nothing is hit.
        notices: sentences to tell the user once: what was dropped or assumed.
        uv: (V, 2) texture coordinates, v up, NaN where there are none; None when there are none at all.
        coverage: how the areas of the files' polygons compare with those of their triangles.
        lets_light_by: objects that cast no shadows, indices into `objects`.
        material_names: what materials are called, for mattes.
        material_name: (T,) index into `material_names`; None for the first everywhere.
        corner_motion: (T, 9) float32, how the first corner moves until the next frame, and what to add to
            that for the others; NaN where nobody knows, None where nothing moves or nobody asks.
        opacities: (V,) alpha of vertices, 0 to 1; None where all are 1.
        uv1: (V, 2) those of the second set, likewise.
        turns: (V, 3) how tangents of the files lie to those that are made (`tangents.turns_of`); None for
            alike.
        textures: the pictures that surfaces are covered with; None where there are none, and in a scene that
            was loaded to be looked into, not to be drawn.
        sky: what is seen where nothing is hit instead of `background`; None for that.
    """

    vertices: FloatArray
    triangles: Int32Array
    normals: Float32Array
    colors: Float32Array
    flat: BoolArray
    object: Int32Array
    material: Int32Array
    objects: tuple[str, ...]
    materials: Materials
    lights: tuple[Light, ...]
    background: Float32Array
    notices: tuple[str, ...]
    uv: FloatArray | None = None
    coverage: Coverage = NOTHING
    lets_light_by: tuple[int, ...] = ()
    material_names: tuple[str, ...] = ("",)
    material_name: Int32Array | None = None
    corner_motion: Float32Array | None = None
    opacities: Float32Array | None = None
    uv1: FloatArray | None = None
    textures: Textures | None = None
    sky: Sky | None = None
    turns: Float32Array | None = None

    @cached_property
    def named(self) -> Int32Array:
        """Index (T,) into `material_names`."""
        return np.zeros_like(self.material) if self.material_name is None else self.material_name

    @cached_property
    def soft(self) -> BoolArray | None:
        """Triangles (T,) that light may pass; None where there are none."""
        table = self.materials
        if table.alpha is None or table.opacity is None:
            return None
        varies = np.array([any(one.role in VARY_ALPHA for one in own) for own in table.textures], np.bool_)
        if varies.size != table.alpha.size:
            varies = np.zeros(table.alpha.size, dtype=np.bool_)
        found = (varies | (table.opacity < 1)).take(self.material)
        if self.opacities is not None:
            found |= (self.opacities < 1).take(self.triangles).any(axis=1)
        found &= (table.alpha > 0).take(self.material)
        return found if found.any() else None

    @cached_property
    def invisible(self) -> BoolArray | None:
        """Triangles (T,) whose material holds up no light anywhere; None where there are none."""
        table = self.materials
        if table.alpha is None or table.opacity is None or table.cutoff is None:
            return None
        masked = (table.alpha == ALPHAS.index("mask")) & (table.opacity < table.cutoff)
        nothing = (masked | (table.opacity == 0)) & (table.alpha > 0)
        return nothing.take(self.material) if nothing.any() else None

    @cached_property
    def one_sided(self) -> BoolArray | None:
        """Triangles (T,) whose material is seen from the front alone; None where there are none."""
        table = self.materials.one_sided
        return None if table is None or not table.any() else table.take(self.material)

    @cached_property
    def corner_opacities(self) -> Float32Array | None:
        """The first corner's opacity, and what to add for the others (T, 3); None where all are 1."""
        return None if self.opacities is None else corner_table(self.opacities[:, None], self.triangles)

    @cached_property
    def planes(self) -> FloatArray:
        """Planes (4, T) of the triangles: normal n by the winding, and n·p for the points p of the plane."""
        return planes_of(self.vertices, self.triangles)

    @cached_property
    def facing(self) -> FloatArray:
        """Cones (4, V) of the triangles' normals at every vertex: unit axis, and the sine of the half angle.

        All triangles at a vertex p face away from an eye e where axis·(e − p) ≤ −sine·|e − p|. The sine is
        1 where they face every way.
        """
        normal = normalized(self.planes[:3].T)
        count = len(self.vertices)
        axis = np.zeros((3, count))
        for k in range(3):
            for sums, values in zip(axis, normal.T, strict=True):
                sums += np.bincount(self.triangles[:, k], weights=values, minlength=count)
        axis = normalized(axis.T)
        least = np.ones(count)
        for k in range(3):
            corner = self.triangles[:, k]
            np.minimum.at(least, corner, dot(axis.take(corner, axis=0), normal))
        sine = np.where(least > 0, np.sqrt(np.maximum(1 - least * least, 0)), 1.0)
        return np.concatenate((axis.T, sine[None]))

    @cached_property
    def corner_normals(self) -> Float32Array:
        """What shading needs of a triangle's directions, side by side for one look-up (T, 12).

        The first corner's normal, what to add to it for the second and the third corner, and the
        triangle's own unit normal. Flat triangles have their own normal at all corners.
        """
        return corner_normals_of(self.planes, self.triangles, self.normals, self.flat)

    @cached_property
    def corner_colors(self) -> Float32Array | None:
        """The first corner's colour, and what to add for the others (T, 9); None where all are 1."""
        return None if bool((self.colors == 1).all()) else corner_table(self.colors, self.triangles)

    def knowing(self, **tables: Any) -> Scene:
        """The same scene with some of the tables above, which need not be worked out then."""
        known = replace(self)
        known.__dict__.update(tables)
        return known


def facing_anywhere(count: int) -> FloatArray:
    """`Scene.facing` (4, V) of vertices of whose triangles nothing is known: they may face every way."""
    return np.broadcast_to(np.array([[0.0], [0.0], [0.0], [1.0]]), (4, count))


def planes_of(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """Planes (4, T) of triangles (T, 3): normal n by the winding, and n·p for the points p of the plane."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = cross(b - a, c - a)
    return np.concatenate((normal.T, dot(normal, a)[None]))


def corner_normals_of(
    planes: FloatArray, triangles: Int32Array, normals: Float32Array, flat: BoolArray
) -> Float32Array:
    """`Scene.corner_normals` (T, 12) of triangles (T, 3) in planes (4, T), some of which (T,) are flat."""
    table = np.empty((len(triangles), 12), dtype=np.float32)
    own = normalized(planes[:3].T).astype(np.float32)
    table[:, 0:9] = corner_table(normals, triangles)
    table[:, 9:12] = own
    alone = np.flatnonzero(flat)
    table[alone, 0:3] = own[alone]
    table[alone, 3:9] = 0.0
    return table


def corner_table(values: Float32Array, triangles: Int32Array) -> Float32Array:
    """Values (T, 3·n) of n a vertex at the first corner, and the second's and third's difference from it."""
    first = values[triangles[:, 0]]
    return np.hstack((first, values[triangles[:, 1]] - first, values[triangles[:, 2]] - first))
