"""The scene: every triangle in world space, with what shading needs to know of it."""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array


@dataclass(frozen=True)
class Materials:
    """M surface materials, one row each.

    Attributes:
        color: (M, 3) base colour, linear.
        metallic: (M,) 0 to 1.
        roughness: (M,) 0 to 1.
        emission: (M, 3) emitted radiance, linear.
        unlit: (M,) materials that show exactly `color`.
    """

    color: Float32Array
    metallic: Float32Array
    roughness: Float32Array
    emission: Float32Array
    unlit: BoolArray


@dataclass(frozen=True)
class Lights:
    """The lights of a scene.

    Attributes:
        directional_direction: (D, 3) unit direction in which the light travels.
        directional_color: (D, 3) linear irradiance on a surface that faces the light.
        point_position: (K, 3) world metres.
        point_color: (K, 3) radiant intensity; the light falls with the square of the distance.
        ambient: (3,) linear, from everywhere.
        headlight: whether a light sits at the viewer's eye because the scene has none of its own.
    """

    directional_direction: Float32Array
    directional_color: Float32Array
    point_position: Float32Array
    point_color: Float32Array
    ambient: Float32Array
    headlight: bool


@dataclass(frozen=True)
class Scene:
    """T triangles over V vertices, baked to world space.

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
        lights: the lights.
        background: (3,) linear colour where nothing is hit.
        notices: sentences to tell the user once: what was dropped or assumed.
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
    lights: Lights
    background: Float32Array
    notices: tuple[str, ...]
