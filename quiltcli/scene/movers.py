"""Objects that the animations of their files move, with triangles that stay the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.scene.bake import Baked, reposed
from quiltcli.scene.importers.model import Model, Playing
from quiltcli.scene.importers.part import moved


@dataclass(frozen=True, eq=False)
class Mover:
    """An object of the scene that moves.

    Attributes:
        model: its file.
        playing: which animations are played.
        matrix: (4, 4) the object's place in the world, or None.
        baked: the object as it was loaded, in any pose.
    """

    model: Model
    playing: Playing
    matrix: FloatArray | None
    baked: Baked

    def at(self, seconds: float) -> tuple[FloatArray, Float32Array]:
        """World vertices (V, 3) and unit normals (V, 3) at a time, in the order of `baked`."""
        vertices, normals = self.model.pose(seconds, self.playing)
        if self.matrix is not None:
            vertices, given = moved(self.matrix, vertices, normals)
            normals = np.zeros_like(vertices) if given is None else given
        return reposed(self.baked, vertices, normals)
