"""By how much planes are off where light leaves the mirror in cones.

`reflection: plane` takes light to go on in a vertical plane, which is nearly so for viewers low over the
mirror (Jones et al., appendix A); `cone` has it as it is. The difference grows with the elevation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quiltcli.geometry import FloatArray
from quiltcli.ring.curve import Curve
from quiltcli.ring.maps import forward
from quiltcli.ring.rig import Rig

WORTH_A_WORD = 0.5
"""Root mean square of pixels from which on a render says so."""
_GRID = 9


def plane_error(rig: Rig, distance: float, height: float) -> float:
    """How far from where a cone has them planes show points, over a ball as large as the mirror.

    Args:
        rig: projector and mirror.
        distance: of all viewers from the axis, metres; more than the mirror's radius.
        height: of their eyes, metres.

    Returns:
        Root mean square, pixels.
    """
    points, curve = _ball(rig.radius), Curve(height, distance)
    pose = replace(rig.at(rig.first), cone=False)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        (x, y, _), (u, v, _) = (
            forward(replace(pose, cone=cone), curve, pose.from_world(points).T) for cone in (False, True)
        )
        off = (x - u) ** 2 + (y - v) ** 2
    found = off[np.isfinite(off)]
    return float(np.sqrt(found.mean())) if found.size else 0.0


def _ball(radius: float) -> FloatArray:
    """Points (N, 3) evenly in a ball about the world's middle, beside its axes so that no symmetry helps."""
    steps = ((np.arange(_GRID) + 0.4) / _GRID * 2 - 1) * radius
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(points[(points * points).sum(axis=1) < radius * radius])
