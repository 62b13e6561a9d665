"""Shading normals: welding, creases and weights."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from quiltcli.scene.normals import arccos, smoothed, weld


def mesh(shape):
    return np.array(shape.vertices), np.array(shape.faces)


def apart(vertices, triangles):
    """The same triangles, none sharing a vertex: what an STL file holds."""
    return vertices[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3)


def tent(fold_deg):
    """Two squares that meet in an edge along z and fold by an angle there, the ridge up."""
    half = math.radians(fold_deg) / 2
    x, y = math.cos(half), -math.sin(half)
    vertices = np.array([[0, 0, 0], [0, 0, 1.0], [x, y, 0], [x, y, 1], [-x, y, 0], [-x, y, 1]])
    return vertices, np.array([[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1]])


def test_a_cube_has_three_normals_at_every_corner():
    vertices, triangles = mesh(trimesh.creation.box())
    found = smoothed(vertices, triangles)
    assert len(found.source) == 24
    np.testing.assert_array_equal(vertices[triangles], vertices[found.source][found.triangles])
    assert sorted({tuple(n) for n in found.normals.tolist()}) == sorted(
        tuple(s * e for e in axis) for axis in np.eye(3).tolist() for s in (1, -1)
    )


@pytest.mark.parametrize("form", [mesh, lambda shape: apart(*mesh(shape))])
def test_a_sphere_stays_whole(form):
    vertices, triangles = form(trimesh.creation.icosphere(3))
    found = smoothed(vertices, triangles)
    assert len(found.source) == 642
    assert found.normals == pytest.approx(vertices[found.source], abs=0.01)


@pytest.mark.parametrize(("fold", "count"), [(39, 6), (41, 8)])
def test_the_crease_is_at_forty_degrees(fold, count):
    assert len(smoothed(*tent(fold)).source) == count


def test_a_smooth_fold_shares_its_normal():
    found = smoothed(*tent(30))
    ridge = found.normals[np.isin(found.source, [0, 1])]
    assert ridge == pytest.approx(np.array([[0, 1, 0], [0, 1, 0]]), abs=1e-6)


def test_an_angle_of_180_never_splits():
    assert len(smoothed(*mesh(trimesh.creation.box()), 180.0).source) == 8


def test_how_a_face_is_cut_does_not_matter():
    """A cube's corner normal is its diagonal, though one face may bring two triangles and another one."""
    vertices, triangles = mesh(trimesh.creation.box())
    found = smoothed(vertices, triangles, 180.0)
    expected = vertices[found.source] / math.sqrt(0.75)
    assert found.normals == pytest.approx(expected, abs=1e-4)


def test_a_cone_is_round_and_its_rim_sharp():
    vertices, triangles = mesh(trimesh.creation.cone(0.5, 1, sections=32))
    found = smoothed(vertices, triangles)
    # The apex and the middle of the base once, the rim twice.
    assert len(found.source) == 2 + 2 * 32


def test_opposite_windings_are_kept_apart():
    vertices, triangles = tent(0)
    triangles[2:] = triangles[2:, ::-1]
    found = smoothed(vertices, triangles)
    assert len(found.source) == 8
    assert np.abs(found.normals[:, 1]).tolist() == [1] * 8


def test_back_to_back_triangles_have_normals():
    found = smoothed(np.eye(3), np.array([[0, 1, 2], [0, 2, 1]]), 180.0)
    assert np.linalg.norm(found.normals, axis=1) == pytest.approx(1)


def test_sources_can_be_kept_apart():
    vertices, triangles = apart(*mesh(trimesh.creation.icosphere(1)))
    assert len(smoothed(vertices, triangles, keep_sources=True).source) == 240


def test_weld_gives_the_lowest_index():
    points = np.array([[1, 0, 0], [0, 0, 0], [1, 0, 0], [-0.0, 0, 0], [1, 0, 1.0]])
    assert weld(points).tolist() == [0, 1, 0, 1, 4]


def test_arccos_is_good_to_the_stated_error():
    x = np.linspace(-1, 1, 10001)
    assert np.abs(arccos(x) - np.arccos(x)).max() < 7e-5
