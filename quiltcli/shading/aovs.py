"""What each channel holds: a function a channel, from scene, viewer and hits to values.

The schema of the channels is `quiltcli.channels`; a channel is a row there and one of `SOURCES` here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from operator import or_
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS, MOST_HALF
from quiltcli.geometry import FloatArray, IntArray
from quiltcli.projection.gaze import Gaze
from quiltcli.scene import Scene
from quiltcli.scene.textures.coordinates import corner_coordinates
from quiltcli.shading.adaptive import Shaded, shaded
from quiltcli.shading.materials import albedo_wants
from quiltcli.shading.mattes import identities_of
from quiltcli.shading.motion import motion, motion_wants
from quiltcli.shading.nodes import NodeColors
from quiltcli.shading.shade import Shades, shading_wants
from quiltcli.shading.shadows import CENTRE, Sample
from quiltcli.shading.surface import shading_normals
from quiltcli.shading.textures.covers import UNLIT
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Drawing, Wanted

Values: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Source:
    """Where a channel's values come from.

    Attributes:
        values: from gaze and shaded hits to an array for each layer, (G, k), (G, 1) where a group's
            pixels all have one value, or (1, 1) where all have, of any float or integer type.
        wanted: what of the hits that takes beside triangle and depth.
        light: whether it is light, which is known at few points where it is smooth.
    """

    values: Callable[[Gaze, Shaded], Values | Sequence[Values]]
    wanted: Callable[[Scene], Wanted] = lambda _: Wanted.NOTHING
    light: bool = False


def canonical_depth(viewer: Viewer, z: FloatArray) -> FloatArray:
    """Depth in the viewer camera's canonical space, −1 at near to 1 at far (Harish & Narayanan, eq. 4)."""
    near, far = viewer.near, viewer.far
    return np.asarray((far + near) / (far - near) - 2 * far * near / ((far - near) * z))


def _rgba(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    return *_halves(shaded.total), np.ones((1, 1), dtype=np.float16)


def _depth(gaze: Gaze, shaded: Shaded) -> Values:
    return shaded.hits.depth[None]


def _canonical_depth(gaze: Gaze, shaded: Shaded) -> Values:
    return canonical_depth(gaze.viewer, shaded.hits.depth)[None]


def _facet(gaze: Gaze, shaded: Shaded) -> Values:
    return shaded.hits.facet[None, :, None] + 1


def _object(gaze: Gaze, shaded: Shaded) -> Values:
    return shaded.scene.object.take(shaded.hits.triangle)[None, :, None] + 1


def _triangle(gaze: Gaze, shaded: Shaded) -> Values:
    return shaded.hits.triangle[None, :, None] + 1


def _normal(gaze: Gaze, shaded: Shaded) -> Values:
    return shading_normals(shaded.points)


def _point(gaze: Gaze, shaded: Shaded) -> Values:
    assert shaded.hits.position is not None
    return shaded.hits.position + gaze.viewer.eye[:, None, None]


def _albedo(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    return _halves(shaded.albedo)


def _texture_place(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    """Texture coordinates of the first set, v up."""
    seen = shaded.hits.points
    assert seen.weights is not None
    corners = corner_coordinates(shaded.scene, seen.triangle[:, 0], 0)[..., None]
    second, third = (corners[:, k] - corners[:, 0] for k in (1, 2))
    return tuple(corners[:, 0] + second * seen.weights[0] + third * seen.weights[1])


def _diffuse(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    return _halves(shaded.apart.diffuse)


def _specular(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    return _halves(shaded.apart.specular)


def _emission(gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    return _halves(shaded.emission if shaded.cover == UNLIT else shaded.apart.emission)


def normal_wants(scene: Scene) -> Wanted:
    """What shading normals ask of hits; normal maps bend them."""
    return Wanted.NORMAL if scene.textures is None else Wanted.NORMAL | Wanted.EDGES


def _matte(channel: str, gaze: Gaze, shaded: Shaded) -> Sequence[Values]:
    """Of one sample: the first rank covers all of the pixel."""
    identity = identities_of(shaded.scene, channel, shaded.hits.triangle).view(np.float32)
    rest = np.zeros((1, 1), dtype=np.float32)
    return identity[:, None], rest + 1, *(rest,) * (len(CHANNELS[channel].layers) - 2)


# Depths are measured in double precision and rounded once.
SOURCES: dict[str, Source] = {
    "rgba": Source(_rgba, shading_wants, light=True),
    "Z": Source(_depth),
    "zv": Source(_canonical_depth),
    "facet": Source(_facet),
    "object": Source(_object),
    "triangle": Source(_triangle),
    "N": Source(_normal, normal_wants),
    "P": Source(_point, lambda _: Wanted.POSITION),
    "uv": Source(_texture_place, lambda _: Wanted.WEIGHTS),
    "albedo": Source(_albedo, albedo_wants),
    "diffuse": Source(_diffuse, shading_wants, light=True),
    "specular": Source(_specular, shading_wants, light=True),
    "emission": Source(_emission, shading_wants, light=True),
    "motion": Source(motion, motion_wants),
    "cryptoobject": Source(partial(_matte, "cryptoobject")),
    "cryptomaterial": Source(partial(_matte, "cryptomaterial")),
}


def light_at_points(name: str, shaded: Shaded) -> Shades:
    """Red, green and blue of a channel that is light, at points: (n, k), (n, 1) or (1, 1), float32."""
    if name == "rgba":
        found = shaded.pixels()
    elif name == "albedo":
        found = shaded.albedo
    else:
        light = getattr(shaded.apart, name)
        found = tuple(light.pixels()) if isinstance(light, NodeColors) else light
    return found * (3 // len(found))


def wanted_for(names: Iterable[str], scene: Scene) -> Wanted:
    """What the hits have to tell for these channels."""
    return reduce(or_, (SOURCES[name].wanted(scene) for name in names), Wanted.NOTHING)


def shaded_for(
    names: Iterable[str],
    drawing: Drawing,
    wanted: Wanted,
    scene: Scene,
    eye: FloatArray,
    sample: Sample = CENTRE,
) -> Iterator[Shaded]:
    """All that is seen of a drawing, as these channels are made of it fastest.

    Args:
        names: the channels.
        drawing: a batch that is drawn.
        wanted: what the hits shall tell, `wanted_for` the channels at least.
        scene: what was drawn.
        eye: (3,) from where it is seen.
        sample: which sample of its pixels was drawn.
    """
    if any(SOURCES[name].light for name in names):
        return shaded(drawing.regions(wanted, scene), scene, eye, sample)
    return (Shaded(scene, eye, hits) for hits in drawing.hits(wanted, scene))


def fill(
    buffers: Mapping[str, Values],
    names: Iterable[str],
    gaze: Gaze,
    shaded: Shaded,
    some: IntArray | None = None,
) -> None:
    """Write the channels `names` of all hits, or of some, into flat `buffers`, at the hits' pixels."""
    for name in names:
        values_of = SOURCES[name].values
        for layer, values in zip(CHANNELS[name].layers, values_of(gaze, shaded), strict=True):
            shaded.hits.put(buffers[layer], values, some)


_SCALE = 2.0**-112
_MOST_SCALED = MOST_HALF * np.float32(_SCALE)


def _halves(light: NodeColors | Shades) -> list[NDArray[np.float16]]:
    """Red, green and blue of all pixels as half floats, of light at nodes or at the pixels themselves."""
    colors = _halves_between(light) if isinstance(light, NodeColors) else list(map(half_floats, light))
    return colors * (3 // len(colors))


def half_floats(values: NDArray[np.float32]) -> NDArray[np.float16]:
    """Numbers from 0 on rounded to half floats, what lies in the middle upward, and none to infinity.

    A product with 2⁻¹¹² has the exponent of a half float, small ones denormal as theirs are; then the
    bits that a half float lacks are rounded away. `astype` would take five times as long.
    """
    scaled = values * np.float32(_SCALE)
    return _rounded(out=np.minimum(scaled, _MOST_SCALED, out=scaled))


def _halves_between(colors: NodeColors) -> list[NDArray[np.float16]]:
    """As `half_floats` of its pixels: there are fewer nodes than pixels to be scaled and limited."""
    scaled = colors.pixels(_SCALE)
    if colors.most > MOST_HALF:
        for values in scaled:
            np.minimum(values, _MOST_SCALED, out=values)
    return [_rounded(out=values) for values in scaled]


def _rounded(out: NDArray[np.float32]) -> NDArray[np.float16]:
    """Half floats of numbers that have their exponents; these make way for bits."""
    bits = out.view(np.uint32)
    bits += np.uint32(0x1000)
    bits >>= np.uint32(13)
    return bits.astype(np.uint16).view(np.float16)
