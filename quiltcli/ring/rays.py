"""The rays of a window of pixels, as the four or five numbers in which edges are linear.

In the frame from P′ a pixel's ray is (0, η, κ) + s (1, b, m), and s grows towards the viewer. Where
light leaves the mirror in planes, η is 0. Nothing but +, −, ×, ÷ and √ is used for viewers on a circle,
so that all machines come to the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import FloatArray, IntArray, slices
from quiltcli.ring.cone import viewer_of
from quiltcli.ring.curve import Curve
from quiltcli.ring.plane import nodes_of, on_mirror, viewer_along
from quiltcli.ring.rig import Pose

_ROWS = 16384
_GRID = 2.0**40
"""Places on a curve are rounded to a part of 2⁻⁴⁰ m: sines differ from machine to machine, these do not."""


@dataclass(frozen=True)
class Window:
    """A rectangle of pixels.

    Attributes:
        x: first column.
        y: first row.
        width: pixels.
        height: pixels.
    """

    x: int
    y: int
    width: int
    height: int

    @property
    def size(self) -> int:
        """Pixels in it."""
        return self.width * self.height


@dataclass(frozen=True)
class RayTable:
    """P rays.

    Attributes:
        b: (P,) how much f grows with e.
        m: (P,) how much y grows with e.
        kappa: (P,) y where s is 0.
        omega: (P,) η m − κ b.
        eta: (P,) f where s is 0; None where it is 0 everywhere.
        end: (P,) s at V′.
    """

    b: FloatArray
    m: FloatArray
    kappa: FloatArray
    omega: FloatArray
    eta: FloatArray | None
    end: FloatArray

    def points(self, ray: slice | IntArray, s: FloatArray) -> FloatArray:
        """Points (3, N) on some rays, in the frame from P′."""
        along = self.b[ray] * s
        if self.eta is not None:
            along += self.eta[ray]
        return np.stack((s, along, self.kappa[ray] + self.m[ray] * s))


def rays_at(
    pose: Pose, curve: Curve, x: FloatArray, y: FloatArray, nodes: FloatArray | None = None
) -> RayTable:
    """The rays of pixels (P,) at any places of the picture; `nodes` as `plane.nodes_of` has them."""
    mirror = on_mirror(pose, x, y)
    nodes = nodes_of(pose, curve) if nodes is None else nodes
    if pose.cone:
        viewer = np.round(viewer_of(pose, curve, mirror, nodes) * _GRID) / _GRID
        out = viewer - mirror
        b, m = out[1] / out[0], out[2] / out[0]
        eta = mirror[1] - b * mirror[0]
        kappa = mirror[2] - m * mirror[0]
        return RayTable(b, m, kappa, eta * m - kappa * b, eta, viewer[0])
    b = mirror[1] / mirror[0]
    viewer = viewer_along(pose, curve, b, nodes)
    end, height = viewer[0], viewer[2]
    if not curve.is_circle:
        end, height = (np.round(part * _GRID) / _GRID for part in (end, height))
    m = (height - mirror[2]) / (end - mirror[0])
    kappa = mirror[2] - m * mirror[0]
    return RayTable(b, m, kappa, -(kappa * b), None, end)


def window_rays(pose: Pose, curve: Curve, window: Window, beside: tuple[float, float]) -> RayTable:
    """The rays of a window's pixels, row by row, `beside` their centres; chunk by chunk, to stay in cache."""
    size = window.size
    b, m, kappa, omega, end = np.empty((5, size))
    found = RayTable(b, m, kappa, omega, np.empty(size) if pose.cone else None, end)
    column = np.arange(window.width) + (window.x + 0.5 + beside[0])
    nodes = nodes_of(pose, curve)
    rows = max(1, _ROWS // max(window.width, 1))
    for part in slices(0, window.height, rows):
        row = np.arange(part.start, part.stop) + (window.y + 0.5 + beside[1])
        x, y = np.tile(column, row.size), row.repeat(window.width)
        some = rays_at(pose, curve, x, y, nodes)
        here = slice(part.start * window.width, part.stop * window.width)
        for name in ("b", "m", "kappa", "omega", "eta", "end"):
            values = getattr(some, name)
            if values is not None:
                getattr(found, name)[here] = values
    return found
