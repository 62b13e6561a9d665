"""From a pixel to the ray it shows, and from a point to the pixel that shows it.

The mirror bears a diffuser that spreads light up and down only. Seen from above it reflects like a
mirror, so light that left the projector seems to come from P′; in the vertical plane through P′ and the
mirror's point M it goes everywhere, and to one place V′ on the viewers' curve. A pixel shows what is
seen from V′ towards M (Jones et al., section 4). Coordinates are those of `Pose`: frame, from P′.
"""

from __future__ import annotations

from dataclasses import dataclass

from quiltcli.geometry import FloatArray
from quiltcli.ring.cone import viewer_of, viewer_through
from quiltcli.ring.curve import Curve
from quiltcli.ring.plane import on_mirror, pixels_of, through_mirror, viewer_along
from quiltcli.ring.rig import Pose


@dataclass(frozen=True)
class Rays:
    """What pixels show: the ray from `viewer` towards `mirror`.

    Attributes:
        viewer: (3, ...) V′ in the frame, from P′, metres.
        mirror: (3, ...) M.
    """

    viewer: FloatArray
    mirror: FloatArray


def backward(pose: Pose, curve: Curve, x: FloatArray, y: FloatArray) -> Rays:
    """The rays that pixels (...) show."""
    mirror = on_mirror(pose, x, y)
    if pose.cone:
        return Rays(viewer_of(pose, curve, mirror), mirror)
    return Rays(viewer_along(pose, curve, mirror[1] / mirror[0]), mirror)


def forward(pose: Pose, curve: Curve, points: FloatArray) -> tuple[FloatArray, FloatArray, Rays]:
    """The pixels that show points.

    Args:
        pose: the mirror.
        curve: the viewers.
        points: (3, ...) frame, from P′.

    Returns:
        x, y (...) and the rays that lead through the points.
    """
    viewer = (
        viewer_through(pose, curve, points) if pose.cone else viewer_along(pose, curve, points[1] / points[0])
    )
    mirror = through_mirror(pose, viewer, points)
    x, y = pixels_of(pose, mirror)
    return x, y, Rays(viewer, mirror)
