"""What workers share of a frame: what is known of its vertices, its pairs, and the scene when it moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.render.shared import SharedArrays
from quiltcli.scene import Materials, Scene
from quiltcli.scene.materials import without_pictures
from quiltcli.scene.scene import corner_normals_of, facing_anywhere, planes_of
from quiltcli.visibility.draw import BlockPairs
from quiltcli.visibility.shares import Seen

ROOM = 8
"""Pairs a triangle there is room for; memory that is not touched costs nothing."""
LEAST_ROOM = 1 << 26
_SEEN = ("vertices", "reach", "core", "block", "cut")
_PAIRS = ("first", "count", "memory")
_TABLES = ("planes", "corner_normals")


@dataclass(frozen=True)
class Arena:
    """Where the arrays of the frame under way lie.

    Attributes:
        seen: what is known of vertices and triangles.
        pairs: block pairs; those of triangle t lie from t·C/T on in the C numbers of their memory.
    """

    seen: Seen
    pairs: BlockPairs

    def frame_pairs(self) -> BlockPairs:
        """The pairs of the frame under way; a record of its own, for it keeps what it has counted."""
        return replace(self.pairs)

    def begin(self, triangle: int) -> int:
        """Where the pairs of a share that begins with this triangle lie."""
        return triangle * (self.pairs.memory.size // max(len(self.seen.cut), 1))


def new_arena(arrays: SharedArrays, scene: Scene, shares: int, blocks: int) -> Arena:
    """Room for frames of a scene whose triangles are binned in so many shares, over so many blocks."""
    vertices, triangles = len(scene.vertices), len(scene.triangles)
    room = max(ROOM * triangles, LEAST_ROOM)
    wanted: dict[str, tuple[tuple[int, ...], Any]] = {
        "seen.vertices": ((vertices, 3), np.float64),
        "seen.reach": ((vertices,), np.float64),
        "seen.core": ((vertices,), np.int32),
        "seen.block": ((vertices,), np.int32),
        "seen.cut": ((triangles,), np.bool_),
        "pairs.first": ((shares, blocks), np.int64),
        "pairs.count": ((shares, blocks), np.int64),
        "pairs.memory": ((room,), np.int32),
    }
    return arena_of({name: arrays.reserve(name, shape, dtype) for name, (shape, dtype) in wanted.items()})


def arena_of(arrays: Mapping[str, NDArray[Any]]) -> Arena:
    """The arena whose arrays these are."""
    return Arena(
        Seen(*(arrays[f"seen.{name}"] for name in _SEEN)),
        BlockPairs(*(arrays[f"pairs.{name}"] for name in _PAIRS)),
    )


def arena_names() -> list[str]:
    """The names under which an arena's arrays are shared."""
    return [f"seen.{name}" for name in _SEEN] + [f"pairs.{name}" for name in _PAIRS]


def share_scene(arrays: SharedArrays, old: Scene, new: Scene) -> tuple[dict[str, Any], list[str]]:
    """Put what is new in a scene where workers see it, with room for the tables they will make of it.

    Returns:
        fields that are no arrays, by name; and the names of the arrays that are shared.
    """
    plain: dict[str, Any] = {}
    shared = []
    for field in fields(Scene):
        value = getattr(new, field.name)
        if value is getattr(old, field.name):
            continue
        if isinstance(value, np.ndarray) and value.ndim:
            arrays.put(f"scene.{field.name}", value)
            shared.append(f"scene.{field.name}")
        elif isinstance(value, Materials):
            plain[field.name] = without_pictures(value)  # these are in the scene's textures by now
        else:
            plain[field.name] = value
    count = len(new.triangles)
    arrays.reserve("table.planes", (4, count), np.float64)
    arrays.reserve("table.corner_normals", (count, 12), np.float32)
    return plain, [*shared, *(f"table.{name}" for name in _TABLES)]


def moved_scene(scene: Scene, plain: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Scene:
    """The scene that `share_scene` has shared, on a worker's side; its tables hold nothing yet."""
    new: dict[str, Any] = {
        name.removeprefix("scene."): array for name, array in arrays.items() if name.startswith("scene.")
    }
    found = replace(scene, **plain, **new)
    tables: dict[str, Any] = {name: arrays[f"table.{name}"] for name in _TABLES}
    tables["facing"] = facing_anywhere(len(found.vertices))
    if found.colors is scene.colors and found.triangles is scene.triangles:
        tables["corner_colors"] = scene.corner_colors
    return found.knowing(**tables)


def fill_tables(scene: Scene, part: slice) -> None:
    """Work out the tables of some triangles of a scene that has moved."""
    triangles = scene.triangles[part]
    scene.planes[:, part] = planes_of(scene.vertices, triangles)
    scene.corner_normals[part] = corner_normals_of(
        scene.planes[:, part], triangles, scene.normals, scene.flat[part]
    )
