"""Triangles in ray space: edge functions that are linear in a ray's numbers, and where planes are met.

For corners A, B in the frame from P′ and a ray (0, η, κ) + s (1, b, m), with N = A × B and d = B − A:

    E(A, B) = N₁ + b N₂ + m N₃ + κ d₂ + ω d₁ − η d₃,   ω = η m − κ b

is the side of the edge on which the ray passes (a product of Plücker coordinates). All three are positive
where a triangle is met whose winding is towards the viewer, all negative where it is seen from behind.
A × B and d change sign bit by bit when A and B trade places, and E with them: triangles that share an edge
leave no ray between them and none to both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.geometry import BoolArray, FloatArray


@dataclass(frozen=True)
class Forms:
    """T triangles.

    Attributes:
        edges: (3, 6, T) of each edge, opposite to each corner: N₁, N₂, N₃, d₂, d₁, d₃.
        plane: (4, T) normal n by the winding, and n·A.
    """

    edges: FloatArray
    plane: FloatArray

    def some(self, rows: FloatArray | slice) -> Forms:
        """Those of some triangles."""
        return Forms(self.edges[:, :, rows], self.plane[:, rows])


def forms_of(a: FloatArray, b: FloatArray, c: FloatArray) -> Forms:
    """Forms of triangles with corners (3, T) in the frame from P′."""
    edges = np.empty((3, 6, a.shape[1]))
    for out, (start, end) in zip(edges, ((b, c), (c, a), (a, b)), strict=True):
        _cross(start, end, out)
        np.subtract(end[1], start[1], out=out[3])
        np.subtract(end[0], start[0], out=out[4])
        np.subtract(end[2], start[2], out=out[5])
    plane = np.empty((4, a.shape[1]))
    _cross(b - a, c - a, plane)
    plane[3] = plane[0] * a[0] + plane[1] * a[1] + plane[2] * a[2]
    return Forms(edges, plane)


def _cross(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]


def edge_values(
    edge: FloatArray,
    b: FloatArray,
    m: FloatArray,
    kappa: FloatArray,
    omega: FloatArray,
    eta: FloatArray | None,
) -> FloatArray:
    """E of edges (6, ...) at rays of a shape that they fit, always summed in this order."""
    value: FloatArray = edge[1] * b
    value += edge[0]
    value += edge[2] * m
    value += edge[3] * kappa
    value += edge[4] * omega
    if eta is not None:
        value -= edge[5] * eta
    return value


def sides(edge: FloatArray, value: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Whether rays pass an edge on the inner side, of triangles seen from in front and from behind.

    A ray through the edge itself belongs to one of the two triangles that share it: by the sign of the
    first number of the edge that is not 0, which is the other in the neighbour.
    """
    front, back = value > 0, value < 0
    zero = value == 0
    if zero.any():
        first = np.zeros(np.broadcast_shapes(edge[0].shape, value.shape))
        for part in edge[::-1]:
            first = np.where(part != 0, part, first)
        front |= zero & (first > 0)
        back |= zero & (first < 0)
    return front, back


def distances(
    plane: FloatArray,
    b: FloatArray,
    m: FloatArray,
    kappa: FloatArray,
    eta: FloatArray | None,
) -> FloatArray:
    """S at which rays meet planes (4, ...)."""
    below: FloatArray = plane[1] * b
    below += plane[0]
    below += plane[2] * m
    above: FloatArray = plane[3] - plane[2] * kappa
    if eta is not None:
        above -= plane[1] * eta
    with np.errstate(divide="ignore", invalid="ignore"):
        above /= below
    return above
