"""Lights at visible points: from where their light comes, how much of it, and how fast that changes.

One row of `KINDS` for each kind of light. A light that is seen under an angle, as an area or a picture of
the surroundings is, would be a row whose `arriving` says so for its samples one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene.lights import Ambient, Directional, Headlight, Light, Point
from quiltcli.scene.scene import Scene
from quiltcli.shading.nodes import Nodes, nodes_of
from quiltcli.shading.surface import Surface
from quiltcli.visibility.draw import WholeTiles
from quiltcli.visibility.resolve.vectors import PointVectors, along, products, sum_of_products

# Nearer to a point light than this, in metres, its light does not grow any more.
LEAST_DISTANCE = 1e-3
_LEAST_DISTANCE2 = np.float32(LEAST_DISTANCE**2)


@dataclass(frozen=True)
class Arrival:
    """The light of one lamp at n groups of k points.

    Attributes:
        color: (3,) irradiance on a surface that faces the lamp; radiance of what comes from everywhere.
        nl: (n, k) or (n, 1) cosine between normal and lamp, 0 where it is behind; None for light from
            everywhere.
        vl: (n, k) cosine between eye and lamp; None where nobody asked.
        received: (n, k) or (n, 1) share of `color` that a surface receives; None for light from everywhere.
    """

    color: Float32Array
    nl: Float32Array | None = None
    vl: Float32Array | None = None
    received: Float32Array | None = None


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


def arrivals(scene: Scene, surface: Surface, *, to_eye: bool) -> Iterator[Arrival]:
    """The light of each lamp at surfaces; with its cosine `to_eye` if that is asked for."""
    return (_arrival(light, surface, to_eye) for light in scene.lights)


def _arrival(light: Light, surface: Surface, to_eye: bool) -> Arrival:
    """The light of one lamp, less what is hidden of it."""
    arrival = KINDS[type(light)].arriving(light, surface, to_eye)
    shown = occlusion(light, surface)
    if shown is None or arrival.received is None:
        return arrival
    return replace(arrival, received=arrival.received * shown)


def occlusion(light: Light, surface: Surface) -> Float32Array | None:
    """Share (n, k) of a light that nothing hides from points; None where that is all. Nothing hides yet."""
    return None


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


def _from_afar(light: Directional, surface: Surface, to_eye: bool) -> Arrival:
    towards = -light.direction
    nl = _cosine(surface, out=along(surface.normal, towards))
    vl = _to_eye(surface, out=along(surface.ray, towards)) if to_eye else None
    return Arrival(light.color, nl, vl, nl)


def _afar(light: Directional, middle: Middle) -> tuple[FloatArray, FloatArray]:
    return -light.direction.astype(np.float64)[:, None], np.zeros(1)


def _from_place(light: Point, surface: Surface, to_eye: bool) -> Arrival:
    position = surface.points.position
    assert position is not None
    offset = (light.position - surface.eye).astype(np.float32)[:, None, None] - position.astype(np.float32)
    towards = PointVectors(offset)
    nearness = np.reciprocal(np.maximum(products(towards, towards), _LEAST_DISTANCE2))
    offset *= np.sqrt(nearness)
    nl = _cosine(surface, out=products(surface.normal, towards))
    vl = _to_eye(surface, out=products(surface.ray, towards)) if to_eye else None
    return Arrival(light.color, nl, vl, nl * nearness)


def _place(light: Point, middle: Middle) -> tuple[FloatArray, FloatArray]:
    offset = (light.position - middle.place)[:, None] - middle.point
    over = np.asarray(1 / np.sqrt(sum_of_products(offset, offset) + 1e-300))
    turn = middle.reach * over
    return offset * over, np.where((1 - turn) > over * LEAST_DISTANCE, turn, np.inf)


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
    Directional: Kind(_from_afar, _afar),
    Point: Kind(_from_place, _place, placed=True),
    Headlight: Kind(_from_eye, _eye),
}
