"""Channels: what can be written for each visible pixel, one row of a table each.

To add a channel, add a row to `CHANNELS` and its name to the job's list of channels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import FloatArray
from quiltcli.raster.hits import Hits
from quiltcli.scene import Scene
from quiltcli.shading import MOST_HALF, shade, shading_normals
from quiltcli.viewer import Viewer

Values: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Channel:
    """One job channel.

    Attributes:
        layers: names of its EXR channels.
        dtype: their pixel type.
        empty: value of a pixel that sees nothing.
        values: from scene, viewer and hits to (layers, k, G), or (layers, 1, G) where a group's
            pixels all have one value, of any float or integer type.
    """

    layers: tuple[str, ...]
    dtype: np.dtype[Any]
    empty: float
    values: Callable[[Scene, Viewer, Hits], Values]


def depth(viewer: Viewer, position: FloatArray) -> FloatArray:
    """Depth (k, G) float64 of points (3, k, G) given relative to the eye, metres.

    Along the look direction, or the distance from the eye where the viewer's depth is `radial`.
    """
    x, y, z = position
    if viewer.depth == "radial":
        return np.asarray(np.sqrt(x * x + y * y + z * z))
    return np.asarray(x * viewer.look[0] + y * viewer.look[1] + z * viewer.look[2])


def canonical_depth(viewer: Viewer, z: FloatArray) -> FloatArray:
    """Depth in the viewer camera's canonical space, −1 at near to 1 at far (Harish & Narayanan, eq. 4)."""
    near, far = viewer.near, viewer.far
    return np.asarray((far + near) / (far - near) - 2 * far * near / ((far - near) * z))


def _rgba(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    rgba = np.ones((4, *hits.pixel.shape), dtype=np.float32)
    np.minimum(shade(scene, viewer.eye, hits), MOST_HALF, out=rgba[:3])
    return rgba


def _depth(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return depth(viewer, hits.position)[None]


def _canonical_depth(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return canonical_depth(viewer, depth(viewer, hits.position))[None]


def _facet(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.facet[None, None] + 1


def _object(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return scene.object.take(hits.triangle)[None, None] + 1


def _triangle(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.triangle[None, None] + 1


def _normal(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return shading_normals(scene, hits)


def _point(scene: Scene, viewer: Viewer, hits: Hits) -> Values:
    return hits.position + viewer.eye[:, None, None]


_HALF, _FLOAT, _UINT = np.dtype(np.float16), np.dtype(np.float32), np.dtype(np.uint32)

# Depths are measured in double precision and rounded once. A pixel that sees nothing is infinitely
# far in `zv` as well as in `Z`, so that it cannot be taken for one on the far plane, where zv is 1.
CHANNELS: dict[str, Channel] = {
    "rgba": Channel(("R", "G", "B", "A"), _HALF, 0.0, _rgba),
    "Z": Channel(("Z",), _FLOAT, np.inf, _depth),
    "zv": Channel(("zv",), _FLOAT, np.inf, _canonical_depth),
    "facet": Channel(("facet",), _UINT, 0.0, _facet),
    "object": Channel(("object",), _UINT, 0.0, _object),
    "triangle": Channel(("triangle",), _UINT, 0.0, _triangle),
    "N": Channel(("N.X", "N.Y", "N.Z"), _HALF, 0.0, _normal),
    "P": Channel(("P.X", "P.Y", "P.Z"), _FLOAT, 0.0, _point),
}


def exr_channels(names: Iterable[str]) -> dict[str, tuple[np.dtype[Any], float]]:
    """Pixel type and empty value of every EXR channel that the job channels `names` bring, in order."""
    rows = [CHANNELS[name] for name in names]
    return {layer: (row.dtype, row.empty) for row in rows for layer in row.layers}


def empty_buffers(names: Iterable[str], pixels: int) -> dict[str, Values]:
    """A flat buffer (pixels,) for every EXR channel, in which nothing is seen yet."""
    return {layer: np.full(pixels, empty, dtype) for layer, (dtype, empty) in exr_channels(names).items()}


def fill(
    buffers: Mapping[str, Values], names: Iterable[str], scene: Scene, viewer: Viewer, hits: Hits
) -> None:
    """Write the channels `names` of all hits into flat `buffers`, at the pixels the hits belong to."""
    for name in names:
        row = CHANNELS[name]
        for layer, values in zip(row.layers, row.values(scene, viewer, hits), strict=True):
            buffers[layer][hits.pixel] = values.astype(row.dtype)
