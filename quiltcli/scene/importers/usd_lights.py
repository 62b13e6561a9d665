"""UsdLux lights in their places.

USD says that strengths are in nits, and that a light of intensity 1 has the colour (1, 1, 1) of a picture:
they are taken as the scene's own radiance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from quiltcli.formats.usd.lights import Lamp, read_lamp
from quiltcli.formats.usd.places import Moment, Place
from quiltcli.formats.usd.stage import path_of
from quiltcli.geometry import FloatArray, normalized, rotation_deg
from quiltcli.scene.importers.model import FileLight, Triple, triple

_FROM_DOME = rotation_deg((0.0, 180.0, 0.0))
"""A dome's picture has +Z in its middle, ours -Z."""


def lights_at(prims: Sequence[Any], moment: Moment) -> tuple[FileLight, ...]:
    """The lights of a stage at a time, those that shine."""
    return tuple(_lights(prims, moment))


def lights_lost(prims: Sequence[Any], moment: Moment) -> Iterator[str]:
    """What of the lights is not drawn, once the scene takes them."""
    for prim in prims:
        lamp = read_lamp(moment.stage, prim, moment.time)
        if lamp is None:
            yield f"{path_of(prim)}: is a {prim.GetTypeName()}, which does not shine here"
        elif lamp.notices:
            yield f"{path_of(prim)}: not drawn: {', '.join(lamp.notices)}"


def _lights(prims: Sequence[Any], moment: Moment) -> Iterator[FileLight]:
    for prim in prims:
        lamp = read_lamp(moment.stage, prim, moment.time)
        if lamp is None or not moment.shown(Place(prim)):
            continue
        local = moment.world(prim)
        yield _placed(lamp, local, moment.stage.world)


def _placed(lamp: Lamp, local: FloatArray, world: FloatArray) -> FileLight:
    """A light of the stage in metres, Y up."""
    matrix = world @ local
    rows = matrix[:3, :3]
    ways = normalized(rows.T)
    # Sizes grow with the prim; strengths are by the stage's own units.
    stretch = np.sqrt((local[:3, :3] ** 2).sum(axis=0))
    wide, high = lamp.size[0] * stretch[0], lamp.size[1] * stretch[1]
    color = lamp.color
    across, along = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if lamp.kind == "area":
        across, along = triple(rows[:, 0] * lamp.size[0] / 2), triple(rows[:, 1] * -lamp.size[1] / 2)
        color = _times(color, 1 / (wide * high) if lamp.normalized and wide * high else 1.0)
    if lamp.kind in ("point", "spot"):
        radius = lamp.size[0] * float(np.cbrt(stretch.prod()))
        metres = float(np.cbrt(abs(np.linalg.det(world[:3, :3]))))
        # A sphere of radiance L looks like a disc: its intensity is L·π·r². Its surface is 4·π·r².
        share = metres**2 / 4 if lamp.normalized else math.pi * (radius * metres) ** 2
        color = _times(color, share)
    return FileLight(
        kind=lamp.kind,
        position=triple(matrix[:3, 3]),
        direction=triple(-ways[2]),
        color=color,
        reach=math.inf,
        cone=lamp.cone,
        across=across,
        along=along,
        panorama=lamp.panorama,
        axes=tuple((ways.T @ _FROM_DOME).ravel().tolist()),
    )


def _times(color: Triple, factor: float) -> Triple:
    return color[0] * factor, color[1] * factor, color[2] * factor
