"""The scenes that are measured, from 1 700 triangles that fill the display to 871 000 of two pixels."""

from __future__ import annotations

import gzip
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from quiltcli.geometry import FloatArray, Int32Array, cross, normalized
from quiltcli.scene import Materials, Scene
from quiltcli.scene.lights import ambient, directional
from tests.helpers.in_memory import icosphere

DATA = "QUILT_BENCH_DATA"
"""Environment variable: the folder of the Stanford dragon at its four resolutions."""

_DRAGONS = ("dragon_vrip_res4", "dragon_vrip_res3", "dragon_vrip_res2", "dragon_vrip")
_BOX = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@dataclass(frozen=True)
class Mesh:
    """Vertices (V, 3) metres, triangles (T, 3), and what to call it."""

    name: str
    vertices: FloatArray
    triangles: Int32Array


@lru_cache(maxsize=4)
def detailed(level: int) -> Mesh:
    """Much detail in a body 1.6 wide: the dragon at level 0 to 3, else a rough ball of as many triangles."""
    vertices, triangles = _dragon(level) or _rough_ball(4 + level)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    vertices = (vertices - (low + high) / 2) * (1.6 / (high - low).max())
    return Mesh("dragon" if has_dragon() else "rough ball", vertices, triangles)


def has_dragon() -> bool:
    """Whether the folder named by `DATA` has the dragon."""
    return _file(_DRAGONS[-1]) is not None


def _file(stem: str) -> Path | None:
    folder = os.environ.get(DATA)
    files = [Path(folder) / f"{stem}.ply{end}" for end in ("", ".gz")] if folder else []
    return next((path for path in files if path.exists()), None)


def _dragon(level: int) -> tuple[FloatArray, Int32Array] | None:
    path = _file(_DRAGONS[level])
    if path is None:
        return None
    import trimesh

    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
        mesh = trimesh.load(file, file_type="ply", process=False)
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32)


def _rough_ball(splits: int) -> tuple[FloatArray, Int32Array]:
    """An icosphere with bumps of several sizes, so that neither side of it is smooth or convex."""
    vertices, triangles = icosphere(min(splits, 7))
    bumps = np.random.default_rng(5).normal(size=(24, 3))
    height = sum(np.sin(vertices @ bump * (4 + k)) / (k + 6) for k, bump in enumerate(bumps))
    return vertices * (1 + 0.15 * height)[:, None], triangles


def room(boxes: int = 110) -> Mesh:
    """Two walls and a floor that fill every facet, with boxes before them: large triangles, deep piles."""
    rng = np.random.default_rng(1)
    furniture = [_box(rng.uniform(0.1, 1, 3), rng.uniform(-3, 2, 3)) for _ in range(boxes)]
    return _joined("room", [*_walls(), *furniture])


def mixed() -> Mesh:
    """The room with fewer boxes and the detailed body in it."""
    furnished, body = room(60), detailed(3)
    return _joined("mixed", [(furnished.vertices, furnished.triangles), (body.vertices, body.triangles)])


def spheres(count: int = 60) -> Mesh:
    """The walls with balls of 1 280 triangles before them: triangles of 10 to 60 pixels."""
    rng = np.random.default_rng(2)
    vertices, triangles = icosphere(3)
    balls = [(vertices * rng.uniform(0.1, 0.5) + rng.uniform(-2, 1, 3), triangles) for _ in range(count)]
    return _joined("spheres", [*_walls(), *balls])


def _walls() -> list[tuple[FloatArray, Int32Array]]:
    floor = _box(np.array([8, 0.01, 8]), np.array([0, -2.5, 0]))
    return [
        floor,
        _box(np.array([8, 5, 0.01]), np.array([0, 0, -4])),
        _box(np.array([0.01, 5, 8]), np.array([-4, 0, 0])),
    ]


def _box(size: FloatArray, middle: FloatArray) -> tuple[FloatArray, Int32Array]:
    """A box of twelve triangles wound outward; every side has corners, and so normals, of its own."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = np.arange(0, 24, 4)[:, None]
    triangles = np.stack((sides + (0, 1, 2), sides + (0, 2, 3)), axis=1).reshape(-1, 3)
    return corners[np.ravel(_BOX)] * size + middle, triangles.astype(np.int32)


def _joined(name: str, parts: Sequence[tuple[FloatArray, Int32Array]]) -> Mesh:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    triangles = [t + at for (_, t), at in zip(parts, first[:-1], strict=True)]
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return Mesh(name, vertices, np.concatenate(triangles).astype(np.int32))


def scene_of(mesh: Mesh) -> Scene:
    """The mesh in one material under one sun and some light from everywhere."""
    corners = mesh.vertices[mesh.triangles]
    face = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(mesh.vertices)
    for axis in range(3):
        for k in range(3):
            at = mesh.triangles[:, k]
            normals[:, axis] += np.bincount(at, face[:, axis], minlength=len(normals))
    normals[~normals.any(axis=1)] = (0, 0, 1)
    count = len(mesh.triangles)
    return Scene(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        normals=normalized(normals).astype(np.float32),
        colors=np.ones(normals.shape, np.float32),
        flat=np.zeros(count, np.bool_),
        object=np.zeros(count, np.int32),
        material=np.zeros(count, np.int32),
        objects=(mesh.name,),
        materials=_clay(),
        lights=(ambient((0.1, 0.1, 0.1)), directional((-1.0, -2.0, -1.5), (3, 3, 3))),
        background=np.zeros(3, np.float32),
        notices=(),
    )


def _clay() -> Materials:
    """One dull material."""
    color = np.array([[0.8, 0.5, 0.3]], np.float32)
    rough = np.array([0.5], np.float32)
    return Materials(color, rough * 0, rough, color * 0, np.zeros(1, np.bool_), np.ones(1, np.float32))
