"""A ball before any display, as a stage made in memory, for tests of whole frames."""

from __future__ import annotations

import numpy as np

from quiltcli.display import Facets
from quiltcli.job import JobFile
from quiltcli.layout import Layout, align
from quiltcli.render.setup import Stage, stage_of
from quiltcli.scene import Light, Scene
from tests.helpers.in_memory import icosphere
from tests.helpers.packed_layouts import pack
from tests.helpers.wall_scene import lights, wall


def ball_scene(
    splits: int, radius: float = 0.8, lamps: tuple[Light, ...] | None = None, background=(0, 0, 0)
) -> Scene:
    """A smooth ball of 20·4ˢ triangles about the origin, by default in even light."""
    vertices, triangles = icosphere(splits)
    plain = wall(lamps or lights(ambient=(1, 1, 1)))
    count = len(triangles)
    return Scene(
        vertices=vertices * radius,
        triangles=triangles,
        normals=vertices.astype(np.float32),
        colors=np.ones(vertices.shape, np.float32),
        flat=np.zeros(count, bool),
        object=np.zeros(count, np.int32),
        material=np.zeros(count, np.int32),
        objects=("ball",),
        materials=plain.materials,
        lights=plain.lights,
        background=np.float32(background),
        notices=(),
    )


def stage_of_facets(facets: Facets, scene: Scene, bleed: int = 0) -> Stage:
    """The stage of a scene and a display in rows."""
    return stage_of_layout(facets, align(pack(facets, "rows"), facets), scene, bleed)


def stage_of_layout(facets: Facets, layout: Layout, scene: Scene, bleed: int = 0) -> Stage:
    """The stage of a scene, a display and its layout."""
    path = {"keyframes": [{"frame": 1, "position": [0, 0, 2], "look_at": [0, 0, 0]}]}
    spec = {
        "display": "d.yaml",
        "scene": "s.obj",
        "frames": "1",
        "viewer": {"near": 0.1, "far": 9, "path": path},
    }
    return stage_of(JobFile.model_validate(spec), facets, layout, scene, bleed)
