"""The lights of a scene: records of a kind, in one table.

A kind of light is a record here and a row of `shading.lights.KINDS`, which says how it arrives at points.
What a scene file may say of it is in `job.lights`; `lights_of` makes the one of the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from quiltcli.errors import SceneError
from quiltcli.geometry import Float32Array, FloatArray, cross, normalized
from quiltcli.scene.environment.maps import Maps, maps_of, turned_maps
from quiltcli.scene.environment.panorama import read_panorama

if TYPE_CHECKING:
    from quiltcli.job.lights import AreaLight, EnvironmentLight, LightSpec, SpotLight

HEADLIGHT = 3.0
"""Irradiance of the light at the eye; a white surface that faces it comes out near 1."""

_DIM = (0.1, 0.1, 0.1)


@dataclass(frozen=True, eq=False)
class Light:
    """One light.

    Attributes:
        color: (3,) linear; of what, each kind says.
        shadows: whether what stands in its way casts a shadow.
    """

    kind: ClassVar[str]
    color: Float32Array
    shadows: bool = field(default=False, kw_only=True)


@dataclass(frozen=True, eq=False)
class Everywhere(Light):
    """Light from everywhere, which what stands around a place may keep from it.

    Attributes:
        distance: how far off that may stand, metres.
        rays: directions in which it is looked for from a pixel.
    """

    distance: float = field(default=math.inf, kw_only=True)
    rays: int = field(default=32, kw_only=True)


@dataclass(frozen=True, eq=False)
class Ambient(Everywhere):
    """The same light from everywhere; `color` is its radiance."""

    kind: ClassVar[str] = "ambient"


@dataclass(frozen=True, eq=False)
class Environment(Everywhere):
    """Light from a picture of all that is around; `color` is a factor of its radiance.

    Attributes:
        maps: what surfaces receive of it, and what they mirror.
    """

    kind: ClassVar[str] = "environment"
    maps: Maps


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
        reach: where it has faded to nothing, metres.
    """

    kind: ClassVar[str] = "point"
    position: Float32Array
    reach: float = field(default=math.inf, kw_only=True)


@dataclass(frozen=True, eq=False)
class Spot(Point):
    """Light from one point into a cone; `color` is the radiant intensity in the middle of it.

    A share (scale · cosine + offset)², held between 0 and 1, of it goes into each direction
    (KHR_lights_punctual).

    Attributes:
        direction: (3,) unit, along the middle of the cone.
        inner: cosine of the angle to where it begins to fade.
        outer: cosine of the angle to where it is dark, less than `inner`.
    """

    kind: ClassVar[str] = "spot"
    direction: Float32Array
    inner: float
    outer: float

    @property
    def scale(self) -> float:
        """What cosines are multiplied by."""
        return 1 / (self.inner - self.outer)

    @property
    def offset(self) -> float:
        """What is added to them."""
        return -self.outer * self.scale


@dataclass(frozen=True, eq=False)
class Area(Light):
    """A rectangle that shines to one side; `color` is its radiance.

    Attributes:
        position: (3,) its middle, world metres.
        across: (3,) from there to the middle of a side, metres.
        along: (3,) to the middle of the next, at right angles; it shines along `across` × `along`.
        rays: places on it that are looked for from a pixel.
    """

    kind: ClassVar[str] = "area"
    position: FloatArray
    across: FloatArray
    along: FloatArray
    rays: int = 16


@dataclass(frozen=True, eq=False)
class Headlight(Light):
    """A light at the viewer's eye; `color` is the irradiance at any distance."""

    kind: ClassVar[str] = "headlight"


KINDS: tuple[type[Light], ...] = (Directional, Point, Spot, Area, Ambient, Environment, Headlight)
"""All kinds."""


def ambient(color: Sequence[float]) -> Ambient:
    """An ambient light."""
    return Ambient(_single(color))


def directional(direction: Sequence[float], color: Sequence[float], *, shadows: bool = False) -> Directional:
    """A directional light; its direction may be of any length."""
    return Directional(_single(color), _unit(direction), shadows=shadows)


def point(
    position: Sequence[float], color: Sequence[float], reach: float | None = None, *, shadows: bool = False
) -> Point:
    """A point light, that has faded to nothing at a distance if there is one."""
    return Point(_single(color), _single(position), reach=reach or math.inf, shadows=shadows)


def spot(
    position: Sequence[float],
    direction: Sequence[float],
    color: Sequence[float],
    cone: tuple[float, float],
    reach: float | None = None,
    *,
    shadows: bool = False,
) -> Spot:
    """A spot light; its `cone` begins to fade and is dark at angles, radians, from its direction."""
    inner, outer = (math.cos(angle) for angle in cone)
    # KHR_lights_punctual divides by a thousandth at least: a cone of sharp edges is as good as one.
    inner = max(inner, outer + 1e-3)
    return Spot(
        _single(color),
        _single(position),
        _unit(direction),
        float(np.float32(inner)),
        float(np.float32(outer)),
        reach=reach or math.inf,
        shadows=shadows,
    )


def area(
    position: Sequence[float],
    direction: Sequence[float],
    size: tuple[float, float],
    roll: float,
    color: Sequence[float],
    *,
    shadows: bool = True,
    rays: int = 16,
) -> Area:
    """A rectangle of width and height, the width level (along X where it shines up or down).

    Args:
        position: its middle, metres.
        direction: the way it shines, of any length.
        size: width and height, metres.
        roll: turn about that direction, clockwise as seen from behind, radians.
        color: radiance.
        shadows: whether it casts shadows.
        rays: places on it that are looked for from a pixel.
    """
    way = normalized(np.array(direction, dtype=np.float64))
    level = cross(way, np.array([0.0, 1.0, 0.0]))
    level = normalized(level) if np.abs(level).max() > 1e-6 else np.array([1.0, 0.0, 0.0])
    down = cross(way, level)
    turned = math.cos(roll) * level + math.sin(roll) * down
    half_width, half_height = size[0] / 2, size[1] / 2
    return Area(
        _single(color),
        np.array(position, dtype=np.float64),
        half_width * turned,
        half_height * cross(way, turned),
        rays,
        shadows=shadows,
    )


def panel(
    position: Sequence[float],
    across: Sequence[float],
    along: Sequence[float],
    color: Sequence[float],
    *,
    shadows: bool = True,
) -> Area:
    """A rectangle by its middle and the ways to the middles of two sides, at right angles, metres."""
    place, half_width, half_height = (np.array(v, dtype=np.float64) for v in (position, across, along))
    return Area(_single(color), place, half_width, half_height, shadows=shadows)


def environment(
    panorama: str, axes: Sequence[float], color: Sequence[float], *, shadows: bool = False
) -> Environment:
    """An environment by the file of its panorama, and the world from its directions (9), row by row.

    Raises:
        SceneError: the panorama cannot be read.
    """
    turn = np.array(axes, dtype=np.float64).reshape(3, 3)
    return Environment(_single(color), turned_maps(read_panorama(panorama), turn), shadows=shadows)


def default_lights() -> tuple[Light, ...]:
    """Those of a scene that has none: a headlight and a dim ambient light."""
    return ambient(_DIM), Headlight(_single((HEADLIGHT,) * 3))


def lights_of(specs: Sequence[LightSpec]) -> tuple[Light, ...]:
    """The lights that a scene file asks for, by kind: their sum does not depend on how it lists them.

    Ambient lights are one unless they cast shadows: what comes from everywhere cannot be told apart.

    Raises:
        SceneError: a panorama cannot be read.
    """
    if not specs:
        return default_lights()
    around = [spec.color for spec in specs if spec.type == "ambient" and not spec.shadows]
    rows: list[Light] = [ambient(np.sum(around, axis=0).tolist())] if np.any(around) else []
    for kind in KINDS:
        rows += _of_kind(kind.kind, specs)
    return tuple(rows)


def _of_kind(kind: str, specs: Sequence[LightSpec]) -> Iterator[Light]:
    for spec in specs:
        if spec.type != kind:
            continue
        if spec.type == "directional":
            yield directional(spec.direction, spec.color, shadows=spec.shadows)
        elif spec.type == "point":
            yield point(spec.position, spec.color, spec.range, shadows=spec.shadows)
        elif spec.type == "spot":
            yield _spot(spec)
        elif spec.type == "area":
            yield _area(spec)
        elif spec.type == "environment":
            yield _environment(spec)
        elif spec.type == "ambient" and spec.shadows:
            distance = spec.distance or math.inf
            yield Ambient(_single(spec.color), shadows=True, distance=distance, rays=spec.rays)


def _spot(spec: SpotLight) -> Spot:
    cone = math.radians(spec.inner_deg), math.radians(spec.outer_deg)
    return spot(spec.position, spec.direction, spec.color, cone, spec.range, shadows=spec.shadows)


def _area(spec: AreaLight) -> Area:
    roll = math.radians(spec.roll_deg)
    return area(
        spec.position,
        spec.direction,
        spec.size,
        roll,
        spec.color,
        shadows=spec.shadows,
        rays=spec.rays,
    )


def _environment(spec: EnvironmentLight) -> Environment:
    """An environment, its panorama read.

    Raises:
        SceneError: the panorama cannot be read.
    """
    try:
        maps = maps_of(read_panorama(spec.file), spec.rotate_deg)
    except SceneError as error:
        problems = [spec.source.problem(("file",), str(problem)) for problem in error.problems]
        raise SceneError(problems) from error
    return Environment(
        _single((spec.intensity,) * 3),
        maps,
        shadows=spec.shadows,
        distance=spec.distance or math.inf,
        rays=spec.rays,
    )


def _unit(direction: Sequence[float]) -> Float32Array:
    return _single(normalized(np.array([direction], dtype=np.float64))[0].tolist())


def _single(values: Sequence[float]) -> Float32Array:
    return np.array(values, dtype=np.float64).astype(np.float32)
