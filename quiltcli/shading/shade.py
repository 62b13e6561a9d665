"""Shading: the light that leaves each visible point towards the eye.

    surface → material → lights → sum

`surface` says how a point lies to the eye, `materials` and `brdf` what it is made of and how that reflects,
`lights` what arrives there, `shadows` what of that is hidden. Light is not passed on from surface to surface.
Every sum is written out in a fixed order of single-precision operations, so a pixel's value depends
neither on the machine nor on which other pixels are shaded with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene import Light as Lamp
from quiltcli.scene import Scene
from quiltcli.shading.brdf import Layer, Lobes, glints, layer_of, let_in_and_out, lobes_at
from quiltcli.shading.environment import from_around, reflected_share
from quiltcli.shading.lights import Arrival, arrivals, asks_for_places, casting, is_grey
from quiltcli.shading.materials import Colors, Values, albedo_wants, lit_at
from quiltcli.shading.rectangle import mirrored_share
from quiltcli.shading.shadows import Sample, Shadows
from quiltcli.shading.surface import Surface
from quiltcli.visibility.resolve.hits import Points, Wanted

Shades = tuple[Float32Array, ...]
"""Red, green and blue, or one array for all three, (n, k), or (n, 1) or (1, k) where others agree."""


Kind = TypeVar("Kind")


@dataclass(frozen=True)
class Light(Generic[Kind]):
    """Light that leaves points towards the eye, by how it came about.

    All of it is albedo · diffuse + specular + emission, with the base colour of `materials.albedo_at`: so
    a colour that varies is multiplied in point by point, and light may be known at few.

    Attributes:
        diffuse: what a white base returns.
        specular: what is reflected by the layer above it.
        emission: what needs no lamp.
        around: that part of `diffuse` which comes from everywhere, where textures say how much of it arrives;
            None where none do.
    """

    diffuse: Kind
    specular: Kind
    emission: Kind
    around: Kind | None = None


def shading_wants(scene: Scene) -> Wanted:
    """What shading asks of hits."""
    wanted = Wanted.NORMAL | albedo_wants(scene)
    if casting(scene):
        wanted |= Wanted.POSITION | Wanted.WEIGHTS
    return wanted | Wanted.POSITION if asks_for_places(scene) else wanted


@dataclass(frozen=True)
class Lamps:
    """Some of a scene's light: that of some lamps, and what needs none.

    Attributes:
        lights: the lamps.
        emits: whether what surfaces give off by themselves is part of it.
        sample: the sample of a pixel that points are, for shadows; None where nothing is hidden.
    """

    lights: Sequence[Lamp]
    emits: bool = True
    sample: Sample | None = None

    def shadows(self, scene: Scene, surface: Surface) -> Shadows | None:
        """What is hidden of the lamps at surfaces."""
        return None if self.sample is None else Shadows(scene, surface, self.sample)


def all_lamps(scene: Scene, sample: Sample | None = None) -> Lamps:
    """All light of a scene, shadows in it."""
    return Lamps(scene.lights, sample=sample or Sample())


def shade(scene: Scene, eye: FloatArray, seen: Points, lamps: Lamps | None = None) -> Shades:
    """All light of points, linear, summed up lamp by lamp.

    Of what is grey at all points there is one array, not three.

    Args:
        scene: the scene.
        eye: (3,) world metres.
        seen: n groups of k visible points, with what `shading_wants` asks for.
        lamps: of which of the scene's light; of all by default.
    """
    lamps = lamps or all_lamps(scene)
    surface, lobes = Surface(seen, eye), lobes_at(scene, seen)
    base, total = lobes.base, list(lobes.emission) if lamps.emits else _nothing(3)
    if _is_grey(base) and _is_grey(total) and all(map(is_grey, lamps.lights)):
        base, total = base[:1], total[:1]
    layer = layer_of(surface, lobes, base)
    shadows = lamps.shadows(scene, surface)
    for arrival in arrivals(lamps.lights, surface, shadows, to_eye=layer is not None):
        for k, part, glint in _reflected(surface, lobes, base, layer, arrival):
            if glint is not None:
                part = np.add(part, glint, out=_into(part, glint))
            total[k] = np.add(part, total[k], out=_into(part, total[k]))
    return filled(total, seen)


def shade_apart(scene: Scene, eye: FloatArray, seen: Points, lamps: Lamps | None = None) -> Light[Shades]:
    """The light of points, kept apart by how it came about; for the arguments see `shade`.

    The colour of the base is left out of diffuse light: what is left is smooth where light is, however
    the colour varies.
    """
    lamps = lamps or all_lamps(scene)
    surface, lobes = Surface(seen, eye), lobes_at(scene, seen)
    grey = all(map(is_grey, lamps.lights))
    base = lobes.base
    if grey and (_is_grey(base) or not np.any(lobes.metallic)):
        base = base[:1]
    layer = layer_of(surface, lobes, base)
    white = (lit_at(scene, seen),) * len(base)
    bare = replace(lobes, paint=white, tint=None)
    diffuse, specular, around = (_nothing(len(base)) for _ in range(3))
    shadows = lamps.shadows(scene, surface)
    for arrival in arrivals(lamps.lights, surface, shadows, to_eye=layer is not None):
        for k, part, glint in _reflected(surface, bare, white, layer, arrival):
            diffuse[k] = diffuse[k] + part
            if arrival.nl is None:
                around[k] = around[k] + part
            if glint is not None:
                specular[k] = specular[k] + glint
    occluded = scene.textures is not None and "occlusion" in scene.textures.slots
    return Light(
        filled(diffuse, seen),
        filled(specular, seen),
        filled(lobes.emission if lamps.emits else _nothing(3), seen),
        filled(around, seen) if occluded else None,
    )


def _reflected(
    surface: Surface, lobes: Lobes, base: Colors, layer: Layer | None, arrival: Arrival
) -> Iterator[tuple[int, Values, Float32Array | None]]:
    """What one lamp sends to the eye by way of each point.

    Yields:
        for each colour its number, what the base returns, and what the layer above it reflects. The former
        is nobody else's.
    """
    if arrival.around is not None:
        for k, part, glint in from_around(arrival.around, surface, lobes, base, layer):
            yield k, part if lobes.open is None else part * lobes.open, glint
        return
    # From everywhere: what is the same at all points of a group first.
    if arrival.nl is None or arrival.received is None:
        for k in range(len(base)):
            part = lobes.paint[k] * arrival.color[k]
            part = part if lobes.tint is None else part * lobes.tint[k]
            part = part if arrival.shown is None else part * arrival.shown
            yield k, part if lobes.open is None else part * lobes.open, None
        return
    received: Float32Array = arrival.received
    reflected: tuple[Float32Array | None, ...] = (None,) * len(base)
    if layer is not None:
        reflected = _glints(surface, layer, arrival, received)
        received = let_in_and_out(layer, arrival.nl, received)
    for k, glint in enumerate(reflected):
        yield k, received * (arrival.color[k] * base[k] * lobes.diffuse), glint


def _glints(
    surface: Surface, layer: Layer, arrival: Arrival, received: Float32Array
) -> tuple[Float32Array, ...]:
    """What a layer reflects of a lamp."""
    assert arrival.nl is not None
    if arrival.size is None:
        assert arrival.vl is not None
        return glints(layer, arrival.nl, arrival.vl, received, arrival.color, out=arrival.vl)
    share = mirrored_share(arrival.size, surface, np.sqrt(np.asarray(layer.alpha2, dtype=np.float64)))
    share = np.where(received > 0, share, np.float32(0))
    if arrival.shown is not None:
        share *= arrival.shown
    single = reflected_share(layer)
    return tuple(share * (part * arrival.color[k]) for k, part in enumerate(single))


def _into(part: Values, other: Values) -> Float32Array | None:
    """The memory of `part` for its sum with another, if that has room there."""
    return part if isinstance(part, np.ndarray) and part.size >= np.size(other) else None


def _is_grey(color: Sequence[Values] | Float32Array) -> bool:
    """Whether three values are one number."""
    red = color[0]
    return all(isinstance(value, np.float32) and value == red for value in color)


def filled(values: Iterable[Values], seen: Points) -> Shades:
    """Numbers as arrays that stand for all points."""
    shape = seen.triangle.shape
    return tuple(np.full(shape, v) if isinstance(v, np.float32) else v for v in values)


def _nothing(count: int) -> list[Values]:
    return [np.float32(0)] * count
