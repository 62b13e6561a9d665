"""A disc before a wall and lamps before both, whose shadows one can write down, for tests of light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.scene import Scene
from tests.helpers.ball_setup import stage_of_facets
from tests.helpers.in_memory import display, viewer
from tests.helpers.wall_scene import lights, wall

WALL, DISC = -2.0, -1.2
"""Where on the z axis the wall and the disc are; both face +z."""
CENTRE, RADIUS = np.array([-0.3, 0.1]), 0.25
SIDES = 720


def scene(lamps, **material) -> Scene:
    """A wall of 8 m × 8 m, object 1, and a disc before it, object 2."""
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    rim = CENTRE + RADIUS * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    corners = [(-4, -4, WALL), (4, -4, WALL), (4, 4, WALL), (-4, 4, WALL), (*CENTRE, DISC)]
    vertices = np.array([*corners, *((x, y, DISC) for x, y in rim)])
    fan = [(4, 5 + k, 5 + (k + 1) % SIDES) for k in range(SIDES)]
    triangles = np.array([(0, 1, 2), (0, 2, 3), *fan], np.int32)
    return mesh(vertices, triangles, [0, 0] + [1] * SIDES, lamps, **material)


def mesh(vertices, triangles, objects, lamps, **material) -> Scene:
    """A scene of flat triangles."""
    count = len(triangles)
    return replace(
        wall(lamps, **material),
        vertices=np.asarray(vertices, np.float64),
        triangles=np.asarray(triangles, np.int32),
        normals=np.zeros((len(vertices), 3), np.float32),
        colors=np.ones((len(vertices), 3), np.float32),
        flat=np.ones(count, bool),
        object=np.asarray(objects, np.int32),
        material=np.zeros(count, np.int32),
        objects=tuple(f"object{k}" for k in range(max(objects) + 1)),
    )


def two_panels(density=64.0):
    """Two facets that meet at a right angle along x = 0.2, before the wall."""
    points = [(-1.2, -1, 0.0), (0.2, -1, 0), (0.2, 1, 0), (-1.2, 1, 0), (1.2, -1, 1), (1.2, 1, 1)]
    return display(points, [[0, 1, 2, 3], [1, 4, 5, 2]], density)


def fine_panel(density=500.0):
    """A facet of so fine pixels that light is smooth over microtiles; it sees the shadow of `lamp`."""
    return display(
        [(-0.1, -0.2, 0.0), (0.5, -0.2, 0), (0.5, 0.2, 0), (-0.1, 0.2, 0)], [[0, 1, 2, 3]], density
    )


EYE = np.array([0.1, 0.0, 3.0])


def seen(drawn: Scene, facets=None, eye=EYE, **render):
    """What an eye sees of a scene: values by channel, of pixels that see something; positions are world."""
    stage = stage_of_facets(facets or two_panels(), drawn)
    output = stage.job.output.model_copy(update={"channels": ("rgba", "P", "object", "facet", "diffuse")})
    how = stage.job.render.model_copy(update=render)
    stage = replace(stage, job=stage.job.model_copy(update={"output": output, "render": how}))
    buffers = new_buffers(stage)
    draw_frame(stage, viewer(eye), buffers)
    some = np.flatnonzero(buffers["object"])
    return {name: values[some] for name, values in buffers.items()}


def lamp(place=(-1.2, 0.2, 0.6)):
    """A point light with shadows."""
    return tuple(replace(light, shadows=True) for light in lights(point=[place], power=[(3, 3, 3)]))


def sun(direction=(0.5, -0.1, -1.0)):
    """A sun with shadows; its direction is made unit."""
    way = np.array(direction) / np.linalg.norm(direction)
    return tuple(replace(light, shadows=True) for light in lights([way], [(3, 3, 3)]))
