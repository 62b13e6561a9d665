"""When an animation runs: the times of scenes to those of files."""

from __future__ import annotations

from dataclasses import dataclass

_GRID = 2**20
"""Times are whole 2^-20ths, so that frames meet samples and held values change on time."""


@dataclass(frozen=True)
class Clock:
    """When an animation runs.

    Attributes:
        first: time at which it begins, in the file's own units.
        last: at which it ends.
        rate: units a second.
    """

    first: float
    last: float
    rate: float

    def code(self, seconds: float, after: str) -> float:
        """Time in the file's units: second 0 is its 0, whenever the animation begins.

        Args:
            seconds: of the scene.
            after: what comes after its end: `hold`, `loop` or `bounce`.
        """
        code = round(seconds * self.rate * _GRID) / _GRID
        length = self.last - self.first
        if after == "hold" or length <= 0:
            return min(max(code, self.first), self.last)
        if after == "loop":
            return self.first + (code - self.first) % length
        there = (code - self.first) % (2 * length)
        return self.first + min(there, 2 * length - there)
