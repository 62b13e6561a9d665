"""The lights of a scene: records of a kind, in one table.

A kind of light is a record here and a row of `shading.lights.KINDS`, which says how it arrives at points.
What a scene file may say of it is in `job.scene`; `lights_of` makes the one of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from quiltcli.geometry import Float32Array, normalized

if TYPE_CHECKING:
    from quiltcli.job.scene import LightSpec

HEADLIGHT = 3.0
"""Irradiance of the light at the eye; a white surface that faces it comes out near 1."""

_DIM = (0.1, 0.1, 0.1)


@dataclass(frozen=True, eq=False)
class Light:
    """One light.

    Attributes:
        color: (3,) linear; of what, each kind says.
    """

    kind: ClassVar[str]
    color: Float32Array


@dataclass(frozen=True, eq=False)
class Ambient(Light):
    """The same light from everywhere; `color` is its radiance."""

    kind: ClassVar[str] = "ambient"


@dataclass(frozen=True, eq=False)
class Directional(Light):
    """Light from infinitely far away; `color` is the irradiance on a surface that faces it.

    Attributes:
        direction: (3,) unit direction in which it travels.
    """

    kind: ClassVar[str] = "directional"
    direction: Float32Array


@dataclass(frozen=True, eq=False)
class Point(Light):
    """Light from one point; `color` is the radiant intensity, which falls with the square of the distance.

    Attributes:
        position: (3,) world metres.
    """

    kind: ClassVar[str] = "point"
    position: Float32Array


@dataclass(frozen=True, eq=False)
class Headlight(Light):
    """A light at the viewer's eye; `color` is the irradiance at any distance."""

    kind: ClassVar[str] = "headlight"


KINDS: tuple[type[Light], ...] = (Directional, Point, Ambient, Headlight)
"""All kinds."""


def ambient(color: Sequence[float]) -> Ambient:
    """An ambient light."""
    return Ambient(_single(color))


def directional(direction: Sequence[float], color: Sequence[float]) -> Directional:
    """A directional light; its direction may be of any length."""
    unit = normalized(np.array([direction], dtype=np.float64))[0]
    return Directional(_single(color), unit.astype(np.float32))


def point(position: Sequence[float], color: Sequence[float]) -> Point:
    """A point light."""
    return Point(_single(color), _single(position))


def default_lights() -> tuple[Light, ...]:
    """Those of a scene that has none: a headlight and a dim ambient light."""
    return ambient(_DIM), Headlight(_single((HEADLIGHT,) * 3))


def lights_of(specs: Sequence[LightSpec]) -> tuple[Light, ...]:
    """The lights that a scene file asks for, by kind: their sum does not depend on how it lists them.

    Ambient lights are one: what comes from everywhere cannot be told apart.
    """
    if not specs:
        return default_lights()
    around = [spec.color for spec in specs if spec.type == "ambient"]
    rows: list[Light] = [ambient(np.sum(around, axis=0).tolist())] if np.any(around) else []
    rows += [directional(spec.direction, spec.color) for spec in specs if spec.type == "directional"]
    rows += [point(spec.position, spec.color) for spec in specs if spec.type == "point"]
    return tuple(rows)


def _single(values: Sequence[float]) -> Float32Array:
    return np.array(values, dtype=np.float64).astype(np.float32)
