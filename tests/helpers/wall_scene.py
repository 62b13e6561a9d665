"""A scene of one wall, and points on it, for tests of shading and channels."""

from __future__ import annotations

import numpy as np

from quiltcli.scene import Materials, Scene
from quiltcli.scene.lights import HEADLIGHT, Ambient, Directional, Headlight, Point
from quiltcli.visibility.resolve.hits import point_hits

EYE = np.array([0.0, 0.0, 2.0])


def lights(sun=(), color=(), point=(), power=(), ambient=(0, 0, 0), headlight=False):
    """Lights as a scene holds them; a sun's direction is taken as it is."""
    around = [Ambient(np.float32(ambient))] if np.any(ambient) else []
    suns = [Directional(np.float32(c), np.float32(d)) for d, c in zip(sun, color, strict=True)]
    lamps = [Point(np.float32(c), np.float32(p)) for p, c in zip(point, power, strict=True)]
    return (*around, *suns, *lamps, *([Headlight(np.full(3, HEADLIGHT, np.float32))] if headlight else []))


def materials(color=(1, 1, 1), metallic=0.0, roughness=0.5, emission=(0, 0, 0), unlit=False, specular=1.0):
    return Materials(
        np.array([color], np.float32),
        np.array([metallic], np.float32),
        np.array([roughness], np.float32),
        np.array([emission], np.float32),
        np.array([unlit]),
        np.array([specular], np.float32),
    )


def wall(lamps, **material):
    """One triangle in the plane z = 0 that faces +z."""
    return Scene(
        vertices=np.array([[-1.0, -1, 0], [1, -1, 0], [-1, 1, 0]]),
        triangles=np.array([[0, 1, 2]], np.int32),
        normals=np.tile(np.float32([0, 0, 1]), (3, 1)),
        colors=np.ones((3, 3), np.float32),
        flat=np.zeros(1, bool),
        object=np.zeros(1, np.int32),
        material=np.zeros(1, np.int32),
        objects=("wall",),
        materials=materials(**material),
        lights=lamps,
        background=np.zeros(3, np.float32),
        notices=(),
    )


def hits(position, b=0.25, c=0.5, triangle=None, scene=None):
    """Points on a scene's triangles, or on those of a wall."""
    position = np.array(position, np.float64).reshape(3, -1)
    count = position.shape[1]
    return point_hits(
        first=np.arange(count),
        facet=np.zeros(count, np.int32),
        triangle=np.zeros(count, np.int32) if triangle is None else np.array(triangle, np.int32),
        position=position,
        weights=np.stack((np.broadcast_to(b, count), np.broadcast_to(c, count))),
        depth=-position[2],
        normals=(scene or wall(lights())).corner_normals,
        inside=count,
    )


def on(scene, seen):
    """The same points with the normals of another scene."""
    weights = seen.weights.astype(np.float64)[:, :, 0]
    return hits(seen.position, *weights, triangle=seen.triangle, scene=scene)


STRAIGHT = hits([[0.0], [0.0], [-2.0]])
