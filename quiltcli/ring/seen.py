"""Which mirror positions an eye sees, and where: closed forms after Jones et al., section 4."""

from __future__ import annotations

import math

from quiltcli.ring.rig import Rig


def slices_seen(rig: Rig, distance: float) -> float:
    """How many mirror positions light some of the mirror for an eye at a distance from the axis, metres.

    The eye sees the mirror's whole width while it turns by asin(R / p) + asin(R / d) to either side.
    """
    pose = rig.at(0.0)
    reach = math.hypot(float(pose.origin[0]), float(pose.origin[1]))
    radius = rig.disk / 2 if rig.disk else rig.rectangle[0] / 2
    turn = math.asin(min(radius / reach, 1)) + math.asin(min(radius / distance, 1))
    return 2 * turn / abs(rig.step)
