"""The Utah teapot: Martin Newell's patches of 1975, written down by their symmetries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapes import FloatArray, Mesh, grid

# Four (radius, height) control points a patch; each makes four quadrants.
_RIM = [(1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)]
_BODY = [(1.5, 2.4), (1.75, 1.875), (2, 1.35), (2, 0.9)]
_FOOT = [(2, 0.9), (2, 0.45), (1.5, 0.225), (1.5, 0.15)]
_KNOB = [(0, 3.15), (0.8, 3.15), (0, 2.85), (0.2, 2.7)]
_LID = [(0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)]
_BASE = [(1.5, 0.15), (1.5, 0.075), (1.425, 0), (0, 0)]
# Of a quarter circle of radius 1; Newell rounded Bézier's 0.5523.
_ROUND = 0.56
# Inner and outer curves (x, z) of handle and spout, and half the breadth at each control point.
_HANDLE = [
    ((-1.6, 2.025), (-1.5, 2.25), 0.3),
    ((-2.3, 2.025), (-2.5, 2.25), 0.3),
    ((-2.7, 2.025), (-3, 2.25), 0.3),
    ((-2.7, 1.8), (-3, 1.8), 0.3),
    ((-2.7, 1.575), (-3, 1.35), 0.3),
    ((-2.5, 1.125), (-2.65, 0.9375), 0.3),
    ((-2, 0.9), (-1.9, 0.6), 0.3),
]
_SPOUT = [
    ((1.7, 1.425), (1.7, 0.6), 0.66),
    ((2.6, 1.425), (3.1, 0.825), 0.66),
    ((2.3, 2.1), (2.4, 2.025), 0.25),
    ((2.7, 2.4), (3.3, 2.4), 0.25),
    ((2.8, 2.475), (3.525, 2.49375), 0.25),
    ((2.9, 2.475), (3.45, 2.5125), 0.15),
    ((2.8, 2.4), (3.2, 2.4), 0.15),
]


def teapot_patches() -> list[FloatArray]:
    """The 32 patches (4, 4, 3), Z up, in Newell's units; rows × columns face outwards by the right hand."""
    patches = [
        _quadrant(profile, quarter)
        for profile in (_RIM, _BODY, _FOOT, _KNOB, _LID, _BASE)
        for quarter in range(4)
    ]
    for curve in (_HANDLE, _SPOUT):
        for part in (curve[:4], curve[3:]):
            patches += [_half_tube(part, side) for side in (-1, 1)]
    return patches


def _quadrant(profile: Sequence[tuple[float, float]], quarter: int) -> FloatArray:
    turn = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
    patch = []
    for r, z in profile:
        # The knob's arms are 0.45 of 0.8, a little longer than the rest.
        arm = 0.45 if (r, z) == (0.8, 3.15) else _ROUND * r
        arc = [(r, 0.0), (r, arm), (arm, r), (0.0, r)]
        patch.append([(x * turn[0] - y * turn[1], x * turn[1] + y * turn[0], z) for x, y in arc])
    return np.array(patch)


def _half_tube(
    part: Sequence[tuple[tuple[float, float], tuple[float, float], float]], side: int
) -> FloatArray:
    patch = []
    for (xi, zi), (xo, zo), breadth in part:
        row = [(xi, 0, zi), (xi, side * breadth, zi), (xo, side * breadth, zo), (xo, 0, zo)]
        patch.append(row if side > 0 else row[::-1])
    return np.array(patch, np.float64)


def _bezier(count: int) -> FloatArray:
    t = np.arange(count + 1) / count
    return np.stack(((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3), axis=1)


def teapot1024() -> Mesh:
    """The teapot, a tenth of Newell's units in metres, every patch cut 4 × 4 into triangle pairs.

    Eight patches end in a pole and lose four triangles each there; the body's upper ring is cut into
    five rows instead of four, which gives them back: 32 × 32 facets.
    """
    mesh = Mesh()
    for index, patch in enumerate(teapot_patches()):
        rows = 5 if 4 <= index < 8 else 4
        points = np.einsum("ik,jl,klc->ijc", _bezier(rows), _bezier(4), patch)
        world = np.stack((points[..., 0], points[..., 2], -points[..., 1]), axis=2) * 0.1
        grid(mesh, world[::-1], triangles=True)
    return mesh
