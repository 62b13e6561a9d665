"""What the program is held to, as ratios of things timed in one run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from tests.benchmarks import rings
from tests.benchmarks.moving import EARLY
from tests.benchmarks.race import ratio
from tests.benchmarks.shadowed import cost

KINDS = ("culled", "two-sided")
_EMBREE = "/ Embree, 1 thread"
_MIDDLE = ("mixed", "spheres")  # scenes with many triangles of 10 to 60 pixels


@dataclass(frozen=True)
class Target:
    """A bound, what was found, and the configuration that is farthest from it."""

    what: str
    where: str
    value: float
    limit: float
    unit: str = ""

    @property
    def met(self) -> bool:
        """Whether the bound is kept."""
        return self.value <= self.limit


def targets(results: Mapping[str, Any]) -> list[Target]:
    """All targets the results say something about."""
    duels = {name: found["times"] for name, found in results.get("duels", {}).items()}
    found = [*_visibility(duels), *_frames(duels), *_sequences(results.get("sequences", []))]
    found += _textures({name: one["times"] for name, one in results.get("textures", {}).items()})
    for name, one in results.get("shadows", {}).items():
        for kind in ("a sun", "a point", "two points"):
            what = f"shadows of {kind}, a pixel and lamp"
            found.append(Target(what, f"{name}/cube", cost(one, kind), 250, " ns"))
    found += _moving(results.get("moving", {}))
    found += _rings(results.get("rings", {}))
    return [target for target in found if not math.isnan(target.value)]


def _moving(found: Mapping[str, Any]) -> Iterator[Target]:
    """Scenes that move, and memory."""
    if not found:
        return
    value = ratio(found["times"], "moving", "still", "cpu")
    yield Target("a frame in which all turns / a still one, 2 workers", "balls/cube", value, 1.15)
    memory = found["sequence"]
    what = f"memory after {memory['frames']} numbered meshes / after {EARLY}"
    yield Target(what, "ball/cube", memory["last"] / memory["early"], 1.05)
    few, many = (found["samples"][key] for key in sorted(found["samples"], key=int))
    yield Target("memory, 64 samples / 4", "room/cube", many / few, 1.2)


def _rings(found: Mapping[str, Any]) -> Iterator[Target]:
    """A spinning mirror's pictures: one thread each, in processor time; whole turns in wall time."""
    for row in found.get("visibility", ()):
        name = f"{row['name']}, mirror"
        yield Target(
            f"visibility, edge functions {_EMBREE}", name, row["exact"] / row["embree"], row["limit"]
        )
        yield Target("visibility, edge functions / settled rays", name, row["exact"] / row["settled"], 0.4)
    for turn in found.get("turns", ()):
        share, name = rings.shares(turn), f"{turn['name']}, {turn['positions']} positions"
        yield Target("a turn, 2 workers / its visibility, 1", name, share["wall"], rings.TURN)
        yield Target("the same in processor time, halved", name, share["cpu"], rings.TURN)
        yield Target("memory of a turn", name, turn["memory"] / 1e9, rings.MEMORY / 1e9, " GB")


def _worst(what: str, values: Mapping[str, float], limit: float) -> Iterator[Target]:
    known = {name: value for name, value in values.items() if not math.isnan(value)}
    if known:
        name = max(known, key=known.__getitem__)
        yield Target(what, name, known[name], limit)


def _visibility(duels: Mapping[str, Any]) -> Iterator[Target]:
    """One thread each, so in processor time: other work on the machine does not count."""
    for kind, limit in (("culled", 0.6), ("two-sided", 0.9)):
        values = {name: ratio(times, f"{kind} keys", "embree", "cpu") for name, times in duels.items()}
        what = f"visibility, {kind}, 1 process {_EMBREE}"
        if kind == "culled":
            for name, bound in (("dragon/ball", 0.45), ("room/cube", 0.12)):
                if name in values:
                    yield Target(what, name, values[name], bound)
        yield from _worst(f"{what}, everywhere", values, limit)


def _frames(duels: Mapping[str, Any]) -> Iterator[Target]:
    for look, ours, theirs in (("frame", "frame 2", "draw"), ("matte frame", "matte 2", "lambert draw")):
        draws, read = {}, {}
        for name, times in duels.items():
            for kind in KINDS:
                key = f"{name} {kind}"
                draw = f"opengl {kind} {theirs}"
                draws[key] = ratio(times, f"{kind} {ours}", draw)
                read[key] = ratio(times, f"{kind} {ours}", (draw, "opengl read"))
        middle = {name: value for name, value in draws.items() if name.startswith(_MIDDLE)}
        plain = {name: value for name, value in draws.items() if name not in middle}
        yield from _worst(f"{look}, 2 workers / llvmpipe's draws and readback, everywhere", read, 0.7)
        yield from _worst(f"{look}, 2 workers / llvmpipe's draws, dragon and room", plain, 1.2)
        yield from _worst(f"{look}, 2 workers / llvmpipe's draws, mixed and spheres", middle, 2.0)
    ball = duels.get("dragon/ball", {})
    whole = ratio(ball, "two-sided frame 2", "opengl whole mesh")
    yield Target("frame, 2 workers / llvmpipe, whole mesh once a facet", "dragon/ball two-sided", whole, 0.05)
    for kind, limit in (("culled", 0.6), ("two-sided", 0.9)):
        value = ratio(ball, f"{kind} frame 2", "embree")
        yield Target(f"frame, 2 workers {_EMBREE}", f"dragon/ball {kind}", value, limit)


def _sequences(sequences: list[Mapping[str, Any]]) -> Iterator[Target]:
    for one in sequences:
        limit = {"zip": 1.25, "zstd": 1.5}.get(one["compression"], math.inf)
        what = f"{one['frames']} frames / writing them alone"
        yield Target(what, one["compression"], one["sequence"] / one["writing alone"], limit)
    if sequences:
        memory = max(one["memory"] for one in sequences) / 1e9
        yield Target("memory of all processes", "dragon/ball", memory, 3.0, " GB")


def _textures(scenes: Mapping[str, Any]) -> Iterator[Target]:
    """One process, in processor time."""
    for name, times in scenes.items():
        value = ratio(times, "trilinear", "plain", "cpu")
        yield Target("textured frame, trilinear / plain", f"{name}/cube", value, 2.5)
        if name == "room":
            value = ratio(times, "large, 16 samples", "large", "cpu")
            yield Target("untextured frame, 16 samples / 1", f"{name}/cube, 4096²", value, 6.0)
        value = ratio(times, "anisotropic, 16 samples", "anisotropic", "cpu")
        yield Target("textured frame, 16 samples / 1", f"{name}/cube", value, 12.0)
