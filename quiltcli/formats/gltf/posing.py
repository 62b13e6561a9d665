"""Shapes in their places: nodes, morph targets and skins at rest or at a time of the animations.

The order of vertices and triangles is the same at every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quiltcli.formats.gltf.animation import clip_time, value_at
from quiltcli.formats.gltf.model import Clip, Gltf, Primitive, Shape
from quiltcli.formats.gltf.nodes import placements, product, world_placements
from quiltcli.geometry import BoolArray, FloatArray, IntArray, applied, cofactors


@dataclass(frozen=True, eq=False)
class Pose:
    """Where everything is.

    Attributes:
        world: (N, 4, 4) placements of the nodes.
        weights: of the morph targets, by node, where an animation says.
    """

    world: FloatArray
    weights: dict[int, FloatArray]


@dataclass(frozen=True, eq=False)
class Piece:
    """One primitive in all its places.

    Attributes:
        primitive: the primitive.
        shapes: the nodes that show it, in their order.
    """

    primitive: Primitive
    shapes: tuple[Shape, ...]

    @property
    def copies(self) -> int:
        """How often it is there."""
        return sum(len(shape.instances) for shape in self.shapes)

    def places(self, pose: Pose) -> FloatArray:
        """Placements (copies, 4, 4) of the copies in a pose."""
        return np.concatenate([product(pose.world[s.node][None], s.instances) for s in self.shapes])


@dataclass(frozen=True, eq=False)
class Placed:
    """A piece in a pose: C copies of V vertices each.

    Attributes:
        vertices: (C·V, 3) world metres.
        normals: (C·V, 3) not of unit length, or None where the file gives none.
        mirrored: (C,) copies whose place turns them inside out.
    """

    vertices: FloatArray
    normals: FloatArray | None
    mirrored: BoolArray


def pieces(gltf: Gltf) -> tuple[Piece, ...]:
    """Every primitive that is shown, in the order of meshes and primitives in the file."""
    by_mesh: dict[int, list[Shape]] = {}
    for shape in gltf.shapes:
        by_mesh.setdefault(shape.mesh, []).append(shape)
    return tuple(
        Piece(primitive, tuple(by_mesh[mesh])) for mesh in sorted(by_mesh) for primitive in gltf.meshes[mesh]
    )


def rest_pose(gltf: Gltf) -> Pose:
    """Where everything is while nothing is animated."""
    return Pose(world_placements(gltf.nodes, _local(gltf)), {})


def pose_at(gltf: Gltf, clips: Sequence[Clip], seconds: float, after: str = "hold") -> Pose:
    """Where everything is at a time; of two clips that move the same thing the first counts."""
    local = _local(gltf)
    nodes = gltf.nodes
    trs = {name: getattr(nodes, name).copy() for name in ("translation", "rotation", "scale")}
    weights: dict[int, FloatArray] = {}
    moved: set[tuple[int, str]] = set()
    for clip in clips:
        time = clip_time(seconds, clip.end, after)
        for channel in clip.channels:
            if (channel.node, channel.target) in moved:
                continue
            moved.add((channel.node, channel.target))
            if channel.target == "weights":
                weights[channel.node] = value_at(channel, time)
            else:
                trs[channel.target][channel.node] = value_at(channel, time)
    changed = np.array(sorted({node for node, target in moved if target != "weights"}), dtype=np.int64)
    local[changed] = placements(*(trs[name][changed] for name in ("translation", "rotation", "scale")))
    return Pose(world_placements(nodes, local), weights)


def contested(clips: Sequence[Clip]) -> int:
    """Number of channels that lose to another clip's, which moves the same thing."""
    targets = [(channel.node, channel.target) for clip in clips for channel in clip.channels]
    return len(targets) - len(set(targets))


def _local(gltf: Gltf) -> FloatArray:
    nodes = gltf.nodes
    local = placements(nodes.translation, nodes.rotation, nodes.scale)
    local[nodes.has_matrix] = nodes.matrix[nodes.has_matrix]
    return local


def placed(gltf: Gltf, piece: Piece, pose: Pose) -> Placed:
    """All copies of a piece in a pose."""
    primitive = piece.primitive
    if not len(primitive.moved) and all(shape.skin < 0 for shape in piece.shapes):
        return carried(primitive.positions, primitive.normals, piece.places(pose))
    parts = [_one(gltf, primitive, shape, pose) for shape in piece.shapes]
    normals = [part.normals for part in parts if part.normals is not None]
    return Placed(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate(normals) if normals else None,
        np.concatenate([part.mirrored for part in parts]),
    )


def _one(gltf: Gltf, primitive: Primitive, shape: Shape, pose: Pose) -> Placed:
    """The copies of one node: morphed, then skinned or put where the node is."""
    positions, normals = primitive.positions, primitive.normals
    weights = pose.weights.get(shape.node, shape.weights)
    for weight, moved, turned in zip(weights, primitive.moved, primitive.turned, strict=False):
        if weight:
            positions = positions + weight * moved
            normals = None if normals is None else normals + weight * turned
    if shape.skin < 0 or primitive.joints is None or primitive.weights is None:
        return carried(positions, normals, product(pose.world[shape.node][None], shape.instances))
    skin = gltf.skins[shape.skin]
    joints = product(pose.world[skin.joints], skin.inverse_bind)
    # A skinned mesh is where its joints are; its own node's place is of no account.
    blend = np.zeros((len(positions), 3, 4))
    for joint, weight in zip(primitive.joints.T, primitive.weights.T, strict=True):
        blend += weight[:, None, None] * joints[joint, :3]
    vertices = applied(blend[..., :3], positions) + blend[..., 3]
    turned, det = cofactors(blend[..., :3])
    if normals is not None:
        normals = applied(turned, normals) * np.sign(det)[:, None]
    inside_out = np.array([np.count_nonzero(det < 0) * 2 > len(det)])
    copies = len(shape.instances)
    return Placed(
        np.tile(vertices, (copies, 1)),
        None if normals is None else np.tile(normals, (copies, 1)),
        np.repeat(inside_out, copies),
    )


def carried(positions: FloatArray, normals: FloatArray | None, places: FloatArray) -> Placed:
    """Copies of vertices at places (C, 4, 4)."""
    rows = places[:, None, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = applied(rows, positions[None]) + places[:, None, :3, 3]
        turned, det = cofactors(places[:, :3, :3])
        if normals is not None:
            # Normals go by the inverse transpose, which a flat placement does not have.
            inverse = np.where(det == 0, 0.0, 1 / np.where(det == 0, 1, det))[:, None, None]
            normals = applied((turned * inverse)[:, None], normals[None]).reshape(-1, 3)
    return Placed(vertices.reshape(-1, 3), normals, det < 0)


def placed_triangles(piece: Piece, mirrored: BoolArray) -> IntArray:
    """Triangles (C·T, 3) of all copies; mirrored ones are wound the other way, so that out stays out."""
    return copied_triangles(piece.primitive.triangles, len(piece.primitive.positions), mirrored)


def copied_triangles(triangles: IntArray, count: int, mirrored: BoolArray) -> IntArray:
    """Triangles (C·T, 3) of copies of (T, 3) over `count` vertices each, mirrored ones (C,) turned over."""
    copies = np.tile(triangles, (len(mirrored), 1, 1))
    copies[mirrored] = copies[mirrored][..., ::-1]
    base = count * np.arange(len(mirrored))
    result: IntArray = (copies + base[:, None, None]).reshape(-1, 3)
    return result
