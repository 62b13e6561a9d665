"""Lights at visible points: from where their light comes, how much of it, and how fast that changes.

One row of `KINDS` for each kind of light. What is hidden of it is told in `shadows`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray
from quiltcli.scene.lights import Ambient, Area, Directional, Environment, Headlight, Light, Point, Spot
from quiltcli.scene.scene import Scene
from quiltcli.shading.environment import Around, around
from quiltcli.shading.nodes import Nodes, nodes_of
from quiltcli.shading.rectangle import received_from
from quiltcli.shading.shadows import Shadows, casts
from quiltcli.shading.surface import Surface
from quiltcli.visibility.draw import WholeTiles
from quiltcli.visibility.rays.blockers import blockers_of, demand_blockers
from quiltcli.visibility.resolve.vectors import PointVectors, along, products, sum_of_products

# Nearer to a point light than this, in metres, its light does not grow any more.
LEAST_DISTANCE = 1e-3
_LEAST_DISTANCE2 = np.float32(LEAST_DISTANCE**2)
_ONE = np.float32(1)
_WIDE = 24.0
"""How many times as far as a square reaches the place must be where light fades to nothing."""


@dataclass(frozen=True)
class Arrival:
    """The light of one lamp at n groups of k points.

    Attributes:
        color: (3,) irradiance on a surface that faces the lamp; radiance of what comes from everywhere.
        nl: (n, k) or (n, 1) cosine between normal and lamp, 0 where it is behind; None for light from
            everywhere.
        vl: (n, k) cosine between eye and lamp; None where nobody asked.
        received: (n, k) or (n, 1) share of `color` that a surface receives; None for light from everywhere.
        size: the lamp where it has a size, which a layer's reflection shows.
        around: what comes from an environment, instead of all the others.
        shown: (n, k) share of it that nothing hides; None for all. It is part of `received`.
    """

    color: Float32Array
    nl: Float32Array | None = None
    vl: Float32Array | None = None
    received: Float32Array | None = None
    size: Area | None = None
    around: Around | None = None
    shown: Float32Array | None = None


@dataclass(frozen=True)
class Middle:
    """The middles of S squares, and how far from them their pixels are.

    Attributes:
        squares: the squares.
        place: (3,) where the eye is, world metres.
        eye: (3, S) unit directions to the eye.
        eye_turn: (S,) the angle by which these turn.
        depth_turn: (S,) how much of their distance the pixels' distances differ by.
    """

    squares: WholeTiles
    place: FloatArray
    eye: FloatArray
    eye_turn: FloatArray
    depth_turn: FloatArray

    @property
    def nodes(self) -> Nodes:
        """The squares' nodes."""
        return nodes_of(self.squares.side)

    @cached_property
    def point(self) -> FloatArray:
        """The points (3, S) that are seen in the middle, minus the eye."""
        return self.nodes.middle(self.squares.rays.axes) / self.nodes.middle(self.squares.inverse)

    @cached_property
    def reach(self) -> FloatArray:
        """How far (S,) points are from the middle, metres."""
        distance = np.sqrt(sum_of_products(self.point, self.point))
        return np.asarray((self.eye_turn + self.depth_turn) * distance)


@dataclass(frozen=True)
class Kind:
    """One kind of light.

    Attributes:
        arriving: the light's arrival at surfaces; with its cosine to the eye if the last argument is true.
        turning: unit directions (3, S) or (3, 1) to the lamp from the middles of squares, and the angle
            (S,) or (1,) they turn by, infinite where the light is not smooth; None for light from everywhere,
            which is smooth.
        placed: whether it asks for the points' positions.
    """

    arriving: Callable[[Any, Surface, bool], Arrival]
    turning: Callable[[Any, Middle], tuple[FloatArray, FloatArray]] | None
    placed: bool = False


def arrivals(
    lights: Sequence[Light], surface: Surface, shadows: Shadows | None, *, to_eye: bool
) -> Iterator[Arrival]:
    """The light of each lamp at surfaces; with its cosine `to_eye` if that is asked for.

    Args:
        lights: the lamps.
        surface: the surfaces.
        shadows: what is hidden of the lamps; None where nothing is to be.
        to_eye: whether cosines to the eye are asked for.
    """
    for light in lights:
        arrival = KINDS[type(light)].arriving(light, surface, to_eye)
        if shadows is not None and casts(light):
            reached = np.ones((1, 1), np.bool_) if arrival.received is None else arrival.received > 0
            arrival = shaded(arrival, shadows.shown(light, reached))
        yield arrival


def shaded(arrival: Arrival, shown: Float32Array) -> Arrival:
    """An arrival of which a share (n, k) is shown."""
    if arrival.around is not None:
        return replace(arrival, around=replace(arrival.around, shown=shown))
    if arrival.received is None:
        return replace(arrival, shown=shown)
    return replace(arrival, received=arrival.received * shown, shown=shown)


def reaches(light: Light, surface: Surface) -> BoolArray:
    """Whether a lamp's light, if nothing hides it, reaches some point (k,) of n groups."""
    received = KINDS[type(light)].arriving(light, surface, False).received
    if received is None:
        return np.ones(1, dtype=np.bool_)
    return np.asarray((received > 0).any(axis=0))


def has_surroundings(scene: Scene) -> bool:
    """Whether light of a scene comes from a picture of all that is around."""
    return any(isinstance(light, Environment) for light in scene.lights)


def is_grey(light: Light) -> bool:
    """Whether a lamp's light has no colour."""
    red, green, blue = light.color
    return bool(red == green == blue) and not isinstance(light, Environment)


def casting(scene: Scene) -> tuple[Light, ...]:
    """The lights of a scene that cast shadows."""
    return tuple(light for light in scene.lights if casts(light))


def demand_shadows(scene: Scene) -> None:
    """Raise where a scene's shadows cannot be drawn (MissingExtraError)."""
    if casting(scene):
        demand_blockers()


def prepare_shadows(scene: Scene) -> None:
    """Make ready what shadows need of a scene."""
    if casting(scene):
        blockers_of(scene)


def turns(scene: Scene, middle: Middle) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Directions to all lamps that have one, and by how much these turn; see `Kind.turning`."""
    for light in scene.lights:
        turning = KINDS[type(light)].turning
        if turning is not None:
            yield turning(light, middle)


def asks_for_places(scene: Scene) -> bool:
    """Whether some light differs from place to place."""
    return any(KINDS[type(light)].placed for light in scene.lights)


def _everywhere(light: Ambient, surface: Surface, to_eye: bool) -> Arrival:
    return Arrival(light.color)


def _around(light: Environment, surface: Surface, to_eye: bool) -> Arrival:
    return Arrival(light.color, around=around(light, surface))


def _from_afar(light: Directional, surface: Surface, to_eye: bool) -> Arrival:
    towards = -light.direction
    nl = _cosine(surface, out=along(surface.normal, towards))
    vl = _to_eye(surface, out=along(surface.ray, towards)) if to_eye else None
    return Arrival(light.color, nl, vl, nl)


def _afar(light: Directional, middle: Middle) -> tuple[FloatArray, FloatArray]:
    return -light.direction.astype(np.float64)[:, None], np.zeros(1)


def _from_place(light: Point, surface: Surface, to_eye: bool) -> Arrival:
    return _arriving_from(light, surface, to_eye)[0]


def _arriving_from(light: Point, surface: Surface, to_eye: bool) -> tuple[Arrival, Float32Array]:
    """The light of a point, and unit directions (3, n, k) to it."""
    offset = _offset(light.position, surface)
    towards = PointVectors(offset)
    nearness = np.reciprocal(np.maximum(products(towards, towards), _LEAST_DISTANCE2))
    offset *= np.sqrt(nearness)
    nl = _cosine(surface, out=products(surface.normal, towards))
    vl = _to_eye(surface, out=products(surface.ray, towards)) if to_eye else None
    received = nl * nearness
    if np.isfinite(light.reach):
        # KHR_lights_punctual: clamp(1 − (distance / range)⁴) / distance².
        faded = np.float32(light.reach**-4) / (nearness * nearness)
        received *= np.maximum(_ONE - faded, np.float32(0))
    return Arrival(light.color, nl, vl, received), offset


def _place(light: Point, middle: Middle) -> tuple[FloatArray, FloatArray]:
    offset = (light.position - middle.place)[:, None] - middle.point
    distance = np.sqrt(sum_of_products(offset, offset) + 1e-300)
    over = np.asarray(1 / distance)
    turn = middle.reach * over
    calm = (1 - turn) > over * LEAST_DISTANCE
    if np.isfinite(light.reach):
        calm &= np.abs(distance - light.reach) > _WIDE * middle.reach
    return offset * over, np.where(calm, turn, np.inf)


def _from_spot(light: Spot, surface: Surface, to_eye: bool) -> Arrival:
    arrival, towards = _arriving_from(light, surface, to_eye)
    assert arrival.received is not None
    share = sum_of_products(towards, -light.direction)
    share *= np.float32(light.scale)
    share += np.float32(light.offset)
    np.minimum(np.maximum(share, np.float32(0), out=share), _ONE, out=share)
    return replace(arrival, received=arrival.received * (share * share))


def _spot_place(light: Spot, middle: Middle) -> tuple[FloatArray, FloatArray]:
    towards, turn = _place(light, middle)
    cosine = -sum_of_products(towards, light.direction.astype(np.float64)[:, None])
    # The cone's edges: its light is 0 from one on, and at its greatest from the other.
    change = turn * (np.sqrt(np.maximum(1 - cosine * cosine, 0)) + turn)
    calm = np.abs(cosine - light.outer) > _WIDE * change
    calm &= np.abs(cosine - light.inner) > 2 * change
    return towards, np.where(calm, turn, np.inf)


def _from_rectangle(light: Area, surface: Surface, to_eye: bool) -> Arrival:
    got = received_from(light, surface)
    nl = np.divide(got.received, got.angle, out=np.zeros_like(got.received), where=got.angle > 0)
    return Arrival(light.color, nl, None, got.received, size=light)


def _rectangle(light: Area, middle: Middle) -> tuple[FloatArray, FloatArray]:
    towards, _ = _place(Point(light.color, light.position.astype(np.float32)), middle)
    return towards, np.full(1, np.inf)


def _offset(place: Float32Array, surface: Surface) -> Float32Array:
    """Vectors (3, n, k) from points to a place (3,) in the world."""
    position = surface.points.position
    assert position is not None
    start = (place - surface.eye).astype(np.float32)[:, None, None]
    result: Float32Array = start - position.astype(np.float32)
    return result


def _from_eye(light: Headlight, surface: Surface, to_eye: bool) -> Arrival:
    nl = products(surface.normal, surface.ray)
    nl = _cosine(surface, out=np.multiply(nl, surface.ray_scale, out=nl))
    vl = _to_eye(surface, out=np.reciprocal(surface.ray_scale)) if to_eye else None
    return Arrival(light.color, nl, vl, nl)


def _eye(light: Headlight, middle: Middle) -> tuple[FloatArray, FloatArray]:
    return middle.eye, middle.eye_turn


def _cosine(surface: Surface, out: Float32Array) -> Float32Array:
    """Makes products of normals with unit vectors their cosines, 0 behind the surface."""
    np.multiply(out, surface.normal_scale, out=out)
    return np.maximum(out, np.float32(0), out=out)


def _to_eye(surface: Surface, out: Float32Array) -> Float32Array:
    """Makes products of rays with unit vectors the cosines of these to the eye."""
    return np.multiply(out, surface.ray_scale, out=out)


KINDS: dict[type[Light], Kind] = {
    Ambient: Kind(_everywhere, None),
    Environment: Kind(_around, None),
    Directional: Kind(_from_afar, _afar),
    Point: Kind(_from_place, _place, placed=True),
    Spot: Kind(_from_spot, _spot_place, placed=True),
    Area: Kind(_from_rectangle, _rectangle, placed=True),
    Headlight: Kind(_from_eye, _eye),
}
