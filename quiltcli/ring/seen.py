"""Which mirror positions an eye sees: closed forms after Jones et al., section 4."""

from __future__ import annotations

import math

from quiltcli.ring.rig import Rig


def half_turn(rig: Rig, distance: float) -> float:
    """Angle that the mirror turns while it lights an eye at a distance from the axis, to either side.

    The mirror's rim lights the eye asin(R / p) + asin(R / d) before its middle does.
    """
    pose = rig.at(0.0)
    reach = math.hypot(float(pose.origin[0]), float(pose.origin[1]))
    radius = rig.disk / 2 if rig.disk else rig.rectangle[0] / 2
    return math.asin(min(radius / reach, 1)) + math.asin(min(radius / distance, 1))


def slices_seen(rig: Rig, distance: float) -> float:
    """How many mirror positions light some of the mirror for an eye at a distance from the axis, metres."""
    return 2 * half_turn(rig, distance) / abs(rig.step)
