"""What each channel holds: a function a channel, from scene, viewer and hits to values.

The schema of the channels is `quiltcli.channels`; a channel is a row there and one of `SOURCES` here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.channels import CHANNELS, MOST_HALF
from quiltcli.geometry import FloatArray
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import pixel_colors
from quiltcli.shading.nodes import NodeColors
from quiltcli.shading.shade import shading_normals, shading_wants
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.hits import Hits, Wanted

Values: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Source:
    """Where a channel's values come from.

    Attributes:
        values: from scene, viewer and hits to an array for each layer, (G, k), (G, 1) where a group's
            pixels all have one value, or (1, 1) where all have, of any float or integer type.
        wanted: what of the hits that takes beside triangle and depth.
    """

    values: Callable[[Scene, Viewer, Hits], Values | Sequence[Values]]
    wanted: Callable[[Scene], Wanted] = lambda _: Wanted.NOTHING


def canonical_depth(viewer: Viewer, z: FloatArray) -> FloatArray:
    """Depth in the viewer camera's canonical space, −1 at near to 1 at far (Harish & Narayanan, eq. 4)."""
    near, far = viewer.near, viewer.far
    return np.asarray((far + near) / (far - near) - 2 * far * near / ((far - near) * z))


def _rgba(scene: Scene, viewer: Viewer, hits: Hits, known: NodeColors | None = None) -> Sequence[Values]:
    if known is None:
        colors = list(map(half_floats, pixel_colors(scene, viewer.eye, hits)))
    else:
        colors = _halves_between(known)
    return *colors * (3 // len(colors)), np.ones((1, 1), dtype=np.float16)


def _depth(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.depth[None]


def _canonical_depth(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return canonical_depth(viewer, hits.depth)[None]


def _facet(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.facet[None, :, None] + 1


def _object(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return scene.object.take(hits.triangle)[None, :, None] + 1


def _triangle(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.triangle[None, :, None] + 1


def _normal(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return shading_normals(hits)


def _point(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    assert hits.position is not None
    return hits.position + viewer.eye[:, None, None]


_SCALE = 2.0**-112
_MOST_SCALED = MOST_HALF * np.float32(_SCALE)

# Depths are measured in double precision and rounded once.
SOURCES: dict[str, Source] = {
    "rgba": Source(_rgba, shading_wants),
    "Z": Source(_depth),
    "zv": Source(_canonical_depth),
    "facet": Source(_facet),
    "object": Source(_object),
    "triangle": Source(_triangle),
    "N": Source(_normal, lambda _: Wanted.NORMAL),
    "P": Source(_point, lambda _: Wanted.POSITION),
}


def wanted_for(names: Iterable[str], scene: Scene) -> Wanted:
    """What the hits have to tell for these channels."""
    wanted = Wanted.NOTHING
    for name in names:
        wanted |= SOURCES[name].wanted(scene)
    return wanted


def fill(
    buffers: Mapping[str, Values],
    names: Iterable[str],
    scene: Scene,
    viewer: Viewer,
    hits: Hits,
    colors: NodeColors | None = None,
) -> None:
    """Write the channels `names` of all hits into flat `buffers`, at the pixels the hits belong to.

    `colors` are those at the nodes, where they are known.
    """
    for name in names:
        values = (
            _rgba(scene, viewer, hits, colors)
            if name == "rgba"
            else SOURCES[name].values(scene, viewer, hits)
        )
        for layer, layer_values in zip(CHANNELS[name].layers, values, strict=True):
            hits.put(buffers[layer], layer_values)


def half_floats(values: NDArray[np.float32]) -> NDArray[np.float16]:
    """Numbers from 0 on rounded to half floats, what lies in the middle upward, and none to infinity.

    A product with 2⁻¹¹² has the exponent of a half float, small ones denormal as theirs are; then the
    bits that a half float lacks are rounded away. `astype` would take five times as long.
    """
    scaled = values * np.float32(_SCALE)
    return _rounded(np.minimum(scaled, _MOST_SCALED, out=scaled))


def _halves_between(colors: NodeColors) -> list[NDArray[np.float16]]:
    """As `half_floats` of its pixels: there are fewer nodes than pixels to be scaled and limited."""
    scaled = colors.pixels(_SCALE)
    if colors.most > MOST_HALF:
        for values in scaled:
            np.minimum(values, _MOST_SCALED, out=values)
    return list(map(_rounded, scaled))


def _rounded(scaled: NDArray[np.float32]) -> NDArray[np.float16]:
    """Half floats of numbers that have their exponents; `scaled` is used up."""
    bits = scaled.view(np.uint32)
    bits += np.uint32(0x1000)
    bits >>= np.uint32(13)
    return bits.astype(np.uint16).view(np.float16)
