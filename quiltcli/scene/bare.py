"""Scenes of bare triangles, or of none."""

from __future__ import annotations

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array
from quiltcli.scene.scene import Materials, Scene


def bare_scene(vertices: FloatArray, triangles: Int32Array) -> Scene:
    """A scene of bare triangles: what they look like is not asked."""
    return Scene(
        vertices=vertices,
        triangles=triangles,
        normals=np.zeros(vertices.shape, dtype=np.float32),
        colors=np.ones(vertices.shape, dtype=np.float32),
        flat=np.ones(len(triangles), dtype=np.bool_),
        object=np.zeros(len(triangles), dtype=np.int32),
        material=np.zeros(len(triangles), dtype=np.int32),
        objects=("display",),
        materials=Materials(
            np.ones((1, 3), np.float32),
            np.zeros(1, np.float32),
            np.ones(1, np.float32),
            np.zeros((1, 3), np.float32),
            np.ones(1, dtype=np.bool_),
            np.ones(1, np.float32),
        ),
        lights=(),
        background=np.zeros(3, dtype=np.float32),
        notices=(),
    )


def empty_scene() -> Scene:
    """A scene without anything."""
    return bare_scene(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
