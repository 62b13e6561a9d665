"""The shots of one facet and eye after one another, for forms that have animated cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from quiltcli.exchange.cameras.cameras import Camera, Shot


@dataclass(frozen=True)
class Track:
    """A camera over time.

    Attributes:
        name: of the facet, with the eye where there are two.
        eye: `center`, `left` or `right`.
        keys: camera by frame, for the frames at which the facet is lit.
    """

    name: str
    eye: str
    keys: dict[int, Camera]

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height."""
        return next(iter(self.keys.values())).pixels


def tracks(shots: Sequence[Shot]) -> list[Track]:
    """A track for every facet and eye that has a camera at any frame."""
    found: dict[tuple[int, str], Track] = {}
    for shot in shots:
        for camera in shot.cameras:
            name = camera.name if shot.eye == "center" else f"{camera.name}.{shot.eye}"
            track = found.setdefault((camera.facet, shot.eye), Track(name, shot.eye, {}))
            track.keys[shot.frame] = camera
    return [found[key] for key in sorted(found)]
