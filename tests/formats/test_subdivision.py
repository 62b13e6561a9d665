"""Subdivision surfaces: closed forms of their points, borders, creases and what corners carry."""

from __future__ import annotations

import numpy as np
import pytest

from quiltcli.formats.subdivision import SHARP, Cage, refined

CUBE = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=np.float64)
SIDES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
TOP = [(4, 5), (5, 7), (7, 6), (6, 4)]


def cage(faces, vertices, edges=(), sharpness=(), pinned=()):
    still = np.zeros(vertices, np.bool_)
    still[list(pinned)] = True
    counts = [len(face) for face in faces]
    return Cage(
        np.concatenate(([0], np.cumsum(counts))),
        np.concatenate([np.asarray(face) for face in faces]),
        vertices,
        np.array(edges, dtype=np.int64).reshape(-1, 2),
        np.array(sharpness, dtype=np.float64),
        still,
    )


def test_a_cube_by_the_rules_of_catmull_and_clark():
    found = refined(cage(SIDES, 8), 1)
    points = found.points @ CUBE
    assert len(points) == 8 + 12 + 6
    assert np.diff(found.start).tolist() == [4] * 24
    # (n - 2) / n of itself, and 1 / n² of its neighbours and of the middles of its faces.
    np.testing.assert_allclose(points[0], [-1 / 3 - 1 / 9 - 1 / 9] * 3)
    # An edge: a quarter of its ends and of the middles beside it.
    assert np.abs(np.sort(np.abs(points[8:20]), axis=1) - (0, 0.75, 0.75)).max() < 1e-15
    np.testing.assert_allclose(np.abs(points[20:]).sum(axis=1), 1)


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_points_are_means_of_the_cages_and_faces_stay_outside(levels):
    found = refined(cage(SIDES, 8), levels)
    np.testing.assert_allclose(np.asarray(found.points.sum(axis=1)).ravel(), 1)
    corner = (found.points @ CUBE)[found.vertex].reshape(-1, 4, 3)
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    assert ((normal * corner.mean(axis=1)).sum(axis=1) > 0).all()
    assert np.bincount(found.owner).tolist() == [4**levels] * 6


def test_a_flat_sheet_keeps_its_corners_and_its_area():
    points = np.array([(x, y, 0) for y in range(3) for x in range(3)], dtype=np.float64)
    faces = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
    found = refined(cage(faces, 9), 2)
    there = found.points @ points
    for corner in (0, 2, 6, 8):
        np.testing.assert_allclose(there[corner], points[corner])
    assert not there[:, 2].any()
    corner = there[found.vertex].reshape(-1, 4, 3)
    area = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])[:, 2].sum() / 2
    assert area == pytest.approx(4)


def test_sharp_edges_stay_where_they_are_and_half_sharp_ones_are_between():
    smooth, sharp, one, half = (
        (refined(cage(SIDES, 8, TOP, [value] * 4), 1).points @ CUBE)[:20] for value in (0, SHARP, 1, 0.5)
    )
    # A corner of the top on its crease: 3/4 of itself and 1/8 of its neighbours along it.
    np.testing.assert_allclose(sharp[4], (-0.75, -0.75, 1))
    np.testing.assert_allclose(one, sharp)
    np.testing.assert_allclose(half, (smooth + sharp) / 2)
    # A level later what is sharp for ever is still so, and the other is smooth.
    later = [refined(cage(SIDES, 8, TOP, [value] * 4), 2).points @ CUBE for value in (SHARP, 1)]
    assert later[0][:, 2].max() == 1
    assert (np.abs(later[0][:, 2] - 1) < 1e-12).sum() > (np.abs(later[1][:, 2] - 1) < 1e-12).sum()


def test_vertices_that_are_pinned_stay():
    points = refined(cage(SIDES, 8, pinned=[7]), 2).points @ CUBE
    np.testing.assert_array_equal(points[7], (1, 1, 1))


def test_triangles_and_polygons_become_quadrilaterals():
    points = np.array([(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 2, 0), (-1, 1, 0)], dtype=np.float64)
    found = refined(cage([[0, 1, 2, 3, 4], [1, 0, 4]], 5), 1)
    assert len(found.start) - 1 == 8
    np.testing.assert_allclose((found.points @ points)[-2], points.mean(axis=0))


def test_what_corners_carry_is_linear_and_seams_stay_seams():
    # Two squares side by side whose pictures do not meet.
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (5, 0), (6, 0), (6, 1), (5, 1)], dtype=np.float64)
    faces = [[0, 1, 4, 3], [1, 2, 5, 4]]
    variant = np.array([0, 0, 0, 0, 1, 0, 0, 1])
    found = refined(cage(faces, 6), 2, variant)
    values = found.values @ uv
    assert len(values) == 4 * 2 * 4**2
    own = found.vertex.astype(np.int64) * (found.variant.max() + 1) + found.variant
    for key in np.unique(own):
        assert not np.ptp(values[own == key], axis=0).any()
    np.testing.assert_allclose(values[:4], [(0, 0), (0.25, 0), (0.25, 0.25), (0, 0.25)])
    # On the seam are five vertices, each of which is there twice.
    pairs = np.unique(np.stack((found.vertex, own), axis=1), axis=0)
    assert (np.bincount(pairs[:, 0]) == 2).sum() == 5
