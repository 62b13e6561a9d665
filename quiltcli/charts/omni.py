"""Omnidirectional stereo: a panorama in which each direction has a pair of eyes of its own.

Whoever turns to a direction has the eyes beside the head, at right angles to it. So the eye of a ray that
goes at longitude a lies on a circle about the head, in (cos a, 0, sin a) for the right eye. Towards the
poles, where all longitudes meet, the circle shrinks to nothing, or what is there would tear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.charts.shapes import stacked
from quiltcli.geometry import FloatArray

MERGE_DEG = (60.0, 75.0)
"""Latitudes between which eyes come together, where nothing else is said, degrees."""


@dataclass(frozen=True)
class Omnistereo:
    """Eyes beside a head, by direction.

    Attributes:
        merge: latitudes between which they come together, radians.
    """

    merge: tuple[float, float]

    def beside(self, directions: FloatArray) -> FloatArray:
        """Places (3, ...) of the right eye for directions (3, ...), y up.

        They are minus the head's, in halves of the distance between the eyes.
        """
        x, y, z = directions
        level = np.sqrt(x * x + z * z)
        share = self._apart(np.arctan2(np.abs(y), level))
        share = np.divide(share, level, out=np.zeros_like(level), where=level > 0)
        return stacked(-z * share, np.zeros_like(share), x * share)

    def _apart(self, latitude: FloatArray) -> FloatArray:
        """1 where eyes are whole, 0 where they are one, by latitudes (...), radians; a cubic between."""
        first, last = self.merge
        if last <= first:
            return np.where(latitude <= first, 1.0, 0.0)
        share = np.clip((latitude - first) / (last - first), 0.0, 1.0)
        return np.asarray(1.0 - share * share * (3.0 - 2.0 * share))
