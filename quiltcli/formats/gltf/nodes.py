"""The nodes of a file: trees without circles, and the placement of every node (glTF 2.0, section 3.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import Nodes
from quiltcli.geometry import FloatArray, IntArray

INSTANCING = "EXT_mesh_gpu_instancing"
_AFFINE = 1e-6
_SHORTEST = 1e-100
_ONE = np.eye(4)[None]


def read_nodes(json: Json) -> Nodes:
    """The nodes of a document, and which of them its scene shows.

    Without scenes all roots are shown; without a word which of several scenes, the first is.

    Raises:
        MeshError: a node has two parents or is its own ancestor, or a number is not what it must be.
    """
    entries = list(json["nodes"].items())
    parent, children = _family(entries)
    levels = _levels(entries, parent, children)
    count = len(entries)
    placed, matrices = _given(entries, "matrix", _matrix)
    matrix = np.tile(np.eye(4), (count, 1, 1))
    matrix[placed] = np.reshape(matrices, (-1, 4, 4))
    has_matrix = np.zeros(count, dtype=np.bool_)
    has_matrix[placed] = True
    return Nodes(
        parent=parent,
        levels=levels,
        translation=_rows(entries, "translation", (0, 0, 0), lambda entry: entry.numbers(3)),
        rotation=_rows(entries, "rotation", (0, 0, 0, 1), _rotation),
        scale=_rows(entries, "scale", (1, 1, 1), lambda entry: entry.numbers(3)),
        matrix=matrix,
        has_matrix=has_matrix,
        drawn=_shown(json, parent, children),
    )


def _given(entries: Sequence[Json], key: str, read: Callable[[Json], Any]) -> tuple[list[int], list[Any]]:
    """Which nodes have a key, and its values."""
    given = [index for index, entry in enumerate(entries) if entry.has(key)]
    return given, [read(entries[index][key]) for index in given]


def _rows(
    entries: Sequence[Json], key: str, default: Sequence[float], read: Callable[[Json], Any]
) -> FloatArray:
    """A key's values (N, width), the default for nodes that have none."""
    given, values = _given(entries, key, read)
    result = np.tile(np.array(default, dtype=np.float64), (len(entries), 1))
    result[given] = np.reshape(values, (-1, len(default)))
    return result


def _family(entries: Sequence[Json]) -> tuple[IntArray, list[list[int]]]:
    """The parent (N,) and the children of every node."""
    parent = np.full(len(entries), -1, dtype=np.int64)
    children: list[list[int]] = []
    for index, entry in enumerate(entries):
        found = (
            [c.index(len(entries), "node") for c in entry["children"].items()]
            if entry.has("children")
            else []
        )
        for place, child in enumerate(found):
            if parent[child] >= 0:
                raise (
                    entry["children"]
                    .at(place)
                    .error(f"node {child} is a child of node {parent[child]} already")
                )
            parent[child] = index
        children.append(found)
    return parent, children


def _levels(
    entries: Sequence[Json], parent: IntArray, children: Sequence[Sequence[int]]
) -> tuple[IntArray, ...]:
    """Nodes by their depth. Each has at most one parent, so what no root leads to goes in a circle."""
    levels: list[IntArray] = []
    level = [int(root) for root in np.flatnonzero(parent < 0)]
    count = 0
    while level:
        levels.append(np.array(level, dtype=np.int64))
        count += len(level)
        level = [child for node in level for child in children[node]]
    if count < len(entries):
        reached = np.zeros(len(entries), dtype=np.bool_)
        if levels:
            reached[np.concatenate(levels)] = True
        lost = entries[int(np.argmin(reached))]
        raise lost["children"].error("the node is its own ancestor, or below one that is")
    return tuple(levels)


def _shown(json: Json, parent: IntArray, children: Sequence[Sequence[int]]) -> IntArray:
    """Nodes of the scene that is shown, each before its children."""
    scenes = json["scenes"]
    if scenes.length():
        chosen = scenes.at(json["scene"].index(scenes.length(), "scene") if json["scene"] else 0)
        roots = [item.index(len(parent), "node") for item in chosen["nodes"].items()]
        for place, root in enumerate(roots):
            if parent[root] >= 0:
                at = chosen["nodes"].at(place)
                raise at.error(f"node {root} is a child of node {parent[root]} (expected a root)")
    else:
        roots = [int(root) for root in np.flatnonzero(parent < 0)]
    found: list[int] = []
    ahead = list(dict.fromkeys(reversed(roots)))
    while ahead:
        node = ahead.pop()
        found.append(node)
        ahead.extend(reversed(children[node]))
    return np.array(found, dtype=np.int64)


def _rotation(entry: Json) -> tuple[float, ...]:
    quaternion = entry.numbers(4)
    # Any length will do, but its square has to be a number.
    if not _SHORTEST < max(map(abs, quaternion)) < 1 / _SHORTEST:
        raise entry.expected("a unit quaternion")
    return quaternion


def _matrix(entry: Json) -> FloatArray:
    """A placement (4, 4); the file gives it column by column."""
    matrix = np.array(entry.numbers(16)).reshape(4, 4).T
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > _AFFINE:
        raise entry.error("is not affine (expected 0, 0, 0, 1 as its last row)")
    matrix[3] = (0, 0, 0, 1)
    return matrix


def placements(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> FloatArray:
    """Affine maps (N, 4, 4) that scale, then rotate by quaternions (x, y, z, w) of any length, then move."""
    x, y, z, w = rotation.T
    length = x * x + y * y + z * z + w * w
    s = 2 / np.where(length > 0, length, 1)
    turn = np.empty((len(rotation), 3, 3))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 0, 2] = (
        1 - s * (y * y + z * z),
        s * (x * y - z * w),
        s * (x * z + y * w),
    )
    turn[:, 1, 0], turn[:, 1, 1], turn[:, 1, 2] = (
        s * (x * y + z * w),
        1 - s * (x * x + z * z),
        s * (y * z - x * w),
    )
    turn[:, 2, 0], turn[:, 2, 1], turn[:, 2, 2] = (
        s * (x * z - y * w),
        s * (y * z + x * w),
        1 - s * (x * x + y * y),
    )
    result = np.zeros((len(rotation), 4, 4))
    result[:, :3, :3] = turn * scale[:, None, :]
    result[:, :3, 3] = translation
    result[:, 3, 3] = 1
    return result


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of affine maps (..., 4, 4), summed in a fixed order, which a matrix product has not."""
    terms = [a[..., :, k, None] * b[..., None, k, :] for k in range(4)]
    result: FloatArray = terms[0] + terms[1] + terms[2] + terms[3]
    return result


def world_placements(nodes: Nodes, local: FloatArray) -> FloatArray:
    """Placements (N, 4, 4) of all nodes in the world from those below their parents."""
    world = local.copy()
    for level in nodes.levels[1:]:
        world[level] = product(world[nodes.parent[level]], local[level])
    return world


def instances(entry: Json, accessors: Accessors) -> FloatArray:
    """Places (I, 4, 4) of a node's mesh in the node's space: one, or those of EXT_mesh_gpu_instancing."""
    extension = entry.extension(INSTANCING)
    if not extension:
        return _ONE
    given = extension["attributes"]
    found = {}
    for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3")):
        if given[name]:
            found[name] = accessors.floats(given[name], kind)
            if not np.isfinite(found[name]).all():
                raise given[name].error("holds numbers that are not finite")
    if not found:
        return _ONE
    count = len(next(iter(found.values())))
    for name, values in found.items():
        if len(values) != count:
            raise given[name].error(f"has {len(values)} elements (expected {count}, as the others have)")
    return placements(
        found.get("TRANSLATION", np.zeros((count, 3))),
        found.get("ROTATION", np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))),
        found.get("SCALE", np.ones((count, 3))),
    )
