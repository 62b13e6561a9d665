from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from rig import cube, panel, viewer
from tinyjob import write_tiny_job

from quiltcli.camera import camera_display
from quiltcli.cli import main
from quiltcli.draw import set_stage
from quiltcli.geometry import dot
from quiltcli.homography import eye_from_quilt
from quiltcli.job import load_job
from quiltcli.simulate import PictureOptions, simulate
from quiltcli.simulate.images import shown_images
from quiltcli.simulate.reference import _between, _resampled, pixel_pitch, resampled_light
from quiltcli.simulate.thirdperson import outline_points, third_person_camera, viewer_marks
from quiltcli.viewer import viewer_at

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
    back = np.linalg.inv(eye_from_quilt(*through, camera.eye)[0])
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


# --- what resampling costs ---


def staged(tmp_path, *sets):
    job = load_job(write_tiny_job(tmp_path), sets)
    stage = set_stage(job)
    who = viewer_at(job.viewer, 1)
    shown, _ = shown_images(stage, who, tmp_path / "none", "", 1)
    return stage, who, shown


def test_the_pitch_of_a_panel_seen_head_on(tmp_path):
    # 32 pixels a metre, 2 m away, before a picture of 20 rays to a slope of 1: 16 pixels to 10 rays.
    _, who, shown = staged(tmp_path)
    through = camera_display(who, 10, 10, 2 * np.degrees(np.arctan(0.25)))
    pitch = pixel_pitch(shown, who, through, np.zeros(100, np.int32), np.arange(100))
    np.testing.assert_allclose(pitch, 20 / 64, rtol=1e-9)


def test_the_pitch_of_a_slanted_panel_is_the_mean_of_its_axes(tmp_path):
    # The wall at x = 1 from (0, 0, 2): at (1, 0, 1) it is seen at 45°, at a depth of 1 metre.
    _, who, shown = staged(tmp_path)
    through = camera_display(who, 2001, 2001, 2 * np.degrees(np.arctan(1.2)))
    scale = 2001 / 2.4
    at = 1000 * 2001 + 1000 + round(scale)
    pitch = pixel_pitch(shown, who, through, np.ones(2001**2, np.int32), np.array([at]))
    # Slope x/z: a pixel of 1/32 m in depth moves it by 1/32 · 1/1², one upwards by 1/32 too.
    np.testing.assert_allclose(pitch, scale / 32, rtol=2e-3)


def test_resampling_at_pixel_centres_changes_nothing():
    image = np.arange(24, dtype=np.float32).reshape(1, 4, 6)
    rows, columns = _between(4, 4, 1.0), _between(6, 6, 1.0)
    assert (_resampled(image, rows, columns) == image).all()


def test_resampling_keeps_a_slope_and_the_middle():
    image = np.arange(8, dtype=np.float32).reshape(1, 1, 8) + np.zeros((1, 5, 1), np.float32)
    columns = _between(16, 8, 0.5)
    np.testing.assert_allclose(columns[1:-1], np.arange(1, 15) / 2 - 0.25)
    np.testing.assert_allclose(_resampled(image, _between(5, 5, 1.0), columns)[0, 2], columns)


def test_a_picture_as_dense_as_the_rays_is_the_direct_one(tmp_path):
    from quiltcli.simulate.picture import direct_light, visible_facets

    stage, who, shown = staged(tmp_path, "output.channels=[rgba]")
    through = camera_display(who, 32, 32, 2 * np.degrees(np.arctan(0.25)))  # 32 rays, 32 pixels
    facet = visible_facets(stage, who, through, 1)
    once = resampled_light(stage, who, shown, who, through, facet, 1)
    np.testing.assert_allclose(once, direct_light(stage, who, through, 1), atol=2e-4)
    nothing = np.full(facet.size, -1, np.int32)
    assert resampled_light(stage, who, shown, who, through, nothing, 1) is None


def test_the_figure_is_told_beside_the_display_s_own(tmp_path):
    job = write_tiny_job(tmp_path)
    more = ["--size", "60x40", "--supersample", "2", "-j", "1"]
    result = CliRunner().invoke(main, ["simulate", str(job), "-o", str(tmp_path / "a.png"), *more])
    assert result.exit_code == 0, result.output
    figures = {line[:24].strip(): line[24:].split()[0].rstrip(",") for line in result.output.splitlines()}
    own, once = float(figures["error, mean"]), float(figures["resampled once, mean"])
    assert 0.2 * once < own < 2 * once
