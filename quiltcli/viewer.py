"""Where the viewer's eye is in a frame, and which way it looks.

A pose is a pure function of the frame number, so any chunk of a sequence can be rendered anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, cross


@dataclass(frozen=True)
class Viewer:
    """The viewer camera of one frame.

    Attributes:
        frame: frame number.
        eye: (3,) world position, metres.
        look: (3,) unit view direction.
        up: (3,) unit vector, orthogonal to `look`.
        near: nearest depth that is drawn, metres.
        far: farthest depth that is drawn, metres.
        depth: `planar` measures Z along `look`; `radial` is the distance from the eye.
    """

    frame: int
    eye: FloatArray
    look: FloatArray
    up: FloatArray
    near: float
    far: float
    depth: str

    @property
    def camera_from_world(self) -> FloatArray:
        """Rotation (3, 3) with the rows right, up, −look; apply it to world minus eye."""
        return np.stack((cross(self.look, self.up), self.up, -self.look))
