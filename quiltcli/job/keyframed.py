"""What all mappings with keyframes have in common."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import model_validator

from quiltcli.job.model import Complaint, Model


class Keyframed(Model):
    """A mapping with the keys `keyframes` and `interpolation`, each of which may be missing."""

    @model_validator(mode="before")
    @classmethod
    def _default_interpolation(cls, value: Any) -> Any:
        """Only keyframes are interpolated: the default belongs to them alone."""
        if isinstance(value, dict) and value.get("keyframes") is not None:
            return {"interpolation": "linear", **value}
        return value

    def keyframe_checks(self) -> Iterator[Complaint]:
        """Each keyframe at a frame of its own, and no interpolation without them."""
        keyframes: Any = getattr(self, "keyframes", None)
        if keyframes is None:
            if getattr(self, "interpolation", None) is not None:
                yield ("interpolation",), "belongs to keyframes, and there are none"
            return
        first: dict[int, int] = {}
        for i, key in enumerate(keyframes):
            if key.frame in first:
                words = f"frame {key.frame} is already given by keyframes[{first[key.frame]}]"
                yield ("keyframes", i, "frame"), words
            first.setdefault(key.frame, i)
