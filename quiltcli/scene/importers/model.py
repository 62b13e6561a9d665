"""What every reader of scenes that move offers: parts, poses and lights at rest and at times."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from quiltcli.errors import MeshError, Problem
from quiltcli.geometry import FloatArray, normalized
from quiltcli.scene.importers.part import Part

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Playing:
    """Which animations of a file are played, and what comes after their end.

    Attributes:
        clips: `all`, the name of one or the names of several.
        after: `hold`, `loop` or `bounce`.
    """

    clips: str | tuple[str, ...] = "all"
    after: str = "hold"


@dataclass(frozen=True)
class FileLight:
    """A light of a mesh file, in the file's space.

    Attributes:
        kind: `directional`, `point`, `spot`, `area`, `ambient` or `environment`.
        position: metres; of no account for light from far away.
        direction: the way it shines, unit; of no account for a point light or one from all around.
        color: irradiance of a directional light, radiant intensity of points and spots, else radiance.
        reach: how far it shines, metres; infinite where the file says nothing.
        cone: angles, radians, from a spot's direction to where it begins to fade and to where it is dark.
        across: from the middle of an area to the middle of a side, metres.
        along: likewise to the next, at right angles; an area shines along `across` × `along`.
        panorama: file of an environment's picture.
        axes: (9) row by row, the file's space from the panorama's, whose middle is −Z and whose top is +Y.
    """

    kind: str
    position: Triple
    direction: Triple
    color: Triple
    reach: float
    cone: tuple[float, float]
    across: Triple = (0.0, 0.0, 0.0)
    along: Triple = (0.0, 0.0, 0.0)
    panorama: str = ""
    axes: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

    def placed(self, matrix: FloatArray) -> FileLight:
        """The light moved by an affine (4, 4) matrix; its strength, its range and its cone stay."""
        rows = matrix[:3, :3]
        turned = rows @ np.array(self.axes).reshape(3, 3)
        return replace(
            self,
            position=triple(rows @ np.array(self.position) + matrix[:3, 3]),
            direction=triple(normalized(rows @ np.array(self.direction))),
            across=triple(rows @ np.array(self.across)),
            along=triple(rows @ np.array(self.along)),
            axes=tuple(normalized(turned.T).T.ravel().tolist()) if self.panorama else self.axes,
        )


def triple(values: FloatArray) -> Triple:
    """Three numbers of an array (3,)."""
    x, y, z = (float(v) for v in values)
    return x, y, z


ONLY_CLIP = "animation 1"
"""Name of the animation of files that have one without a name."""


def check_only_clip(path: str, playing: Playing) -> None:
    """Raise a `MeshError` where another animation is asked for than the only one."""
    wanted = (playing.clips,) if isinstance(playing.clips, str) else playing.clips
    for name in wanted:
        if name not in ("all", ONLY_CLIP):
            raise MeshError(Problem(f"has no animation {name!r} (it has one, {ONLY_CLIP!r})", path))


NO_SUBDIVISION = "has no subdivision surfaces that could be refined (expected USD with catmullClark meshes)"


class Model(Protocol):
    """A file with parts that may move, ready to be posed at any time.

    A time is in seconds of the file's animations; None is the file at rest.
    """

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the animations."""

    @property
    def notices(self) -> tuple[str, ...]:
        """What the file holds that is not drawn as it means."""

    def check(self, playing: Playing) -> None:
        """Raise a `MeshError` unless the file has the animations that are asked for."""

    def subdivided(self, levels: int) -> Model:
        """The same with subdivision surfaces refined so many times; a `MeshError` where there are none."""

    def contested(self, playing: Playing) -> int:
        """Number of movements that are not played, as another clip moves the same thing."""

    def form(self, seconds: float | None, playing: Playing | None) -> Hashable:
        """What is equal at two times whose parts have the same vertices, triangles and surfaces."""

    def hidden(self, seconds: float, playing: Playing) -> bool:
        """Whether nothing is to be seen at a time; `pose` has all vertices at one place then."""

    def parts(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[Part, ...]:
        """Its parts at a time."""

    def pose(self, seconds: float, playing: Playing) -> tuple[FloatArray, FloatArray]:
        """Vertices and normals (V, 3) of all parts after one another at a time, in the order of `parts`.

        Normals are of any length, zero where the file gives none.
        """

    def lights(self, seconds: float | None = None, playing: Playing | None = None) -> tuple[FileLight, ...]:
        """Its lights at a time."""
