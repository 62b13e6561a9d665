from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.analysis.simulate.thirdperson import outline_points, third_person_camera, viewer_marks
from quiltcli.cli import main
from quiltcli.geometry import dot
from quiltcli.job import load_job
from quiltcli.projection.camera import camera_display
from quiltcli.projection.planar import eye_from_quilt
from tests.helpers.in_memory import cube, panel, viewer
from tests.helpers.tiny_job import write_tiny_job

# --- third person ---


def lit(facets):
    return np.ones(facets.count, np.bool_)


def test_the_outline_of_a_panel_is_its_corners():
    points = outline_points(viewer((0.3, 0.2, 3)), panel(), lit(panel()))
    assert sorted(map(tuple, points)) == [(-1, -1, 0), (-1, 1, 0), (1, -1, 0), (1, 1, 0)]


def test_the_outline_of_a_cube_seen_at_its_corner_is_a_hexagon():
    points = outline_points(viewer((4, 4, 4)), cube(), lit(cube()))
    assert sorted(map(tuple, points)) == sorted(
        (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1) if not x == y == z
    )


def test_from_inside_rays_go_to_corners_all_around():
    points = outline_points(viewer((0, 0, 0), (0, 0, -1)), cube(), lit(cube()), most=6)
    assert len({tuple(point) for point in points}) == 6
    assert outline_points(viewer((0, 0, 5)), cube(), np.zeros(6, np.bool_)).shape == (0, 3)


@pytest.mark.parametrize("eye", [(0, 0, 4), (0.5, 3, -1), (0, 6, 0), (0, 0, 0.1)])
def test_the_camera_sees_the_display_and_the_eye(eye):
    facets = cube()
    camera, fov = third_person_camera(viewer(eye, (0, 0, -1)), facets, None, None, 4 / 3)
    through = camera_display(camera, 400, 300, fov)
    back = np.linalg.inv(eye_from_quilt(through[1], camera.eye)[0])
    for point in (*facets.corners, np.array(eye)):
        x, y, w = back @ (point - camera.eye)
        assert w > 0
        assert 0 < x / w < 400
        assert 0 < y / w < 300


def test_marks_are_a_ball_and_rods():
    who = viewer((0, 0, 3))
    marks = viewer_marks(who, np.array([[1.0, 1, 0]]), 0.1, 0.01)
    away = np.sqrt(dot(marks.vertices - who.eye, marks.vertices - who.eye))
    np.testing.assert_allclose(away[: 13 * 25], 0.1)
    np.testing.assert_allclose(np.abs(marks.vertices[-4:] - (1, 1, 0)).max(), 0.01, rtol=0.5)
    assert marks.triangles.max() == len(marks.vertices) - 1
    assert len(marks.color) == len(marks.triangles)


def test_a_third_person_sees_display_eye_and_scene(tmp_path):
    job = load_job(write_tiny_job(tmp_path))
    seen = {}
    for scene in ("none", "solid", "ghost"):
        options = PictureOptions(size=(80, 60), samples=1, third_person=True, scene=scene, threads=1)
        [found] = simulate(job, [1], options)
        assert found.comparison is None
        seen[scene] = found.picture
    red, green, blue = seen["none"].transpose(2, 0, 1)
    assert np.count_nonzero((red > 0.25) & (green > 0.12) & (blue < 0.06)) > 100  # the eye is yellow
    assert np.count_nonzero((red > 2.5 * green) & (red < 5 * green)) > 10  # the image on the wall is red
    solid, ghost = (seen[scene] - seen["none"] for scene in ("solid", "ghost"))
    before = np.abs(solid).max(axis=2) > 0.01
    assert before.sum() > 10
    np.testing.assert_allclose(ghost[before], 0.55 * solid[before], atol=1e-6)
    assert np.count_nonzero(np.abs(ghost).max(axis=2) > 0.005) > before.sum()  # it shows through the wall


def test_walls_seen_from_behind_hide_nobody(tmp_path):
    (tmp_path / "room.yaml").write_text(
        "quilt_display: 1\npanels:\n"
        "- {name: left, pixels: [30, 30], size: [3 m, 3 m], at: [-1.5, 1.5, 0], yaw_deg: 90}\n"
        "- {name: right, pixels: [30, 30], size: [3 m, 3 m], at: [1.5, 1.5, 0], yaw_deg: -90}\n"
    )
    (tmp_path / "ball.obj").write_text("v 0 1 -2\nv 1 1 -2\nv 0 2 -2\nf 1 2 3\n")
    (tmp_path / "job.yaml").write_text(
        "quilt_job: 1\ndisplay: room.yaml\nscene: ball.obj\nframes: 1\nviewer: {near: 0.05, far: 30, path:"
        " {keyframes: [{frame: 1, position: [0, 1.6, 0], look_at: [0, 1.6, -9]}]}}\n"
    )
    from_aside = {"place": (6.0, 1.6, 0.0), "look_at": (0.0, 1.6, 0.0)}  # straight through the right wall
    options = PictureOptions((60, 60), samples=1, third_person=True, scene="none", threads=1, **from_aside)
    [found] = simulate(load_job(tmp_path / "job.yaml"), [1], options)
    red, _, blue = found.picture[29:31, 29:31].mean(axis=(0, 1))
    assert red > 0.3 > 4 * blue  # the eye, through a wall that takes three tenths of it


def test_the_command_takes_it_but_compares_nothing(tmp_path):
    job = write_tiny_job(tmp_path)
    more = ["--third-person", "--size", "60x40", "--supersample", "1", "-j", "1"]
    result = CliRunner().invoke(main, ["simulate", str(job), "-o", str(tmp_path / "a.png"), *more])
    assert result.exit_code == 0, result.output
    assert result.output == f"{'picture':<24}{tmp_path / 'a.png'}\n{'images':<24}drawn for this picture\n"
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (60, 40)
    heat = ["--heat-map", str(tmp_path / "b.png")]
    result = CliRunner().invoke(main, ["simulate", str(job), "-o", str(tmp_path / "a.png"), *more, *heat])
    assert result.exit_code == 2
    assert "need a comparison, which there is only from the viewer's eye" in result.output
