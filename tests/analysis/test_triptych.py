"""The triptych: direct, from the eye, unfolded; and a viewer who walks, seen by somebody who stands."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.analysis.simulate.lookup import Shown
from quiltcli.analysis.simulate.thirdperson import HEAD, third_person_camera, viewer_marks
from quiltcli.analysis.simulate.unfolded import unfold
from quiltcli.cli import main
from quiltcli.job import load_job
from quiltcli.projection.camera import camera_display
from quiltcli.projection.planar import eye_from_quilt
from quiltcli.render.buffers import new_buffers
from quiltcli.render.setup import set_stage
from tests.helpers.curved_jobs import curved_job
from tests.helpers.in_memory import cube, icosphere, viewer
from tests.helpers.tiny_job import write_tiny_job

SIZE = (90, 60)


def size_of(name: str) -> tuple[int, int]:
    with Image.open(name) as picture:
        return picture.size


def painted(stage) -> Shown:
    """Every facet in a colour of its own: the number of the facet in red, its own x in green, y in blue."""
    buffers = new_buffers(stage)
    layout, start = stage.layout, 0
    for page, (width, height) in enumerate(layout.pages.tolist()):
        y, x = np.mgrid[0:height, 0:width] + 0.5
        owner = np.abs(stage.owners[start : start + width * height].reshape(height, width))
        for row in np.flatnonzero(layout.page == page).tolist():
            inverse = np.linalg.inv(np.vstack((layout.quilt_from_facet[row], [0, 0, 1])))
            i, j = (inverse[k, 0] * x + inverse[k, 1] * y + inverse[k, 2] for k in range(2))
            mine = owner == row + 1
            for name, value in zip("RGB", ((row + 1.0) + 0 * i, i / 64, j / 64), strict=True):
                buffers[name][start : start + width * height].reshape(height, width)[mine] = value[mine]
        start += width * height
    lit = np.ones(stage.facets.count, dtype=np.bool_)
    return Shown(stage.facets, layout, lit, buffers, stage.owners, np.array([0.0, 0, 2]))


def test_walls_around_a_corner_unfold_side_by_side_and_upright(tmp_path):
    stage = set_stage(load_job(write_tiny_job(tmp_path)))
    picture = unfold(stage.facets, stage.layout, SIZE).picture(painted(stage))
    # Two walls of 2 × 2 m make a strip of 4 × 2: 84.6 × 42.3 of 90 × 60 pixels.
    back, right = (np.abs(picture[..., 0] - k) < 0.01 for k in (1, 2))
    assert abs(back.sum() - 42.3**2) < 120
    assert abs(right.sum() - 42.3**2) < 120
    assert np.flatnonzero(back.any(axis=0)).max() < np.flatnonzero(right.any(axis=0)).min() + 2
    for wall in (back, right):
        rows, columns = np.nonzero(wall)
        inner = picture[rows.min() + 2 : rows.max() - 1, columns.min() + 2 : columns.max() - 1]
        steps = 64 / 42.3 / 64
        assert np.diff(inner[..., 1], axis=1) == pytest.approx(steps, abs=4e-3)  # rasters of 64 pixels
        assert np.diff(inner[..., 2], axis=0) == pytest.approx(steps, abs=4e-3)
        assert np.abs(np.diff(inner[..., 1], axis=0)).max() < 4e-3


def test_a_curved_display_unfolds_to_its_raster(tmp_path):
    points, faces = icosphere(1)
    keys = "kind: cylinder, radius: 2, height: 1, arc_deg: [-60, 60], lit: inside, pixels: [96, 24]"
    text = f"surfaces:\n- {{{keys}}}\n"
    job = curved_job(tmp_path, text, (points, faces), (0, 0, 1), (0, 0, 2))
    stage = set_stage(job)
    picture = unfold(stage.facets, stage.layout, SIZE).picture(painted(stage))
    shown = np.abs(picture[..., 0] - 1) < 0.01
    rows, columns = np.nonzero(shown)
    wide, high = np.ptp(columns) + 1, np.ptp(rows) + 1
    assert wide / high == pytest.approx(4, abs=0.25)
    line = picture[int(rows.mean()), columns.min() + 2 : columns.max() - 1]
    assert np.diff(line[:, 1]) == pytest.approx(96 / wide / 64, abs=5e-3)


def test_a_triptych_is_three_pictures_beside_each_other(tmp_path):
    job = load_job(write_tiny_job(tmp_path))
    alone = next(simulate(job, [2], PictureOptions(SIZE, threads=1)))
    three = next(simulate(job, [2], PictureOptions(SIZE, threads=1, triptych=True)))
    assert three.picture.shape == (60, 3 * 90 + 2 * 8, 3)
    assert (three.picture[:, :90] == alone.direct).all()
    assert (three.picture[:, 98:188] == alone.picture).all()
    assert not three.picture[:, 90:98].any()
    assert three.comparison is not None
    assert alone.comparison is not None
    assert three.comparison.mean == alone.comparison.mean
    bare = next(simulate(job, [2], PictureOptions(SIZE, threads=1, triptych=True, compare=False)))
    assert bare.comparison is None
    assert (bare.picture == three.picture).all()


def test_the_command_writes_triptychs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_tiny_job(tmp_path)
    arguments = ["simulate", "job.yaml", "-f", "2", "-o", "t.####.png", "--triptych"]
    run = CliRunner().invoke(main, [*arguments, "--supersample", "1"])
    assert run.exit_code == 0, run.output
    assert size_of("t.0002.png") == (3 * 640 + 16, 480)
    run = CliRunner().invoke(main, ["simulate", "job.yaml", "-o", "s.png", "--triptych", "--size", "80x60"])
    assert run.exit_code == 0, run.output
    assert size_of("s.png") == (3 * 80 + 16, 60)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--triptych", "--third-person"], "expected no --third-person beside it"),
        (["--triptych", "--from", "1,2,3"], "expected no --from beside it"),
        (["--head"], "give --third-person too"),
    ],
)
def test_kinds_of_pictures_that_exclude_each_other(tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    write_tiny_job(tmp_path)
    run = CliRunner().invoke(main, ["simulate", "job.yaml", "-o", "t.png", *options])
    assert run.exit_code == 2
    assert words in run.output


def test_who_sees_a_viewer_walk_stands_still_and_sees_every_place(tmp_path):
    eyes = np.array([[-2.0, 0.3, 4], [0, 0.3, 5], [2.5, 0.3, 3]])
    cameras = [
        third_person_camera(viewer(tuple(eye)), cube(), None, None, 4 / 3, eyes, head=True) for eye in eyes
    ]
    for camera, fov in cameras:
        assert (camera.eye == cameras[0][0].eye).all()
        assert (camera.look == cameras[0][0].look).all()
        assert fov == cameras[0][1]
    camera, fov = cameras[0]
    through = camera_display(camera, 400, 300, fov)
    back = np.linalg.inv(eye_from_quilt(through[1], camera.eye)[0])
    for point in (*cube().corners, *eyes):
        x, y, w = back @ (point - camera.eye)
        assert w > 0
        assert 0 < x / w < 400
        assert 0 < y / w < 300


def test_a_head_is_behind_the_eye_and_as_large_as_heads_are():
    who = viewer((0.0, 1.6, 3.0), (0, 1.6, 0))
    bare = viewer_marks(who, np.zeros((0, 3)), 0.01, 0.001)
    marks = viewer_marks(who, np.zeros((0, 3)), 0.01, 0.001, head=True)
    head = marks.vertices[13 * 25 : len(marks.vertices) - (len(bare.vertices) - 13 * 25)]
    assert np.ptp(head, axis=0) == pytest.approx(2 * np.array(HEAD), rel=0.02)
    assert head[:, 2].min() == pytest.approx(3.0, abs=1e-3)  # its front is where the eye is
    assert head[:, 2].max() == pytest.approx(3.0 + 2 * HEAD[2], abs=1e-3)


def test_a_head_shows_in_the_picture(tmp_path):
    job = load_job(write_tiny_job(tmp_path))
    pictures = [
        next(simulate(job, [1], PictureOptions(SIZE, threads=1, third_person=True, head=head))).picture
        for head in (False, True)
    ]
    assert (np.abs(pictures[0] - pictures[1]).max(axis=-1) > 0.02).sum() > 10
