"""Shadows: what share of a lamp's light reaches points, by rays that end at the first thing in their way.

From a point a ray goes to a lamp without size, several to one that has a size: to the same places on it
from all pixels, so that nothing flickers and no seam shows. Where pixels have several samples, the places
are shared out among these. What is behind the horizon of a point is not asked about.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from quiltcli.geometry import BoolArray, Float32Array, FloatArray, IntArray, cross, normalized
from quiltcli.scene.environment.panorama import cell_directions, cell_sizes
from quiltcli.scene.lights import (
    Ambient,
    Area,
    Directional,
    Environment,
    Everywhere,
    Light,
    Point,
    Spot,
)
from quiltcli.scene.scene import Scene
from quiltcli.shading.dimmed import let_through
from quiltcli.shading.surface import Surface
from quiltcli.visibility.rays.blockers import Blockers, blockers_of
from quiltcli.visibility.resolve.vectors import PointVectors, sum_of_products, vector_values

_SHORT_OF = 1 - 2.0**-12
"""Where a ray to a lamp ends, of the way to it: what touches the lamp hides nothing."""
_AFAR = 1e30
_FINDS = 16


@dataclass(frozen=True)
class Sample:
    """Which of a pixel's samples is shaded: number `number` of `count`."""

    number: int = 0
    count: int = 1


CENTRE = Sample()
"""The only one of a pixel."""


@dataclass(frozen=True)
class Shadows:
    """What shadows fall on surfaces.

    Attributes:
        scene: the scene.
        surface: n groups of k points, of which positions and weights are known.
        sample: the sample they are.
    """

    scene: Scene
    surface: Surface
    sample: Sample

    def shown(self, light: Light, wanted: BoolArray) -> Float32Array:
        """Share (n, k) of a lamp that points see, asked where it is wanted, (n, k) or (n, 1); 1 elsewhere."""
        assert self.surface.points.position is not None
        shape = self.surface.points.position.shape[1:]
        wanted = np.broadcast_to(wanted, shape)
        rows = np.flatnonzero(wanted.any(axis=1))
        share = np.ones(shape, dtype=np.float32)
        if rows.size:
            chosen = np.flatnonzero(wanted[rows])
            some = share[rows].reshape(-1)
            some[chosen] = _SHOWN[type(light)](light, self._starts(rows, chosen), self)
            share[rows] = some.reshape(-1, shape[1])
        return share

    @cached_property
    def blockers(self) -> Blockers:
        """What may be in the way."""
        return blockers_of(self.scene)

    def open(self, places: FloatArray, way: FloatArray | Float32Array, far: float) -> Float32Array:
        """The share (C,) of light that rays bring; see `dimmed.let_through`."""
        return let_through(self.scene, self.blockers, places, way.astype(np.float32, copy=False), far)

    def _starts(self, rows: IntArray, chosen: IntArray) -> Starts:
        """Where rays from chosen points of some groups (R,) start: above the surface, on the eye's side."""
        points, blockers = self.surface.points, self.blockers
        assert points.position is not None
        triangle, position = points.triangle[rows, 0], points.position[:, rows]
        table = self.scene.corner_normals.take(triangle, axis=0)
        normal = table[:, 9:12].T[:, :, None]
        ray = self.surface.ray
        # Where every point has an eye of its own, as on a spinning mirror, its ray says what side that is on.
        seen = ray[rows].values if isinstance(ray, PointVectors) else position
        side = -np.sign(sum_of_products(normal, seen[:, :, :1].astype(np.float64)))
        places = position + (self.surface.eye - blockers.middle)[:, None, None]
        places += normal * (side * blockers.above.take(triangle)[:, None])
        bent = np.flatnonzero(blockers.bent.take(triangle))
        if bent.size:
            every = bent.size == rows.size
            some = slice(None) if every else bent
            places[:, some] += self._lifted(rows[some], table[some], side[some].astype(np.float32))
        directions = vector_values(self.surface.normal)
        if directions.shape[1] > 1:
            directions = directions[:, rows]
        directions = np.broadcast_to(directions, places.shape)
        return Starts(
            places.reshape(3, -1).take(chosen, axis=1), directions.reshape(3, -1).take(chosen, axis=1)
        )

    def _lifted(self, rows: IntArray, table: Float32Array, side: Float32Array) -> Float32Array:
        """From points of groups (R,), each on one triangle, to what its corners' normals bend it to.

        A point is moved onto the planes through the corners at right angles to their normals, where it
        lies below them, by as much as each corner counts: the border of light on a smooth body is as
        smooth as its normals say (Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II, 2021).
        """
        points, scene = self.surface.points, self.scene
        assert points.position is not None
        assert points.weights is not None
        corners = scene.triangles.take(points.triangle[rows, 0], axis=0)
        second, third = points.weights[0][rows], points.weights[1][rows]
        normals = table[:, 0:3], table[:, 0:3] + table[:, 3:6], table[:, 0:3] + table[:, 6:9]
        position = points.position[:, rows].astype(np.float32)
        result = np.zeros_like(position)
        for k, weight in enumerate((1 - second - third, second, third)):
            corner = (scene.vertices.take(corners[:, k], axis=0) - self.surface.eye).astype(np.float32)
            turned = np.ascontiguousarray(normals[k].T)[:, :, None] * side
            below = sum_of_products(position - np.ascontiguousarray(corner.T)[:, :, None], turned)
            np.minimum(below, 0, out=below)
            below *= weight
            result -= turned * below
        return result


@dataclass(frozen=True)
class Starts:
    """Where rays from C points start.

    Attributes:
        places: (3, C) minus the middle of the blockers, metres.
        normals: (3, C) normals there, of any length.
    """

    places: FloatArray
    normals: Float32Array

    def __getitem__(self, rows: IntArray) -> Starts:
        """Some of them."""
        return Starts(self.places[:, rows], self.normals[:, rows])

    def way_to(self, place: FloatArray | Float32Array, shadows: Shadows) -> Float32Array:
        """From there to a place (3,) in the world."""
        way = (place - shadows.blockers.middle)[:, None] - self.places
        return way.astype(np.float32)


def _directional(light: Directional, starts: Starts, shadows: Shadows) -> Float32Array:
    return shadows.open(starts.places, -light.direction[:, None], _AFAR)


def _point(light: Point, starts: Starts, shadows: Shadows) -> Float32Array:
    return shadows.open(starts.places, starts.way_to(light.position, shadows), _SHORT_OF)


def _area(light: Area, starts: Starts, shadows: Shadows) -> Float32Array:
    """Of the light of all places that are above the horizon, that of those which are seen."""
    few, many = _blocks(light.rays, shadows.sample)
    shines = normalized(cross(light.across, light.along)).astype(np.float32)[:, None]
    seen, all_of_it = np.zeros((2, starts.places.shape[1]), dtype=np.float32)
    rows = np.arange(seen.size)
    for number, (s, t) in enumerate(places(many, shadows.sample)):
        if number == few:
            # Half-shadow: where the first places are neither all seen nor all hidden.
            rows = np.flatnonzero((seen > 0) & (seen < all_of_it))
            if not rows.size:
                break
            starts = starts[rows]
        way = starts.way_to(light.position + s * light.across + t * light.along, shadows)
        length2 = sum_of_products(way, way)
        light_of_it = np.maximum(sum_of_products(starts.normals, way), 0)
        light_of_it *= np.maximum(-sum_of_products(way, shines), 0)
        light_of_it /= np.maximum(length2 * length2, np.float32(1e-12))
        all_of_it[rows] += light_of_it
        seen[rows] += shadows.open(starts.places, way, _SHORT_OF) * light_of_it
    result: Float32Array = np.divide(seen, all_of_it, out=np.ones_like(seen), where=all_of_it > 0)
    return result


def _everywhere(light: Everywhere, starts: Starts, shadows: Shadows) -> Float32Array:
    """Of the light from directions above the horizon, that from those in which nothing stands near."""
    count = 1 << max(-(-light.rays // shadows.sample.count) - 1, 0).bit_length()
    seen, all_of_it = np.zeros((2, starts.places.shape[1]), dtype=np.float32)
    far = min(light.distance, _AFAR)
    for way, weight in zip(*_directions_of(light, count, shadows.sample), strict=True):
        light_of_it = sum_of_products(starts.normals, way)
        rows = np.flatnonzero(light_of_it > 0)
        if not rows.size:
            continue
        light_of_it = light_of_it[rows] * weight
        all_of_it[rows] += light_of_it
        seen[rows] += shadows.open(starts.places[:, rows], way[:, None], far) * light_of_it
    result: Float32Array = np.divide(seen, all_of_it, out=np.ones_like(seen), where=all_of_it > 0)
    return result


@lru_cache(maxsize=64)
def _directions_of(light: Everywhere, count: int, sample: Sample) -> tuple[Float32Array, Float32Array]:
    """Directions (count, 3) in the world for one of a pixel's samples, and what light from each counts.

    The same for all pixels. Half of them are spread evenly, half towards what is bright.
    """
    across, down = (np.array(places(count, sample)).T + 1) / 2
    height = 2 * down - 1
    if not isinstance(light, Environment):
        turn = 2 * np.pi * across
        flat = np.sqrt(1 - height * height)
        ways = np.stack((flat * np.sin(turn), height, flat * np.cos(turn)), axis=1)
        return ways.astype(np.float32), np.ones(count, dtype=np.float32)
    cells = light.maps.cells.astype(np.float64).mean(axis=2)
    columns = cells.shape[1]
    size = np.repeat(cell_sizes(columns), columns).reshape(cells.shape)
    bright = cells * size
    chance = size / size.sum() + (bright / bright.sum() if bright.sum() > 0 else 0)
    chance /= chance.sum()
    row = _found(chance.sum(axis=1), down)
    column = np.array([_found(chance[r], a) for r, a in zip(row, across, strict=True)])
    ways = cell_directions(columns)[row, column] @ light.maps.turn.T
    weight = (cells * size / chance)[row, column]
    return ways.astype(np.float32), np.maximum(weight, 1e-12).astype(np.float32)


def _found(chance: FloatArray, place: FloatArray | float) -> Any:
    """Which of some things with these chances lies at places from 0 to 1."""
    total = np.cumsum(chance)
    return np.minimum(np.searchsorted(total, np.asarray(place) * total[-1], side="right"), chance.size - 1)


def _blocks(rays: int, sample: Sample) -> tuple[int, int]:
    """How many places a sample looks for at first, and at most: powers of two.

    More only where the first are enough to find half-shadow, and no other samples make up for them.
    """
    few = 1 << max(-(-rays // sample.count) - 1, 0).bit_length()
    return few, few * 4 if few >= _FINDS and sample.count == 1 else few


@lru_cache(maxsize=64)
def places(count: int, sample: Sample) -> tuple[tuple[float, float], ...]:
    """Places in the square −1 … 1 for one of a pixel's samples, `count` of a power of two.

    They are a run of the sequence of Sobol in two dimensions, whose every part of a power of two is spread
    evenly: that of each sample, and all of them together.
    """
    first, total = count * sample.number, count * sample.count
    half = 0.5 / (1 << (total - 1).bit_length())
    return tuple(
        (2 * (_mirrored(number, _CORPUT) + half) - 1, 2 * (_mirrored(number, _SOBOL) + half) - 1)
        for number in range(first, first + count)
    )


_BITS = 32
_CORPUT = tuple(1 << (_BITS - 1 - k) for k in range(_BITS))


def _directions() -> tuple[int, ...]:
    """Direction numbers of the second dimension (Sobol 1967): each the one before, and that shifted."""
    found = [1 << (_BITS - 1)]
    for _ in range(_BITS - 1):
        found.append(found[-1] ^ (found[-1] >> 1))
    return tuple(found)


_SOBOL = _directions()


def _mirrored(number: int, directions: tuple[int, ...]) -> float:
    """A number's bits, each for its direction, as a fraction of 1."""
    result = 0
    for k, direction in enumerate(directions):
        if number >> k & 1:
            result ^= direction
    return float(result * 2.0**-_BITS)


_SHOWN: dict[type[Light], Callable[[Any, Starts, Shadows], Float32Array]] = {
    Directional: _directional,
    Point: _point,
    Spot: _point,
    Area: _area,
    Ambient: _everywhere,
    Environment: _everywhere,
}


def casts(light: Light) -> bool:
    """Whether a light casts shadows."""
    return light.shadows and type(light) in _SHOWN
