"""Animations: keys from the file, and what they say at a time (glTF 2.0, section 3.11, appendix C)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import Channel, Clip
from quiltcli.geometry import FloatArray

_WIDTH = {"translation": 3, "rotation": 4, "scale": 3}
_KIND = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
# Quaternions nearer than this are joined by a chord: the arc's formula would divide by nearly nothing.
_NEAR = 1 - 1e-9
# Sines and arcs differ in their last bit from one machine to the next; what is kept of them does not.
_STEP = 2.0**-40


def read_clips(json: Json, accessors: Accessors) -> tuple[tuple[Clip, ...], int]:
    """The animations of a document, and the number of channels that move something other than nodes.

    Raises:
        MeshError: an accessor is broken, times do not ascend, or a channel fits no node.
    """
    clips = []
    other = 0
    for number, entry in enumerate(json["animations"].items(), 1):
        channels = []
        for item in entry["channels"].items():
            if item["target"]["path"].text() not in _KIND:
                other += 1
            elif item["target"]["node"]:
                channels.append(_channel(json, entry, item, accessors))
        end = max((float(channel.times[-1]) for channel in channels), default=0.0)
        clips.append(Clip(entry["name"].text("") or f"animation {number}", tuple(channels), end))
    return tuple(clips), other


def _channel(json: Json, clip: Json, item: Json, accessors: Accessors) -> Channel:
    """One channel with the keys of its sampler."""
    target = item["target"]
    node = target["node"].index(json["nodes"].length(), "node")
    kind = target["path"].text()
    if kind != "weights" and json["nodes"].at(node)["matrix"]:
        raise target["node"].error(f"node {node} has a matrix (expected translation, rotation and scale)")
    sampler = clip["samplers"].at(item["sampler"].index(clip["samplers"].length(), "sampler"))
    interpolation = sampler["interpolation"].one_of(("LINEAR", "STEP", "CUBICSPLINE"), "LINEAR")
    times = accessors.floats(sampler["input"], "SCALAR")[:, 0]
    if not (np.isfinite(times).all() and (np.diff(times) >= 0).all()):
        raise sampler["input"].error("its times do not ascend")
    values = accessors.floats(sampler["output"], _KIND[kind])
    if not np.isfinite(values).all():
        raise sampler["output"].error("holds numbers that are not finite")
    per_key = 3 if interpolation == "CUBICSPLINE" else 1
    targets = 1 if kind != "weights" else max(len(values) // (per_key * len(times)), 1)
    if len(values) != len(times) * per_key * targets:
        raise sampler["output"].error(f"has {len(values)} elements for {len(times)} keys")
    width = _WIDTH.get(kind, targets)
    keys = values.reshape(len(times), per_key, width)
    if interpolation == "CUBICSPLINE":
        return Channel(node, kind, interpolation, times, keys[:, 1], np.stack((keys[:, 0], keys[:, 2])))
    return Channel(node, kind, interpolation, times, keys[:, 0], np.empty((0, len(times), width)))


def chosen_clips(path: str, clips: Sequence[Clip], wanted: str | Sequence[str]) -> tuple[Clip, ...]:
    """Those of the clips that are wanted: `all`, the ones of a name, or of several names.

    Raises:
        MeshError: there is none of that name.
    """
    if wanted == "all":
        return tuple(clips)
    names = (wanted,) if isinstance(wanted, str) else tuple(wanted)
    known = ", ".join(repr(clip.name) for clip in clips[:20])
    expected = f"expected all, {known}" if known else "the file has no animation"
    missing = [name for name in names if all(clip.name != name for clip in clips)]
    if missing:
        raise MeshError([Problem(f"has no animation {name!r} ({expected})", path) for name in missing])
    return tuple(clip for name in names for clip in clips if clip.name == name)


def clip_time(seconds: float, end: float, after: str) -> float:
    """Time within a clip: held at its ends, begun anew after it, or run to and fro.

    Args:
        seconds: of the scene, negative before the clip begins.
        end: of the clip, seconds; it begins at 0.
        after: `hold`, `loop` or `bounce`.
    """
    if end <= 0 or after == "hold":
        return min(max(seconds, 0.0), max(end, 0.0))
    if after == "loop":
        return seconds % end
    there = seconds % (2 * end)
    return min(there, 2 * end - there)


def value_at(channel: Channel, time: float) -> FloatArray:
    """The value (n,) of a channel's property at a time within its clip; held before and after its keys."""
    times, values = channel.times, channel.values
    first: FloatArray = values[0]
    last: FloatArray = values[-1]
    if time <= times[0]:
        return first
    if time >= times[-1]:
        return last
    k = int(np.searchsorted(times, time, side="right")) - 1
    if channel.interpolation == "STEP":
        return np.asarray(values[k])
    step = float(times[k + 1] - times[k])
    u = (time - float(times[k])) / step
    turning = channel.target == "rotation"
    if channel.interpolation == "CUBICSPLINE":
        leave, arrive = step * channel.tangents[1, k], step * channel.tangents[0, k + 1]
        u2, u3 = u * u, u * u * u
        value = (2 * u3 - 3 * u2 + 1) * values[k] + (u3 - 2 * u2 + u) * leave
        value = value + (3 * u2 - 2 * u3) * values[k + 1] + (u3 - u2) * arrive
        return _unit(value) if turning else value
    if turning:
        return slerp(values[k], values[k + 1], u)
    return np.asarray((1 - u) * values[k] + u * values[k + 1])


def slerp(a: FloatArray, b: FloatArray, u: float) -> FloatArray:
    """The unit quaternion a share `u` of the shorter arc from `a` to `b`."""
    a, b = _unit(a), _unit(b)
    cosine = float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    if cosine < 0:
        b, cosine = -b, -cosine
    if cosine > _NEAR:
        return _unit((1 - u) * a + u * b)
    angle = math.acos(cosine)
    share = math.sin((1 - u) * angle) * a + math.sin(u * angle) * b
    return np.asarray(np.round(_unit(share) / _STEP) * _STEP)


def _unit(q: FloatArray) -> FloatArray:
    length = math.sqrt(float(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]))
    return q / length if length > 0 else np.array([0.0, 0.0, 0.0, 1.0])
