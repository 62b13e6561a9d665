from __future__ import annotations

import math

import numpy as np
import pytest

from quiltcli.display import lit_facets
from quiltcli.errors import ViewerError
from quiltcli.formats.mesh.polygons import area_vectors
from quiltcli.geometry import normalized
from quiltcli.layout import check_layout, pixel_owners
from quiltcli.projection.camera import aimed, camera_display, frame_display
from quiltcli.projection.planar import eye_from_quilt
from quiltcli.viewer.viewer import Viewer


def viewer(eye=(0, 0, 0), look=(0, 0, -1), up=(0, 1, 0)):
    eye, look, up = (np.array(v, dtype=np.float64) for v in (eye, look, up))
    return Viewer(1, eye, look, up, 0.1, 100, "planar")


def test_corners_in_closed_form():
    facets, _ = camera_display(viewer(eye=(1, 2, 3)), 4, 2, 90)
    # 90 degrees reach 1 m up and down at 1 m; twice as wide as high.
    assert np.allclose(facets.corners - (1, 2, 3), [[-2, -1, -1], [2, -1, -1], [2, 1, -1], [-2, 1, -1]])
    assert np.allclose(facets.origin, [[-1, 3, 2]])
    assert np.allclose(facets.du, [[1, 0, 0]])
    assert np.allclose(facets.dv, [[0, -1, 0]])


def test_it_is_lit_for_its_eye_and_wound_towards_it():
    look = np.array([1, 2, -2]) / 3
    camera = aimed(viewer(), look)
    facets, layout = camera_display(camera, 30, 20, 50)
    assert lit_facets(facets, camera.eye).all()
    assert np.allclose(normalized(area_vectors(facets.corners, facets.corner_start)), -look)
    check_layout(layout)
    assert (pixel_owners(layout) == 1).all()


def test_rays_through_pixels():
    through = camera_display(viewer(), 2, 2, 2 * math.degrees(math.atan(2)))
    matrix = eye_from_quilt(through[1], np.zeros(3))[0]
    assert np.allclose(matrix @ (0.5, 0.5, 1), (-1, 1, -1))
    assert np.allclose(matrix @ (1.5, 1.5, 1), (1, -1, -1))


def test_framing_shows_every_corner_and_fills_the_picture():
    corners = np.random.default_rng(3).normal(size=(30, 3)) + (5, 1, -9)
    camera, fov = frame_display(viewer(), corners, 1.5, turn=True)
    x, y, z = (corners @ camera.camera_from_world.T).T
    reach = math.tan(math.radians(fov) / 2)
    wide, high = np.abs(x / z).max() / (1.5 * reach), np.abs(y / z).max() / reach
    assert max(wide, high) == pytest.approx(1 / 1.12)


def test_framing_keeps_a_look_that_was_given():
    camera, fov = frame_display(viewer(), np.array([[1.0, 0, -2], [0, 0, -2]]), 1, turn=False)
    assert (camera.look == viewer().look).all()
    assert fov == pytest.approx(2 * math.degrees(math.atan(1.12 / 2)))


def test_from_inside_the_view_opens_as_far_as_a_picture_goes():
    room = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    camera, fov = frame_display(viewer(), room, 2, turn=True)
    assert (camera.look == (0, 0, -1)).all()
    assert 2 * math.degrees(math.atan(2 * math.tan(math.radians(fov) / 2))) == pytest.approx(120)


def test_looking_straight_down_turns_up_elsewhere():
    camera = aimed(viewer(), np.array([0, -3.0, 0]))
    assert np.allclose(camera.look, (0, -1, 0))
    assert abs(camera.up @ camera.look) < 1e-12


def test_there_must_be_somewhere_to_look():
    with pytest.raises(ViewerError, match="is where it looks at"):
        aimed(viewer(), np.zeros(3))
