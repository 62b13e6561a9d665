"""Cameras and other nodes of glTF files, with the animation of all that is above them.

A curve that is straight between its keys is known by these alone. Any other (steps, splines, and nodes
whose parents turn) is sampled so often that straight lines between the samples are its own.
"""

from __future__ import annotations

import numpy as np

from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.animation import read_clips, value_at
from quiltcli.formats.gltf.container import read_container
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import Channel, Nodes
from quiltcli.formats.gltf.nodes import placements, read_nodes
from quiltcli.geometry import FloatArray, quaternions
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.take import Y_UP, Recording, choose, wrong

DENSE = 480
"""Samples a second of a curve that is not straight."""
MOST_SAMPLES = 1_000_000
_PARTS = ("translation", "rotation", "scale")


def read_gltf(spec: RecordedSpec) -> Recording:
    """Samples of a camera, or of the node that is named.

    Raises:
        MeshError: the file is no glTF 2.0, or is broken where this asks.
        ViewerError: the node is not told, or its animation is longer than a million samples.
    """
    container = read_container(spec.file)
    json = container.json
    nodes = read_nodes(json)
    node, name = _subject(spec, json, nodes)
    chain = _chain(nodes, node)
    clips, _ = read_clips(json, Accessors(container))
    moving: dict[tuple[int, str], Channel] = {}
    for channel in (channel for clip in clips for channel in clip.channels):
        if channel.node in chain and channel.target in _PARTS:
            moving.setdefault((channel.node, channel.target), channel)
    times = _times(spec, node, list(moving.values()))
    world = np.eye(4)[None]
    for member in chain:
        world = world @ _placed(nodes, member, moving, times)
    turns = world[:, :3, :3] / np.sqrt((world[:, :3, :3] ** 2).sum(axis=1, keepdims=True))
    return Recording(
        subject=name,
        positions=np.broadcast_to(world[:, :3, 3], (len(times), 3)).copy(),
        rotations=np.broadcast_to(quaternions.from_matrices(turns), (len(times), 4)).copy(),
        times=times,
        metres=1.0,
        axes=Y_UP,
        is_camera=True,
        is_curve=True,
        notices=() if moving else (f"{name} is not animated",),
    )


def _subject(spec: RecordedSpec, json: Json, nodes: Nodes) -> tuple[int, str]:
    """Index and name of the node asked for, or of the only camera."""
    entries = json["nodes"]
    shown = [int(node) for node in nodes.drawn]
    if spec.subject is None:
        shown = [node for node in shown if entries.at(node).has("camera")]
    names = [entries.at(node)["name"].text("") or f"node {node}" for node in shown]
    k = choose(spec, names, "cameras" if spec.subject is None else "nodes")
    return shown[k], names[k]


def _chain(nodes: Nodes, node: int) -> list[int]:
    """The node and all above it, from the root down."""
    chain: list[int] = []
    while node >= 0:
        chain.insert(0, node)
        node = int(nodes.parent[node])
    return chain


def _times(spec: RecordedSpec, node: int, moving: list[Channel]) -> FloatArray:
    """Seconds (N,) at which the curve is sampled: its keys, and many more where it is not straight."""
    if not moving:
        return np.zeros(1)
    keys = np.unique(np.concatenate([channel.times for channel in moving]))
    if all(channel.interpolation == "LINEAR" and channel.node == node for channel in moving):
        return keys
    count = int(np.ceil((keys[-1] - keys[0]) * DENSE)) + 1
    if count > MOST_SAMPLES:
        words = f"its animation of {keys[-1] - keys[0]:.0f} s is longer than can be sampled"
        raise wrong(spec.file, words)
    return np.unique(np.concatenate((keys, np.linspace(keys[0], keys[-1], count))))


def _placed(nodes: Nodes, node: int, moving: dict[tuple[int, str], Channel], times: FloatArray) -> FloatArray:
    """Placement (N or 1, 4, 4) of a node below its parent at some times."""
    if nodes.has_matrix[node]:
        return np.asarray(nodes.matrix[node][None])
    parts = []
    for part in _PARTS:
        channel = moving.get((node, part))
        rest: FloatArray = getattr(nodes, part)[node][None]
        parts.append(rest if channel is None else _values(channel, times))
    count = max(map(len, parts))
    return placements(*(np.broadcast_to(part, (count, part.shape[1])) for part in parts))


def _values(channel: Channel, times: FloatArray) -> FloatArray:
    """What moves a node at some times (N,)."""
    return np.stack([value_at(channel, time) for time in times.tolist()])
