"""The scene, made light enough to be shown as a ghost around the display."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray, IntArray
from quiltcli.scene import Scene
from quiltcli.scene.textures.pool import mean_texels

_GRIDS = (512, 362, 256, 181, 128, 91, 64, 45, 32, 23, 16, 11, 8)


@dataclass(frozen=True)
class Ghost:
    """A coloured mesh.

    Attributes:
        position: (V, 3) metres from a centre.
        color: (V, 3) linear, 0 to 1.
        triangles: (T, 3) vertices.
        cells: cells along the longest side of the grid it was thinned by, 0 where it is whole.
    """

    position: Float32Array
    color: Float32Array
    triangles: IntArray
    cells: int = 0


def ghost(scene: Scene, centre: FloatArray, budget: int) -> Ghost | None:
    """The scene in at most `budget` triangles, thinned if need be; None where that leaves nothing.

    Thinning joins all vertices in one cell of a grid (Rossignac & Borrel 1993), with the finest of
    some grids that will do.
    """
    used, corner = np.unique(scene.triangles, return_inverse=True)
    whole = Ghost(
        position=(scene.vertices[used] - centre).astype(np.float32),
        color=_colors(scene)[used],
        triangles=corner.reshape(-1, 3).astype(np.int64),
    )
    if not len(whole.triangles) or budget <= 0:
        return None
    if len(whole.triangles) <= budget:
        return whole
    thinned = (replace(clustered(whole, cells), cells=cells) for cells in _GRIDS)
    return next((found for found in thinned if 0 < len(found.triangles) <= budget), None)


def _colors(scene: Scene) -> Float32Array:
    """Colour (V, 3) of every vertex: its own times that of its material, pictures by their means."""
    material = np.zeros(len(scene.vertices), dtype=np.int64)
    material[scene.triangles] = scene.material[:, None]
    shown = scene.materials.color * mean_texels(scene, "color")
    shown = shown + scene.materials.emission * mean_texels(scene, "emission")
    return np.clip(scene.colors * shown[material], 0, 1).astype(np.float32)


def clustered(mesh: Ghost, cells: int) -> Ghost:
    """A mesh with all vertices of a grid cell joined in their mean; what falls flat is left out."""
    low, high = mesh.position.min(axis=0), mesh.position.max(axis=0)
    step = float((high - low).max()) / cells or 1.0
    place = np.minimum(((mesh.position - low) / step).astype(np.int64), cells - 1)
    key = (place[:, 0] * cells + place[:, 1]) * cells + place[:, 2]
    _, joined = np.unique(key, return_inverse=True)
    triangles = joined[mesh.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    # A triangle may have become several of the same: the lowest corner first makes them equal.
    first = np.argmin(triangles, axis=1)[:, None]
    triangles = np.unique(np.take_along_axis(triangles, (first + [0, 1, 2]) % 3, axis=1), axis=0)
    used, corner = np.unique(triangles, return_inverse=True)
    return Ghost(
        position=_means(mesh.position, joined)[used],
        color=_means(mesh.color, joined)[used],
        triangles=corner.reshape(-1, 3).astype(np.int64),
    )


def _means(values: Float32Array, group: IntArray) -> Float32Array:
    """Mean (G, 3) of the values (V, 3) of every group."""
    count = np.bincount(group)
    sums = [np.bincount(group, values[:, k].astype(np.float64)) for k in range(values.shape[1])]
    return (np.stack(sums, axis=1) / count[:, None]).astype(np.float32)
