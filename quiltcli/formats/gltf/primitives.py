"""The primitives of meshes: attributes and triangles (glTF 2.0, section 3.7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from quiltcli.formats.gltf.accessors import Accessors, as_floats
from quiltcli.formats.gltf.compression import DRACO, Unpacked, can_read_draco, draco_primitive
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import Primitive
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray

TRIANGLES, STRIP, FAN = 4, 5, 6
MOST_JOINT_SETS = 8
ArrayT = TypeVar("ArrayT", FloatArray, IntArray)
_LARGEST = 1e300


def mode_of(primitive: Json) -> int:
    """What a primitive's vertices are joined to: points, lines or triangles."""
    return primitive["mode"].whole(TRIANGLES, high=6)


def triangle_count(primitive: Json, accessors: Accessors) -> int:
    """Number of triangles a primitive says to have, without reading any."""
    mode = mode_of(primitive)
    if mode < TRIANGLES:
        return 0
    source = primitive["indices"] if primitive["indices"] else primitive["attributes"]["POSITION"]
    corners = accessors.count(source) if source else 0
    return corners // 3 if mode == TRIANGLES else max(corners - 2, 0)


@dataclass(eq=False)
class _Attributes:
    """The attributes of one primitive, unpacked where Draco has packed them."""

    primitive: Json
    accessors: Accessors
    unpacked: Unpacked | None
    count: int = 0

    def floats(self, name: str, *kinds: str) -> FloatArray | None:
        """Values (V, components) of an attribute, None where there is none."""
        entry = self.primitive["attributes"][name]
        if not entry:
            return None
        if self.unpacked is not None and name in self.unpacked.attributes:
            values = as_floats(
                self.unpacked.attributes[name],
                normalized=self.accessors.entry(entry)["normalized"].flag(),
            )
        else:
            values = self.accessors.floats(entry, *kinds)
        return self._counted(entry, values)

    def whole(self, name: str, *kinds: str) -> IntArray | None:
        """As `floats`, for indices."""
        entry = self.primitive["attributes"][name]
        if not entry:
            return None
        if self.unpacked is not None and name in self.unpacked.attributes:
            return self._counted(entry, self.unpacked.attributes[name].astype(np.int64))
        return self._counted(entry, self.accessors.whole(entry, *kinds))

    def _counted(self, entry: Json, values: ArrayT) -> ArrayT:
        self.count = self.count or len(values)
        if len(values) != self.count:
            raise entry.error(f"has {len(values):,} elements for {self.count:,} vertices")
        return values


def read_primitive(primitive: Json, accessors: Accessors, materials: int) -> Primitive:
    """A primitive of triangles, with what its vertices carry.

    Raises:
        MeshError: an accessor is broken, an index names a vertex that is not there, or a triangle's
            vertex is not finite.
    """
    unpacked = _unpacked(primitive, accessors)
    get = _Attributes(primitive, accessors, unpacked)
    positions = get.floats("POSITION", "VEC3")
    if positions is None:
        raise primitive["attributes"]["POSITION"].expected("the positions of vertices")
    triangles = _triangles(primitive, accessors, unpacked, len(positions))
    _check_finite(primitive, positions, triangles)
    joints, weights = _influences(get)
    moved, turned = _targets(primitive, accessors, get.count)
    return Primitive(
        positions=positions,
        triangles=triangles,
        normals=get.floats("NORMAL", "VEC3"),
        tangents=get.floats("TANGENT", "VEC4"),
        uv=(_finite(get.floats("TEXCOORD_0", "VEC2")), _finite(get.floats("TEXCOORD_1", "VEC2"))),
        colors=_colors(get.floats("COLOR_0", "VEC3", "VEC4")),
        joints=joints,
        weights=weights,
        moved=moved,
        turned=turned,
        material=primitive["material"].index(materials, "material") if primitive["material"] else -1,
        path=primitive.path,
    )


def _unpacked(primitive: Json, accessors: Accessors) -> Unpacked | None:
    """What Draco has packed; None without Draco, or where a plain copy stands beside and the extra lacks."""
    packed = primitive.extension(DRACO)
    position = primitive["attributes"]["POSITION"]
    if not packed or (not can_read_draco() and position and accessors.entry(position)["bufferView"]):
        return None
    return draco_primitive(primitive, accessors.view(packed["bufferView"]))


def _triangles(primitive: Json, accessors: Accessors, unpacked: Unpacked | None, count: int) -> IntArray:
    """Triangles (T, 3) of a list, a strip or a fan; corners too few for a triangle make none."""
    if unpacked is not None:
        corners, mode = unpacked.triangles.ravel(), TRIANGLES
    elif primitive["indices"]:
        corners, mode = accessors.whole(primitive["indices"], "SCALAR")[:, 0], mode_of(primitive)
    else:
        corners, mode = np.arange(count), mode_of(primitive)
    if corners.size and corners.max() >= count:
        raise primitive["indices"].error(
            f"names vertex {corners.max()} of {count} (expected 0 to {count - 1})"
        )
    if mode == TRIANGLES:
        return corners[: corners.size // 3 * 3].reshape(-1, 3)
    if corners.size < 3:
        return np.empty((0, 3), dtype=np.int64)
    if mode == FAN:
        first = np.broadcast_to(corners[0], corners.size - 2)
        return np.stack((corners[1:-1], corners[2:], first), axis=1)
    # Every second triangle of a strip is turned over, so that all are wound the same way.
    odd = np.arange(corners.size - 2) % 2
    at = np.arange(corners.size - 2)
    return np.stack((corners[at], corners[at + 1 + odd], corners[at + 2 - odd]), axis=1)


def _check_finite(primitive: Json, positions: FloatArray, triangles: IntArray) -> None:
    """Positions of vertices that triangles use must be numbers; those of others matter to nobody."""
    bad: BoolArray = np.asarray(~(np.abs(positions) < _LARGEST).all(axis=1))
    if not bad.any():
        return
    used = triangles[bad[triangles]]
    if used.size:
        found = ", ".join(f"{value:g}" for value in positions[used[0]])
        raise primitive["attributes"]["POSITION"].error(
            f"vertex {used[0]} is ({found}) (expected finite numbers)"
        )
    positions[bad] = 0.0


def _finite(values: FloatArray | None) -> FloatArray | None:
    """Texture coordinates, 0 for those that are nowhere."""
    return None if values is None else np.where(np.abs(values) < _LARGEST, values, 0.0)


def _colors(values: FloatArray | None) -> Float32Array | None:
    """Colours (V, 4), alpha 1 where there is none."""
    if values is None:
        return None
    result = np.ones((len(values), 4), dtype=np.float32)
    result[:, : values.shape[1]] = np.nan_to_num(np.clip(values, 0, None), nan=0.0, posinf=1.0)
    return result


def _influences(get: _Attributes) -> tuple[IntArray | None, FloatArray | None]:
    """Joints and weights (V, K) of all sets; rows of weights are made to sum to 1."""
    joints, weights = [], []
    for number in range(MOST_JOINT_SETS):
        rows = get.whole(f"JOINTS_{number}", "VEC4")
        share = get.floats(f"WEIGHTS_{number}", "VEC4")
        if rows is None or share is None:
            break
        joints.append(rows)
        weights.append(share)
    if not joints:
        return None, None
    rows, share = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    if not (np.isfinite(share).all() and (share >= 0).all()):
        raise get.primitive["attributes"]["WEIGHTS_0"].error("holds weights below 0 or not finite")
    total = share.sum(axis=1, keepdims=True)
    share = np.divide(share, total, out=np.zeros_like(share), where=total > 0)
    # A vertex without any weight moves with its first joint.
    share[total[:, 0] == 0, 0] = 1.0
    return rows, share


def _targets(primitive: Json, accessors: Accessors, count: int) -> tuple[FloatArray, FloatArray]:
    """What the morph targets (M, V, 3) add to positions and normals."""
    moved: list[FloatArray] = []
    turned: list[FloatArray] = []
    for target in primitive["targets"].items():
        for name, found in (("POSITION", moved), ("NORMAL", turned)):
            entry = target[name]
            values = accessors.floats(entry, "VEC3") if entry else np.zeros((count, 3))
            if len(values) != count:
                raise entry.error(f"has {len(values):,} elements for {count:,} vertices")
            if not np.isfinite(values).all():
                raise entry.error("holds numbers that are not finite")
            found.append(values)
    empty = np.empty((0, count, 3))
    return (np.stack(moved), np.stack(turned)) if moved else (empty, empty)
