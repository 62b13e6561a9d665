"""How fast a spinning mirror's projector, its pictures and the mirror go together.

Of the refresh rate, the binary pictures in one that is sent, the mirror positions of a turn and the turns a
minute, three say what the fourth must be.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from quiltcli.errors import counted
from quiltcli.formats.bitplanes import PLANES

TOLERANCE = 1e-3
"""Share by which a given number of turns a minute may be off."""


@dataclass(frozen=True)
class Timing:
    """How often a projector is sent a picture, and what a turn of the mirror is made of.

    Attributes:
        refresh: packed pictures a second, Hz.
        positions: binary pictures a turn, one for each mirror position.
        lobe_deg: width of the diffuser's lobe.
        planes: binary pictures in a packed one.
    """

    refresh: float
    positions: int
    lobe_deg: float
    planes: int = PLANES

    @property
    def images_a_second(self) -> float:
        """Binary pictures a second."""
        return self.planes * self.refresh

    @property
    def turns_a_second(self) -> float:
        """Turns of the mirror a second."""
        return self.images_a_second / self.positions

    @property
    def rpm(self) -> float:
        """Turns of the mirror a minute."""
        return 60 * self.images_a_second / self.positions

    def fault(self, rpm: float | None) -> str:
        """What is wrong with a given number of turns a minute; empty when it fits or is not given."""
        if rpm is None or abs(rpm - self.rpm) <= TOLERANCE * self.rpm:
            return ""
        sent = f"{self.planes} × {self.refresh:g} pictures a second, {self.positions} a turn"
        return f"does not fit: {sent}, are {self.rpm:.6g} turns a minute, got {rpm:g}"

    def notices(self) -> Iterator[str]:
        """What works, and is worth a word."""
        if self.positions * self.lobe_deg < 360 * (1 - 1e-9):
            covered = self.positions * self.lobe_deg
            yield (
                f"{counted(self.positions, 'mirror position')} with a lobe of {self.lobe_deg:g}° cover "
                f"{covered:g}° of 360°: an eye sees dark gaps"
            )
        if self.positions % self.planes:
            yield (
                f"{counted(self.positions, 'mirror position')} a turn do not fill whole pictures of "
                f"{self.planes}: a turn begins within a picture"
            )
