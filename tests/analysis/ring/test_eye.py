"""What an eye sees of a spinning mirror: the closed forms of Jones et al., and whole pictures."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from quiltcli.analysis.ring.content import content_lines
from quiltcli.analysis.ring.eye import Image, best_angle, camera_at, light_path, look, on_plane
from quiltcli.analysis.ring.simulate import EyeOptions, eye_place, look_at_display, ray_errors
from quiltcli.geometry import FloatArray, normalized
from quiltcli.job import load_job
from quiltcli.render.ring.setup import set_ring_stage
from quiltcli.render.ring.walk import RingOptions, render_turns
from quiltcli.ring.curve import Curve
from quiltcli.ring.maps import backward
from quiltcli.ring.plane import pixels_of
from quiltcli.ring.seen import slices_seen
from quiltcli.ring.tones import dwell_times
from tests.helpers.ring_job import ring_job
from tests.helpers.ring_scenes import rig

SIZE = (96, 96)
DISPLAY = rig(SIZE)
HIGH = 0.0
WIDE = rig((512, 512))


def shown(eye: FloatArray, points: FloatArray, kind: str, curve: Curve, cone: bool = False) -> FloatArray:
    """Origins and directions (2, N, 3) of the rays that an eye is shown where it looks at points (N, 3)."""
    display = rig((512, 512), cone=cone)
    along = normalized(points - eye)
    found = []
    for angle, ray in zip(best_angle(display, eye, along), along, strict=True):
        pose = display.at(float(angle))
        mirror = on_plane(pose, pose.from_world(eye), pose.axes @ ray)
        lines = content_lines(kind, pose, curve, *pixels_of(pose, mirror[:, None]))
        found.append((lines.eye[0], lines.along[0]))
    return np.array(found).transpose(1, 0, 2)


@pytest.mark.parametrize("cone", [False, True])
@pytest.mark.parametrize("place", [(40.0, 0.4, 1.0), (200.0, 0.3, 0.56), (0.0, 1.0, 3.0)])
def test_an_eye_on_the_ring_is_shown_the_ray_it_looks_along(
    place: tuple[float, float, float], cone: bool
) -> None:
    eye, rng = eye_place(place), np.random.default_rng(4)
    points = rng.uniform(-0.04, 0.04, (20, 3))
    origin, along = shown(eye, points, "mcop", Curve(place[1], place[2]), cone)
    missed = np.cross(points - origin, along)
    assert np.abs(missed).max() < 1e-12


@pytest.mark.parametrize(
    ("kind", "depth", "ratio"),
    [
        *(("mcop", depth, 1.0) for depth in (0.04, 0.0, -0.04)),
        *(("diffuse", depth, ratio) for depth, ratio in ((0.04, 1.116), (0.0, 0.992), (-0.04, 0.900))),
        *(("perspective", depth, ratio) for depth, ratio in ((0.04, 1.116), (0.0, 0.992), (-0.04, 0.900))),
    ],
)
def test_sizes_are_off_as_in_figure_7(kind: str, depth: float, ratio: float) -> None:
    """How wide a bar looks in a picture by another map, over how wide it should."""
    eye, curve = np.array([1.0, HIGH, 0.0]), Curve(HIGH, 1.0)
    width = _seen_at(eye, np.array([depth, 0.0, 0.005]), kind, curve) - _seen_at(
        eye, np.array([depth, 0.0, -0.005]), kind, curve
    )
    right = 0.01 / (1 - depth)
    assert width[1] / right == pytest.approx(ratio, rel=0.01)


@pytest.mark.parametrize(
    ("kind", "height", "ratio"),
    [("perspective", 0.16, 1.14), ("perspective", 0.7, 1.39), ("mcop", 0.7, 1), ("diffuse", 0.7, 1)],
)
def test_heights_are_off_in_plain_perspective(kind: str, height: float, ratio: float) -> None:
    eye, curve = np.array([1.0, height, 0.0]), Curve(height, 1.0)
    upper, lower = (_seen_at(eye, np.array([0, y, 0.0]), kind, curve) for y in (0.002, -0.002))
    view = math.atan(height)
    should = np.tan([view + 0.0]) * 0 + _angle(eye, 0.002) - _angle(eye, -0.002)
    assert (upper[0] - lower[0]) / float(should[0]) == pytest.approx(ratio, rel=0.03)


def _angle(eye: FloatArray, y: float) -> float:
    return math.atan2(y - eye[1], eye[0])


def _seen_at(eye: FloatArray, point: FloatArray, kind: str, curve: Curve) -> FloatArray:
    """Elevation and tangent of the azimuth under which an eye sees the image of a point, by search."""
    goal = np.array([_angle(eye, point[1]), point[2] / (eye[0] - point[0])])
    at = goal.copy()
    for _ in range(30):
        directions = [at, at + (1e-5, 0), at + (0, 1e-5)]
        rays = np.array([_direction(u, v) for u, v in directions])
        origin, along = shown(eye, eye + rays, kind, curve)
        offset = point - origin
        # Where each ray passes the point's upright plane across the axis.
        share = offset[:, 0] / along[:, 0]
        missed = (origin + share[:, None] * along - point)[:, 1:]
        slopes = np.stack((missed[1] - missed[0], missed[2] - missed[0]), axis=1) / 1e-5
        step = np.linalg.solve(slopes, missed[0])
        at = at - step
        if np.abs(step).max() < 1e-10:
            break
    return at


def _direction(elevation: float, side: float) -> FloatArray:
    return normalized(np.array([-1.0, math.tan(elevation), side]))


@pytest.mark.parametrize(("distance", "slices"), [(0.56, 20.6), (3.0, 11.9), (1000.0, 10.0)])
def test_as_many_slices_are_seen_as_the_closed_form_says(distance: float, slices: float) -> None:
    assert slices_seen(DISPLAY, distance) == pytest.approx(slices, abs=0.05)
    height = 0.3 * distance
    camera = camera_at(np.array([distance, height, 0.0]), 0.07, (96, 96))
    lit = np.ones(SIZE[::-1], dtype=bool)
    seen = look(DISPLAY, camera, lambda position, side: Image(np.ones((*lit.shape, 1)), lit))
    assert abs(len(seen.positions) - slices) <= 2
    assert float(seen.images[seen.images > 0].mean()) == pytest.approx(2, abs=0.1)
    covered = seen.weight > 0.5
    assert np.allclose(seen.light[covered], 1)


def test_slits_across_and_upright_are_sharp_at_the_point_and_on_the_mirror() -> None:
    """Figure 12: eyes beside one another see a point where it is, eyes above one another on the mirror."""
    curve, point = Curve(0.4, 1.0), np.array([-0.04, 0.01, 0.02])
    beside = [eye_place((turn, 0.4, 1.0)) for turn in (-1.0, 1.0)]
    for eye in beside:
        origin, along = shown(eye, point[None], "mcop", curve)
        assert np.abs(np.cross(point - origin[0], along[0])).max() < 1e-9
    # Above one another: a pixel sends its ray to all heights, so all meet where it lights the mirror.
    eye = eye_place((0.0, 0.4, 1.0))
    angle = float(best_angle(WIDE, eye, normalized(point - eye)[None])[0])
    pose = WIDE.at(angle)
    mirror = on_plane(pose, pose.from_world(eye), pose.axes @ normalized(point - eye))
    higher = eye + (0, 0.02, 0)
    other = float(best_angle(WIDE, higher, normalized(pose.to_world(mirror) - higher)[None])[0])
    assert other == pytest.approx(angle, abs=1e-9)


def test_pixels_dwell_on_a_viewer_as_long_as_the_closed_form_says() -> None:
    """The time between a pixel's fan beginning and ceasing to reach an eye far away, by light_path."""
    camera = camera_at(np.array([1e4, 4e3, 0.0]), 0.07, (9, 9))
    pose = WIDE.at(0.0)
    lit = np.zeros((512, 512), dtype=bool)
    for row, column in ((130, 256), (380, 300)):
        lit[:] = False
        lit[row, column] = True
        turns = np.linspace(-0.1, 0.1, 801)
        near = []
        for turn in turns:
            where = WIDE.at(float(turn))
            mirror = backward(where, Curve(4e3, 1e4), np.array([column + 0.5]), np.array([row + 0.5])).mirror[
                :, 0
            ]
            out = where.from_world(camera.eye) - mirror
            across = mirror[0] * out[1] - mirror[1] * out[0]
            near.append(abs(math.atan2(across, mirror[0] * out[0] + mirror[1] * out[1])) < WIDE.lobe)
        middle = turns[near].mean()
        time = np.count_nonzero(near) * (turns[1] - turns[0]) / (2 * WIDE.lobe)
        share = float(dwell_times(WIDE.at(float(middle)), lit)[0])
        assert time == pytest.approx(share, rel=0.01)
    assert light_path(WIDE, pose, camera)[2].max() > 0.9


CHECKERS = """\
quilt_scene: 1
objects:
- {mesh: ball.obj, material: {color: [0.3, 0.3, 0.3], unlit: true}}
- {mesh: marks.obj, material: {color: [0.7, 0.7, 0.7], unlit: true}}
"""


@pytest.fixture(scope="module")
def checkered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A job whose scene is a ball of dark and bright facets, and a block of both."""
    job = ring_job(tmp_path_factory.mktemp("checkers"), size=400, positions=288)
    lines = (job.parent / "ball.obj").read_text().splitlines()
    vertices = [line for line in lines if line.startswith("v")]
    faces = [line for line in lines if line.startswith("f")]
    for name, part in (("ball.obj", faces[::2]), ("marks.obj", faces[1::2])):
        (job.parent / name).write_text("\n".join([*vertices, *part]) + "\n")
    (job.parent / "scene.yaml").write_text(CHECKERS)
    return job


def test_pictures_are_right_where_other_maps_are_not(checkered: Path) -> None:
    job = load_job(checkered)
    psnr = {}
    for content in ("mcop", "diffuse", "perspective"):
        options = EyeOptions((25.0, 0.4, 1.0), (64, 64), content, tones=True)
        found = look_at_display(job, 1, options)
        assert found.comparison is not None
        psnr[content] = found.comparison.psnr
    assert psnr["mcop"] >= 28
    assert psnr["mcop"] >= psnr["diffuse"] + 8
    assert psnr["mcop"] >= psnr["perspective"] + 15


@pytest.mark.long
def test_whoever_stands_elsewhere_sees_right_where_they_are_tracked(checkered: Path) -> None:
    options = EyeOptions((30.0, 0.1, 0.6), (64, 64), tones=True)
    plain = look_at_display(load_job(checkered), 1, options)
    user = "ring.users=[{azimuth_deg: 30, height: 0.1, distance: 0.6}]"
    tracked = look_at_display(load_job(checkered, [user]), 1, options)
    assert plain.comparison is not None
    assert tracked.comparison is not None
    assert tracked.comparison.psnr >= 28
    assert tracked.comparison.psnr > plain.comparison.psnr + 5
    assert tracked.error[0] < 1e-9 < plain.error[0]


def test_bits_of_a_render_are_looked_at_where_there_are_some(tmp_path: Path) -> None:
    job = load_job(ring_job(tmp_path, size=64, positions=48, lobe=8))
    options = EyeOptions((0.0, 0.4, 1.0), (32, 32))
    before = look_at_display(job, 1, options)
    render_turns(job, RingOptions(workers=1))
    after = look_at_display(job, 1, options)
    assert np.array_equal(before.picture, after.picture)
    for path in (tmp_path / "out" / "packed").iterdir():
        path.unlink()
        break
    stage = set_ring_stage(job)
    camera = camera_at(eye_place((0.0, 0.4, 1.0)), 0.07, (8, 8))
    assert ray_errors(stage, stage.show(1), camera, "mcop")[0] < 1e-9
