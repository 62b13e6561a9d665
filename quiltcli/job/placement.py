"""Where an object of the scene is: in one place, or on its way between keyframes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from quiltcli.geometry import FloatArray, quaternions, transform
from quiltcli.geometry.interpolation import TURNINGS, VALUES
from quiltcli.job.display import Scale, TransformSpec
from quiltcli.job.keyframed import Keyframed
from quiltcli.job.model import Complaint, Listed, Model, OneOf, Vec3

# Sines differ in their last bit from one machine to the next; what is kept of them does not.
_STEP = 2.0**-40


class TransformKeySpec(Model):
    """Place of an object at one frame: scaled, then turned about X, Y and Z, then shifted."""

    frame: int
    """Frame number."""
    translate: Vec3 = (0.0, 0.0, 0.0)
    """Shift, metres."""
    rotate_deg: Vec3 = (0.0, 0.0, 0.0)
    """Angles about X, then Y, then Z, degrees."""
    scale: Scale = (1.0, 1.0, 1.0)
    """One factor, or one for each axis."""

    def cross_checks(self) -> Iterator[Complaint]:
        """Nothing is flattened."""
        if 0 in self.scale:
            yield ("scale",), "must not be 0"


class PlacementSpec(Keyframed, TransformSpec):
    """Scale, then rotate about X, then Y, then Z, then translate; or a matrix; or keyframes of the former.

    Between keyframes shift and scale are interpolated as numbers and the rotation as a quaternion, the
    shorter way round: for a whole turn give keyframes less than half a turn apart.
    """

    keyframes: Annotated[tuple[TransformKeySpec, ...], Listed, Field(min_length=1)] | None = None
    """Places at some frames, instead of one place; the ends are held."""
    interpolation: Annotated[str, OneOf(("linear", "smooth", "hold"))] | None = None
    """Between keyframes: linear (the default), smooth, hold."""

    @property
    def moves(self) -> bool:
        """Whether there is more than one place."""
        return self.keyframes is not None and len(self.keyframes) > 1

    @property
    def start(self) -> float:
        """The first keyframe's number; 0 where there is none."""
        return min((key.frame for key in self.keyframes or ()), default=0)

    def at(self, frame: float) -> FloatArray:
        """World from local (4, 4) at a frame, or at a time between two."""
        if self.keyframes is None:
            return self.array
        keys = sorted(self.keyframes, key=lambda key: key.frame)
        frames = np.array([key.frame for key in keys], dtype=np.float64)
        kind = self.interpolation or "linear"
        values = np.array([[*key.translate, *key.scale] for key in keys])
        turns = quaternions.from_euler(np.radians([key.rotate_deg for key in keys]), "xyz")
        value = VALUES[kind](frames, values, float(frame))
        turn = TURNINGS[kind](frames, quaternions.continuous(turns), float(frame))
        matrix = transform(value[:3].tolist())
        matrix[:3, :3] = np.round(quaternions.matrices(turn) / _STEP) * _STEP * value[3:]
        return matrix

    def cross_checks(self) -> Iterator[Complaint]:
        """Keyframes stand alone, each at a frame of its own; nothing is turned inside out on the way."""
        yield from super().cross_checks()
        yield from self.keyframe_checks()
        if self.keyframes is None:
            return
        for name in ("translate", "rotate_deg", "scale", "matrix"):
            if getattr(self, name) is not None:
                yield (name,), "cannot stand beside keyframes (expected one or the other)"
        for i, key in enumerate(self.keyframes):
            if (np.sign(key.scale) != np.sign(self.keyframes[0].scale)).any():
                words = "mirrors otherwise than keyframes[0] (give each axis one sign in all keyframes)"
                yield ("keyframes", i, "scale"), words
