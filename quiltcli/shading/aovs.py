"""Channels: what can be written for each visible pixel, one row of a table each.

To add a channel, add a row to `CHANNELS` and its name to the job's list of channels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import FloatArray
from quiltcli.scene import Scene
from quiltcli.shading.adaptive import pixel_colors
from quiltcli.shading.nodes import NodeColors
from quiltcli.shading.shade import MOST_HALF, shading_normals, shading_wants
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.resolve.hits import Hits, Wanted

Values: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Channel:
    """One job channel.

    Attributes:
        layers: names of its EXR channels.
        dtype: their pixel type.
        empty: value of a pixel that sees nothing.
        values: from scene, viewer and hits to an array for each layer, (G, k), (G, 1) where a group's
            pixels all have one value, or (1, 1) where all have, of any float or integer type.
        wanted: what of the hits that takes beside triangle and depth.
    """

    layers: tuple[str, ...]
    dtype: np.dtype[Any]
    empty: float
    values: Callable[[Scene, Viewer, Hits], Values | Sequence[Values]]
    wanted: Callable[[Scene], Wanted] = lambda _: Wanted()


def canonical_depth(viewer: Viewer, z: FloatArray) -> FloatArray:
    """Depth in the viewer camera's canonical space, −1 at near to 1 at far (Harish & Narayanan, eq. 4)."""
    near, far = viewer.near, viewer.far
    return np.asarray((far + near) / (far - near) - 2 * far * near / ((far - near) * z))


def _rgba(scene: Scene, viewer: Viewer, hits: Hits) -> Sequence[Values]:
    if hits.colors is None:
        colors = list(map(half_floats, pixel_colors(scene, viewer.eye, hits)))
    else:
        colors = _halves_between(hits.colors)
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
_HALF, _FLOAT, _UINT = np.dtype(np.float16), np.dtype(np.float32), np.dtype(np.uint32)

# Depths are measured in double precision and rounded once. A pixel that sees nothing is infinitely
# far in `zv` as well as in `Z`, so that it cannot be taken for one on the far plane, where zv is 1.
CHANNELS: dict[str, Channel] = {
    "rgba": Channel(("R", "G", "B", "A"), _HALF, 0.0, _rgba, shading_wants),
    "Z": Channel(("Z",), _FLOAT, np.inf, _depth),
    "zv": Channel(("zv",), _FLOAT, np.inf, _canonical_depth),
    "facet": Channel(("facet",), _UINT, 0.0, _facet),
    "object": Channel(("object",), _UINT, 0.0, _object),
    "triangle": Channel(("triangle",), _UINT, 0.0, _triangle),
    "N": Channel(
        ("N.X", "N.Y", "N.Z"), _HALF, 0.0, _normal, lambda scene: Wanted(normals=scene.corner_normals)
    ),
    "P": Channel(("P.X", "P.Y", "P.Z"), _FLOAT, 0.0, _point, lambda _: Wanted(position=True)),
}


def exr_channels(names: Iterable[str]) -> dict[str, tuple[np.dtype[Any], float]]:
    """Pixel type and empty value of every EXR channel that the job channels `names` bring, in order."""
    rows = [CHANNELS[name] for name in names]
    return {layer: (row.dtype, row.empty) for row in rows for layer in row.layers}


def empty_buffers(names: Iterable[str], pixels: int) -> dict[str, Values]:
    """A flat buffer (pixels,) for every EXR channel, in which nothing is seen yet."""
    return {layer: np.full(pixels, empty, dtype) for layer, (dtype, empty) in exr_channels(names).items()}


def wanted_for(names: Iterable[str], scene: Scene) -> Wanted:
    """What the hits have to tell for these channels."""
    each = [CHANNELS[name].wanted(scene) for name in names]
    return Wanted(
        normals=next((one.normals for one in each if one.normals is not None), None),
        weights=any(one.weights for one in each),
        position=any(one.position for one in each),
    )


def fill(
    buffers: Mapping[str, Values], names: Iterable[str], scene: Scene, viewer: Viewer, hits: Hits
) -> None:
    """Write the channels `names` of all hits into flat `buffers`, at the pixels the hits belong to."""
    for name in names:
        row = CHANNELS[name]
        for layer, values in zip(row.layers, row.values(scene, viewer, hits), strict=True):
            hits.put(buffers[layer], values)


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
