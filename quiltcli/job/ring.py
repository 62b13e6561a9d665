"""The viewers of a 360° light field display: a ring of them, and those who are tracked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field

from quiltcli.job.model import (
    Complaint,
    ExistingFile,
    Listed,
    Model,
    Number,
    Positive,
    ShortFor,
)


class UserSpec(Model):
    """Somebody who stands somewhere else than on the ring."""

    azimuth_deg: Number
    """Where they stand: 0 is +X, 90 is +Z."""
    height: Number
    """Height of their eyes over the mirror's middle, metres."""
    distance: Positive
    """Distance of their eyes from the axis, metres."""
    hold_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=90)] = 6.0
    """To either side, what is drawn for exactly their height and distance; both eyes belong in it."""
    blend_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=90)] = 14.0
    """Beyond that, over which height and distance go back to the ring's."""


class HeadsSpec(Model):
    """Tracked heads: a file of one row a frame and user."""

    csv: Annotated[Path, ExistingFile((".csv", ".txt"), "a CSV file")]
    """CSV file with the columns frame, user, x, y, z: places in the world, metres."""
    hold_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=90)] = 6.0
    """To either side, what is drawn for exactly their height and distance."""
    blend_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=90)] = 14.0
    """Beyond that, over which height and distance go back to the ring's."""


class RingSpec(Model):
    """A ring of viewers about the axis, all at one height and distance but those who are tracked."""

    height: Number
    """Height of the eyes over the mirror's middle, metres."""
    distance: Positive
    """Distance of the eyes from the axis, metres."""
    near: Positive = 0.01
    """Nearest that is drawn, from a pixel's viewpoint, metres."""
    far: Positive | None = None
    """Farthest that is drawn; twice the distance when absent, metres."""
    users: Annotated[tuple[UserSpec, ...], Listed] = ()
    """Those who stand elsewhere."""
    heads: (
        Annotated[
            HeadsSpec,
            ShortFor(
                lambda v: v if isinstance(v, (dict, Model)) else {"csv": v},
                {"type": "string", "format": "path", "minLength": 1},
            ),
        ]
        | None
    ) = None
    """Those who walk about: a CSV file, or a mapping with `csv`."""

    @property
    def farthest(self) -> float:
        """Far, metres."""
        return 2 * self.distance if self.far is None else self.far

    def cross_checks(self) -> Iterator[Complaint]:
        """Users stand or walk; the depth range is not empty; nobody looks from below the mirror."""
        if self.users and self.heads is not None:
            yield ("heads",), "cannot stand beside users (expected one or the other)"
        if self.near >= self.farthest:
            yield ("far",), f"must be greater than near ({self.near:g}), got {self.farthest:g}"
        yield from _below((), self.height, self.distance)
        for i, user in enumerate(self.users):
            yield from _below(("users", i), user.height, user.distance)


def _below(key: tuple[str | int, ...], height: float, distance: float) -> Iterator[Complaint]:
    if height <= -distance:
        words = f"is below the mirror's plane at {distance:g} m: nothing is seen from there, got {height:g}"
        yield (*key, "height"), words
