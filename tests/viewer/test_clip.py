"""What near and far cut: planes before the eye, or spheres about it."""

from dataclasses import replace

import numpy as np
import pytest

from quiltcli.errors import JobError
from quiltcli.render.setup import set_stage
from quiltcli.viewer.clip import cut_polygon, polygon_area, share_behind
from tests.analysis.test_verify_hard import soup
from tests.helpers.in_memory import CUBE, CUBE_FACES
from tests.helpers.verified_jobs import cube_job, found, shoot, write_job


def inside_a_cube(folder, more="", eye=(0.2, 0.1, 0.15)):
    """Triangles around a viewer who stands in a cube lit on its inside, and looks along +Z."""
    at = (eye[0], eye[1], eye[2] + 1)
    return write_job(
        folder, (CUBE, CUBE_FACES), soup(300, 5), eye, at, near=0.05, far=40, side="back", more=more
    )


def drawn(job):
    """Share of the lit pixels that show something, and the depths they show."""
    shot = shoot(job)
    z = shot.images.channels["Z"][shot.stage.owners > 0]
    return np.isfinite(z).mean(), z[np.isfinite(z)]


def test_by_itself_a_display_around_the_viewer_is_drawn_all_around(tmp_path):
    assert set_stage(inside_a_cube(tmp_path)).clip == "distance"
    share, depth = drawn(inside_a_cube(tmp_path))
    front, ahead = drawn(inside_a_cube(tmp_path, "render: {clip: planar}\n"))
    assert share > 1.3 * front
    assert depth.min() < -0.5
    assert ahead.min() >= 0.05


@pytest.mark.parametrize("depth", ["planar", "radial"])
def test_rays_find_nothing_wrong_all_around(tmp_path, depth):
    verdict = shoot(inside_a_cube(tmp_path, f"render: {{clip: distance, depth: {depth}}}\n")).verify()
    assert found(verdict) == {}, verdict.faults[:3]
    assert verdict.seams.counts["points_compared"] > 20


def test_planes_may_cut_distances(tmp_path):
    job = inside_a_cube(tmp_path, "render: {clip: planar, depth: radial}\n")
    verdict = shoot(job).verify()
    assert found(verdict) == {}, verdict.faults[:3]
    share, _ = drawn(job)
    assert share < 0.9


def test_a_display_ahead_of_the_viewer_is_cut_by_planes(tmp_path):
    stage = set_stage(cube_job(tmp_path))
    assert stage.clip == "planar"
    assert [viewer.clip for view in stage.views([1]) for viewer in view.viewers] == ["planar"]


@pytest.mark.parametrize(
    "more", ["output: {channels: [zv]}\n", "render: {depth_bits: 24}\n", "render: {method: offaxis}\n"]
)
def test_what_lies_between_planes_is_cut_by_planes(tmp_path, more):
    assert set_stage(inside_a_cube(tmp_path, more)).clip == "planar"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("render: {clip: distance}\noutput: {channels: [zv]}\n", "zv lies between a near and a far plane"),
        ("render: {clip: distance, depth_bits: 24}\n", "depth_bits needs a near and a far plane"),
        ("render: {clip: distance, method: raskar}\n", "method: raskar needs a near and a far plane"),
    ],
)
def test_what_lies_between_planes_cannot_be_cut_by_distance(tmp_path, more, words):
    with pytest.raises(JobError, match=words):
        inside_a_cube(tmp_path, more)


def test_half_of_a_cube_about_the_eye_lies_behind_it(tmp_path):
    stage = set_stage(inside_a_cube(tmp_path))
    [view] = stage.views([1])
    middle = replace(view.viewer, eye=np.zeros(3))
    assert share_behind(stage.facets, middle) == pytest.approx(0.5, abs=1e-12)
    # A quarter of the way from the middle: the face behind, and 1/4 of a half more of the four at the sides.
    forward = replace(view.viewer, eye=np.array([0, 0, 0.25]))
    assert share_behind(stage.facets, forward) == pytest.approx((1 + 4 * 0.625) / 6, abs=1e-12)


def test_a_polygon_is_cut_where_the_value_changes_its_sign():
    square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    assert polygon_area(cut_polygon(square, square[:, 0] - 1)) == pytest.approx(4)
    assert polygon_area(cut_polygon(square, square[:, 0] + 1)) == 0
    assert polygon_area(cut_polygon(square, square[:, 0] - 9)) == 16
