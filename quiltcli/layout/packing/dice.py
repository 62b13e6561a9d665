"""Numbers that look random, for searches whose results are the same everywhere."""

from __future__ import annotations


class Dice:
    """Knuth's MMIX generator: the same numbers on every computer, for ever."""

    def __init__(self) -> None:
        self._state = 1

    def below(self, limit: int) -> int:
        """A whole number from 0 to limit − 1."""
        self._state = (self._state * 6364136223846793005 + 1442695040888963407) % (1 << 64)
        return (self._state >> 33) % limit
