"""Lights at the nodes of a scene (KHR_lights_punctual)."""

from __future__ import annotations

import math
from collections.abc import Iterable

from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.gltf.model import PunctualLight

LIGHTS = "KHR_lights_punctual"


def read_lights(json: Json, drawn: Iterable[int]) -> tuple[PunctualLight, ...]:
    """The lights at the drawn nodes.

    Raises:
        MeshError: a node names a light that is not there, or a value is not what it must be.
    """
    known = json.extension(LIGHTS)["lights"]
    nodes = json["nodes"]
    found = []
    for node in drawn:
        entry = nodes.at(node)
        use = entry.extension(LIGHTS)["light"] if entry.has("extensions") else None
        if use:
            found.append(_light(known.at(use.index(known.length(), "light")), node))
    return tuple(found)


def _light(entry: Json, node: int) -> PunctualLight:
    color = entry["color"].numbers(3, (1, 1, 1))
    for part in entry["color"].items():
        part.number(low=0)
    kind = entry["type"].one_of(("directional", "point", "spot"))
    spot = entry["spot"]
    outer = spot["outerConeAngle"].number(math.pi / 4, 0, math.pi / 2 + 1e-6)
    return PunctualLight(
        name=entry["name"].text(""),
        node=node,
        kind=kind,
        color=(color[0], color[1], color[2]),
        intensity=entry["intensity"].number(1.0, low=0),
        reach=entry["range"].number(math.inf, low=0),
        inner=min(spot["innerConeAngle"].number(0.0, 0, math.pi / 2 + 1e-6), outer),
        outer=outer,
    )
