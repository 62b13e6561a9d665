"""The rays of every quilt pixel, and the homographies that are their inverse.

A facet is planar, so the ray from the eye through the page pixel (x, y) is linear in (x, y, 1):
`d = M [x y 1]ᵀ` with `M = [du' dv' origin' − eye]`, where the primes are the facet's raster carried
to the page by the layout. `M` is `eye_from_quilt`; its inverse `quilt_from_eye` takes a point
relative to the eye to homogeneous page pixels (X, Y, W), W > 0 in front of the eye. It is the
`Y H P M_v` of Harish & Narayanan (eq. 2 and 5) restricted to directions. Both keep the world's
axes: the picture on a facet does not depend on which way the viewer looks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from quiltcli.display import Facets
from quiltcli.geometry import BoolArray, FloatArray, cross, dot
from quiltcli.layout import Layout
from quiltcli.projection.curved import ChartView, chart_views
from quiltcli.viewer.viewer import Viewer

if TYPE_CHECKING:
    from quiltcli.projection.patches import Patched


@dataclass(frozen=True)
class QuiltRays:
    """Rays of one eye through the pixels of F facets, placed on their pages.

    Attributes:
        eye: (3,) world metres.
        lit: (F,) facets that are drawn: in the layout, enabled, lit side towards the eye.
        eye_from_quilt: (F, 3, 3) page pixel (x, y, 1) → direction from the eye, world axes; a
            direction ends on the facet's plane.
        quilt_from_eye: (F, 3, 3) point minus eye → homogeneous page pixel (X, Y, W).
        views: of every facet what the eye sees of its chart, None where it is flat and the matrices hold;
            empty where all are.
        patched: curved facets in flat patches, once they have been cut for drawing.
    """

    eye: FloatArray
    lit: BoolArray
    eye_from_quilt: FloatArray
    quilt_from_eye: FloatArray
    views: tuple[ChartView | None, ...] = ()
    patched: Patched | None = None


def quilt_rays(
    layout: Layout, lit: BoolArray, eye: FloatArray, views: tuple[ChartView | None, ...] = ()
) -> QuiltRays:
    """Rays of `eye` through every facet's place in the quilt.

    Args:
        layout: the facets' places, one row a facet.
        lit: (F,) facets whose lit side faces the eye.
        eye: (3,) world metres.
        views: what the eye sees of curved facets.
    """
    drawn = lit & (layout.page >= 0)
    rays = eye_from_quilt(layout, eye)
    inverse = np.zeros_like(rays)
    flat = drawn & np.array([view is None for view in views]) if views else drawn
    inverse[flat] = inverse_3x3(rays[flat])
    return QuiltRays(eye, drawn, rays, inverse, views)


def viewer_rays(layout: Layout, facets: Facets, lit: BoolArray, viewer: Viewer) -> QuiltRays:
    """Rays of a viewer's eye through every facet's place in the quilt; curved facets have their charts'."""
    if not facets.charts:
        return quilt_rays(layout, lit, viewer.eye)
    views = chart_views(facets.charts, layout, viewer.eye, viewer.camera_from_world, viewer.head)
    return quilt_rays(layout, lit, viewer.eye, views)


def eye_from_quilt(layout: Layout, eye: FloatArray) -> FloatArray:
    """Matrices (F, 3, 3) with the columns du', dv', origin' − eye on the page."""
    linear = layout.quilt_from_facet[:, :, :2]
    det = linear[:, 0, 0] * linear[:, 1, 1] - linear[:, 0, 1] * linear[:, 1, 0]
    a = linear[:, 1, 1] / det
    b = -linear[:, 0, 1] / det
    c = -linear[:, 1, 0] / det
    d = linear[:, 0, 0] / det
    du = a[:, None] * layout.du + c[:, None] * layout.dv
    dv = b[:, None] * layout.du + d[:, None] * layout.dv
    shift = layout.quilt_from_facet[:, :, 2]
    corner = layout.origin - shift[:, :1] * du - shift[:, 1:] * dv
    return np.stack((du, dv, corner - eye), axis=-1)


def inverse_3x3(matrices: FloatArray) -> FloatArray:
    """Inverses of (n, 3, 3) matrices by cross products of their columns."""
    u, v, o = matrices[..., 0], matrices[..., 1], matrices[..., 2]
    rows = np.stack((cross(v, o), cross(o, u), cross(u, v)), axis=-2)
    det: FloatArray = dot(u, rows[..., 0, :])
    result: FloatArray = rows / det[..., None, None]
    return result


def plane_homography(
    viewer_intrinsics: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    normal: FloatArray,
    distance: float,
    facet_intrinsics: FloatArray,
) -> FloatArray:
    """The homography a plane induces between two cameras: `K_v [R − T nᵀ/d] K_i⁻¹` (eq. 1).

    It takes pixels of the facet's camera to pixels of the viewer's. The renderer never needs it:
    `quilt_from_eye` is the same map without cameras, and this form is kept to prove so.

    Args:
        viewer_intrinsics: (3, 3) K_v.
        rotation: (3, 3) R, from the facet camera's frame to the viewer camera's.
        translation: (3,) T of the same motion, metres.
        normal: (3,) unit normal of the plane in the facet camera's frame.
        distance: d in `n·X + d = 0` for points of the plane in that frame, metres.
        facet_intrinsics: (3, 3) K_i.
    """
    induced = rotation - np.outer(translation, normal) / distance
    return np.asarray(viewer_intrinsics @ induced @ np.linalg.inv(facet_intrinsics))
