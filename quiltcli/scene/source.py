"""Where the scene of each frame comes from, when something in it moves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

from quiltcli.errors import Problem
from quiltcli.scene.scene import Scene


class SceneSource(Protocol):
    """Gives the scene of any frame; the frame number alone decides."""

    def scene_at(self, frame: float) -> Scene:
        """The scene as it is in a frame, or at a time between two.

        Arrays that are as they were in another frame should be the same objects: what is the same is
        neither copied to workers nor worked out again.
        """

    def problems(self, frames: Iterable[int]) -> Iterator[Problem]:
        """What keeps frames from being drawn."""
