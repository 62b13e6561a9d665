"""The rays of quilt pixels, in closed form, and their agreement with the paper's homography."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.display import lit_facets
from quiltcli.geometry import normalized, segments
from quiltcli.layout import align, quilt_polygons
from quiltcli.projection.planar import plane_homography, quilt_rays
from tests.helpers.in_memory import cube, panel, viewer
from tests.helpers.packed_layouts import pack

EYE = np.array([1.7, 2.1, 2.9])


@pytest.fixture(scope="module")
def cube_rays():
    facets = cube()
    layout = align(pack(facets, "rects"), facets)
    return facets, layout, quilt_rays(layout, lit_facets(facets, EYE), EYE)


def test_rays_through_a_facets_corners_end_at_its_corners(cube_rays):
    facets, layout, rays = cube_rays
    row, _ = segments(facets.corner_start)
    corners = np.column_stack((quilt_polygons(layout), np.ones(len(row))))
    ends = EYE + np.einsum("kij,kj->ki", rays.eye_from_quilt[row], corners)
    np.testing.assert_allclose(ends, facets.corners, atol=1e-12)


def test_points_go_back_to_their_pixels_with_w_one_on_the_facet(cube_rays):
    facets, layout, rays = cube_rays
    row, _ = segments(facets.corner_start)
    lit = rays.lit[row]
    pixels = np.einsum("kij,kj->ki", rays.quilt_from_eye[row[lit]], (facets.corners - EYE)[lit])
    expected = np.column_stack((quilt_polygons(layout), np.ones(len(row))))[lit]
    np.testing.assert_allclose(pixels, expected, atol=1e-9)


def test_w_is_depth_in_units_of_the_facet():
    facets = panel()
    layout = align(pack(facets, "rows"), facets)
    eye = np.array([0.0, 0, 2])
    rays = quilt_rays(layout, lit_facets(facets, eye), eye)
    assert (rays.quilt_from_eye[0] @ [0, 0, -6])[2] == pytest.approx(3)
    assert (rays.quilt_from_eye[0] @ [0, 0, 1])[2] < 0


def test_only_facets_that_face_the_eye_are_drawn(cube_rays):
    _, _, rays = cube_rays
    assert rays.lit.tolist() == [True, False, True, False, True, False]


def test_the_matrix_is_the_papers_homography(cube_rays):
    facets, layout, rays = cube_rays
    seen_by = viewer(EYE)
    focal = np.diag([700.0, 700, 1])
    focal[:2, 2] = 320, 240
    for f in np.flatnonzero(rays.lit):
        # A camera one metre in front of the facet's raster, square to it; y down, z forward.
        axes = np.stack((normalized(facets.du[f]), normalized(facets.dv[f]), -facets.normal[f]))
        centre = facets.origin[f] - axes[2]
        pitch = np.linalg.norm(facets.du[f])
        facet_camera = np.diag([1 / pitch, 1 / pitch, 1])
        viewer_axes = np.diag([1, -1, -1]) @ seen_by.camera_from_world
        rotation = viewer_axes @ axes.T
        translation = viewer_axes @ (centre - EYE)
        homography = plane_homography(focal, rotation, translation, np.array([0.0, 0, -1]), 1.0, facet_camera)
        ours = (
            focal @ viewer_axes @ rays.eye_from_quilt[f] @ np.vstack((layout.quilt_from_facet[f], [0, 0, 1]))
        )
        np.testing.assert_allclose(ours / ours[2, 2], homography / homography[2, 2], rtol=1e-9, atol=1e-9)
