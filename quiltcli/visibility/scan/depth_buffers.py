"""Depth buffers of other methods: which surface comes first by the number such a buffer holds.

Along one pixel's ray the hit lies at t·d, and the depth that any of the methods stores is an affine
function of 1/t. So all of them cover the same pixels, and only three things tell them apart: what
their buffer holds, what they clip, and what is left when the number is rounded to the buffer's bits.

With E = (f+n)/(f−n) and G = 2fn/(f−n), Z the depth along the look direction, D the distance from the
eye along the facet's normal, and h₃ the third row of the homography from the viewer's image to the
facet's, both in canonical space, the buffers hold

- homography  E − G/Z  (Harish & Narayanan, eq. 4);
- offaxis     E − G/D, one frustum a facet (Deering 1992, Cruz-Neira et al. 1993);
- raskar      (|h₃₃| − |h₃₁| − |h₃₂|)·(E·Z − G)/w', where w' = h₃·(x, y, 1)·Z (Raskar 2000);
- zscale      s·|h₃₃|·(E·Z − G)/w' with one s for all facets, the greatest that clips none of their pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import BoolArray, FloatArray, Int32Array, IntArray, cross, dot, segments
from quiltcli.projection.camera import viewer_frustum
from quiltcli.projection.planar import QuiltRays
from quiltcli.viewer.viewer import Viewer

LEAST_FACTOR = 2.0**-8
"""Least share of h₃₃ that Raskar's factor is given; at 0 and below it has no depth, or a reversed one."""

STEPS = {"16": 2**16 - 1, "24": 2**24 - 1}
_ONE_AS_FLOAT = int(np.float32(1).view(np.int32))


@dataclass(frozen=True)
class DepthOrder:
    """What the depth buffer of one method holds for one viewer.

    Attributes:
        method: its name.
        bits: `16` or `24` bit whole numbers, `32f` floats; None for no rounding.
        viewer: near, far, look direction, and how depth is measured.
        across: (F, 3) dot with a point minus eye: its t, 1 on the facet's plane.
        height: (F,) distance of the eye from the facet's plane, metres.
        factor: (F,) what z'/t is multiplied with, for the methods that scale.
    """

    method: str
    bits: str | None
    viewer: Viewer
    across: FloatArray
    height: FloatArray
    factor: FloatArray

    def gain(self, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Depth as this method measures it from the eye, of directions or points given by axis."""
        if self.viewer.depth == "radial" and self.method == "homography":
            return np.asarray(np.sqrt(x * x + y * y + z * z))
        look = self.viewer.look
        return np.asarray(look[0] * x + look[1] * y + look[2] * z)

    def canonical(self, facet: Int32Array, gain: FloatArray, inverse: FloatArray) -> FloatArray:
        """What the buffer would hold without rounding, −1 at its near plane to 1 at its far plane.

        Args:
            facet: facet index; all arguments broadcast.
            gain: `gain` of the ray d.
            inverse: 1/t of the hit at t·d.
        """
        near, far = self.viewer.near, self.viewer.far
        e, g = (far + near) / (far - near), 2 * far * near / (far - near)
        if self.method == "homography":
            return np.asarray(e - g * inverse / gain)
        if self.method == "offaxis":
            return np.asarray(e - g * inverse / self.height[facet])
        return np.asarray(self.factor[facet] * (e * gain - g * inverse))

    def keeps(self, gain: FloatArray, canonical: FloatArray) -> BoolArray:
        """Fragments that the method does not clip."""
        if self.method == "homography":
            return np.asarray(gain > 0)
        within = np.abs(canonical) <= 1
        return np.asarray(within if self.method == "offaxis" else within & (gain > 0))

    def stored(self, hits_facet: Int32Array, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What the buffer holds for points that are seen, and what it is taken for.

        Args:
            hits_facet: (G,) facet index.
            position: (3, G, k) points minus eye, metres.

        Returns:
            (G, k) canonical depth, rounded; and (G, k) the depth in metres that the viewer's own
            buffer would mean by this value: equation 4 solved for Z.
        """
        gain = self.gain(*position)
        across = np.moveaxis(self.across[hits_facet], 1, 0)[:, :, None]
        t = across[0] * position[0] + across[1] * position[1] + across[2] * position[2]
        held = rounded(self.canonical(hits_facet[:, None], gain / t, 1 / t), self.bits)
        near, far = self.viewer.near, self.viewer.far
        return held, 2 * far * near / ((far + near) - held * (far - near))


def depth_order(method: str, bits: str | None, viewer: Viewer, facets: Facets, rays: QuiltRays) -> DepthOrder:
    """The depth buffer of a method.

    Args:
        method: homography, offaxis, raskar or zscale.
        bits: 16, 24, 32f, or None.
        viewer: the viewer.
        facets: the display.
        rays: the viewer's rays through the quilt.
    """
    across = rays.quilt_from_eye[:, 2]
    height = 1 / np.sqrt(np.where(rays.lit, dot(across, across), 1.0))
    factor = np.ones(facets.count)
    if method == "raskar":
        row = homography_row(viewer, facets, rays)
        factor = np.maximum(row[:, 2] - row[:, 0] - row[:, 1], LEAST_FACTOR * row[:, 2])
    elif method == "zscale":
        row = homography_row(viewer, facets, rays)
        factor = uniform_scale(row[:, 2], viewer, facets, rays) * row[:, 2]
    return DepthOrder(method, bits, viewer, across, height, factor)


def homography_row(viewer: Viewer, facets: Facets, rays: QuiltRays) -> FloatArray:
    """Magnitudes (F, 3) of h₃₁, h₃₂ and h₃₃, up to one factor a facet.

    The last row of `quilt_from_eye` after the viewer camera's canonical (x, y, 1): multiplied with Z
    it is t, which is w' but for its scale.
    """
    wide, high = viewer_frustum(viewer, facets, rays.lit)
    right = cross(viewer.look, viewer.up)
    columns = np.stack((wide * right, high * viewer.up, viewer.look), axis=1)
    return np.abs(np.asarray(rays.quilt_from_eye[:, 2] @ columns))


def uniform_scale(h33: FloatArray, viewer: Viewer, facets: Facets, rays: QuiltRays) -> float:
    """The greatest scale of z'/w' that keeps every depth on every lit facet in range.

    As |z'| ≤ Z, it is the least w'/Z. That is t/(|h₃₃|·Z), greatest Z at t = 1 being at a corner.

    Args:
        h33: (F,) from `homography_row`.
        viewer: the viewer.
        facets: the display.
        rays: the viewer's rays through the quilt.
    """
    row, _ = segments(facets.corner_start)
    depth = dot(facets.corners - viewer.eye, viewer.look)
    ratio = (h33[row] * depth)[rays.lit[row]]
    return 1 / float(ratio.max(initial=1e-9))


def rounded(canonical: FloatArray, bits: str | None) -> FloatArray:
    """Canonical depths as a buffer of so many bits gives them back; it stores (z + 1)/2."""
    if bits is None:
        return canonical
    window = np.clip(canonical / 2 + 0.5, 0.0, 1.0)
    if bits == "32f":
        return np.asarray(window.astype(np.float32).astype(np.float64) * 2 - 1)
    return np.asarray(np.rint(window * STEPS[bits]) / STEPS[bits] * 2 - 1)


def ranks(canonical: FloatArray, bits: str) -> FloatArray:
    """Whole numbers from 1, greater for what a buffer of so many bits holds to be nearer.

    At most 31 significant bits, so that a rank keeps its value in a depth key. Floats are ranked by
    their bit patterns, which order like the floats do.
    """
    window = np.clip(canonical / 2 + 0.5, 0.0, 1.0)
    if bits == "32f":
        pattern: IntArray = window.astype(np.float32).view(np.int32).astype(np.int64)
        return (_ONE_AS_FLOAT + 1 - pattern).astype(np.float64)
    return np.asarray(STEPS[bits] + 1 - np.rint(window * STEPS[bits]))
