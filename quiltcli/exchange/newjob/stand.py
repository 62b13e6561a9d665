"""Where the viewer of a new job stands, what they look at, and how large the content may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets
from quiltcli.exchange.newjob.kinds import kind_of
from quiltcli.exchange.newjob.wishes import Wishes

_TALL = 1.6  # height of the eyes of somebody who stands, metres


@dataclass(frozen=True)
class Stand:
    """The viewer's spot.

    Attributes:
        eye: place of the eye, metres.
        look_at: point that is looked at.
        orbit: radius, about `look_at`, of the circle they walk around it on; 0 where they stand still.
        reach: longest side of the display's box, metres.
        content: radius of the content that is put at `look_at`.
    """

    eye: tuple[float, float, float]
    look_at: tuple[float, float, float]
    orbit: float
    reach: float
    content: float


def stand_for(wishes: Wishes, facets: Facets) -> Stand:
    """Before the display, in it or around it, as its kind has it; at the eye that was asked for, if any."""
    kind = kind_of(wishes)
    low, high = facets.corners.min(axis=0), facets.corners.max(axis=0)
    box = high - low
    middle, reach = (low + high) / 2, float(box.max())
    # Somebody stands on the ground before something large, and bends down to something small.
    height = min(float(low[1]) + _TALL, float(high[1])) if box[1] > _TALL / 2 else float(middle[1])
    if low[1] > _TALL:
        height = _TALL
    if kind.encloses or wishes.inside:
        eye = np.array((middle[0], min(height, float(middle[1] + box[1] / 4)), middle[2]))
        look = eye - (0, 0, box[2] / 2)
        orbit = 0.0
    elif kind.around:
        look, orbit = middle, 1.5 * reach
        eye = middle + (0, 0, orbit)
        eye[1] = float(high[1]) + 0.4 * reach
    else:
        look, orbit = middle, 0.0
        # Whoever sees the upper side of something stands higher than it.
        over = float(high[1]) + 0.25 * reach if kind.from_above else height
        eye = np.array((middle[0], over, high[2] + 1.2 * reach))
    if wishes.eye is not None:
        eye, orbit = np.array(wishes.eye), 0.0
        if np.linalg.norm(eye - look) < 1e-6 * reach:
            look = eye - (0, 0, reach)
    sides = box[box > 1e-9 * reach]
    content = 0.3 * float(sides.min())
    # In something around the viewer that is smaller than they are, millimetres are degrees.
    digits = 5 if kind.encloses and reach < 0.5 else 3
    return Stand(_rounded(eye, digits), _rounded(look, digits), _round(orbit), reach, _round(content))


def _round(value: float) -> float:
    """A value to four digits, as people write it."""
    return float(f"{value:.4g}") + 0.0


def _rounded(point: np.ndarray, digits: int) -> tuple[float, float, float]:
    """A point to so many digits of a metre."""
    x, y, z = (round(float(c), digits) + 0.0 for c in point)
    return x, y, z
