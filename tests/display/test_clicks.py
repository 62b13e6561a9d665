"""Projectors from marks on a spinning mirror."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quiltcli.display.clicks import calibrate, world_point
from quiltcli.errors import DisplayError
from quiltcli.geometry import FloatArray
from quiltcli.geometry.quaternions import exponential, matrices
from quiltcli.geometry.resection import Pinhole, decomposed, dlt
from quiltcli.job.calibration import CalibrationFile, ClickSpec

DOWN = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
SIDE = 0.04


def projector(*, mirrored: bool = False) -> Pinhole:
    """A projector 60 cm above the mirror, somewhat askew."""
    turn = matrices(exponential(np.array([[0.02, 0.03, -0.01]])))[0]
    centre, position = np.array([390.0, 380.0]), np.array([0.01, 0.6, -0.005])
    return Pinhole(3545.0, centre, turn @ DOWN, position, mirrored)


def marks() -> list[dict[str, Any]]:
    """Four corners of a mirror at two angles, which are the corners of a cube."""
    high = SIDE * 2**0.5
    places = [(u, v) for u in (-SIDE, SIDE) for v in (-high, high)]
    return [{"mirror_deg": float(angle), "at": at} for angle in (0, 180) for at in places]


def clicks(pinhole: Pinhole, sigma: float = 0.0, seed: int = 0, **more: Any) -> CalibrationFile:
    """A file of marks as a projector lights them, each off by `sigma` pixels."""
    rng = np.random.default_rng(seed)
    points = []
    for mark in marks():
        place = world_point(ClickSpec(**mark, pixel=(0.0, 0.0)), 45, 0)
        pixel = pinhole.project(place[None])[0] + rng.normal(0, 1, 2) * sigma
        points.append(ClickSpec(**mark, pixel=(float(pixel[0]), float(pixel[1]))))
    return CalibrationFile(image=(768, 768), points=tuple(points), **more)


def scene() -> FloatArray:
    """Points in a ball of 6 cm."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return np.asarray(0.06 * directions * rng.random((500, 1)) ** (1 / 3))


def test_corners_of_the_mirror_are_those_of_a_cube() -> None:
    corners = [world_point(ClickSpec(**mark, pixel=(0.0, 0.0)), 45, 0) for mark in marks()]
    np.testing.assert_allclose(np.abs(corners), SIDE, atol=1e-15)
    assert len({tuple(np.sign(corner)) for corner in corners}) == 8


def test_right_is_right_as_a_viewer_sees_it_and_up_is_up() -> None:
    """A viewer at +X looks along −X: −Z is to the right."""
    right = world_point(ClickSpec(mirror_deg=0.0, at=(0.1, 0.0), pixel=(0.0, 0.0)), 45, 0.02)
    np.testing.assert_allclose(right, [0, 0.02, -0.1], atol=1e-15)
    up = world_point(ClickSpec(mirror_deg=90.0, at=(0.0, 0.1), pixel=(0.0, 0.0)), 60, 0)
    np.testing.assert_allclose(up, [0, 0.1 * 0.75**0.5, -0.05], atol=1e-15)


@pytest.mark.parametrize("mirrored", [False, True])
def test_exact_marks_give_the_projector_back(mirrored: bool) -> None:
    true = projector(mirrored=mirrored)
    file = clicks(true)
    found = calibrate(file)
    assert found.distances.max() < 1e-9
    assert found.projector.mirrored == mirrored
    np.testing.assert_allclose(found.projector.position, true.position, atol=1e-12)
    np.testing.assert_allclose(found.projector.matrix, true.matrix, atol=1e-8)
    assert np.linalg.det(found.projector.rotation) == pytest.approx(1)
    # The direct transformation is as exact, before anything is refined.
    pixels = np.array([click.pixel for click in file.points])
    matrix, _ = dlt(found.points, pixels)
    intrinsics, pinhole = decomposed(matrix)
    np.testing.assert_allclose(pinhole.project(found.points), pixels, atol=1e-9)
    np.testing.assert_allclose(intrinsics, true.intrinsics, atol=1e-7)
    np.testing.assert_allclose(decomposed(-matrix)[1].matrix, pinhole.matrix, atol=1e-7)


def drawn_off(found: Pinhole, true: Pinhole) -> float:
    """How far points of a scene are drawn beside their places, pixels rms."""
    off = found.project(scene()) - true.project(scene())
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def test_clicks_that_are_half_a_pixel_off_draw_scenes_no_worse() -> None:
    true = projector()
    files = [clicks(true, 0.5, seed) for seed in range(40)]
    found = [calibrate(file) for file in files]
    off = [drawn_off(one.projector, true) for one in found]
    known = [
        calibrate(file.model_copy(update={"free": ("f", "rotation", "position"), "centre": (390.0, 380.0)}))
        for file in files
    ]
    assert np.mean(off) <= 0.7
    assert np.mean([drawn_off(one.projector, true) for one in known]) < np.mean(off)
    assert all(one.deviation[1] == one.deviation[2] == 0 for one in known)
    # What is said of the uncertainty is what chance makes of it.
    heights = [one.projector.position[1] for one in found]
    said = np.mean([one.deviation[7] for one in found])
    assert said == pytest.approx(np.std(heights), rel=0.3)
    focal = np.mean([one.deviation[0] for one in found])
    assert focal == pytest.approx(np.std([one.projector.focal for one in found]), rel=0.3)


def test_what_is_fixed_stays() -> None:
    file = clicks(projector(), 0.3, free=("rotation", "position"), f=3500.0)
    found = calibrate(file)
    assert found.projector.focal == 3500
    assert found.projector.centre.tolist() == [384, 384]
    assert found.deviation[:3].tolist() == [0, 0, 0]
    assert found.rms < 1


def test_points_of_a_plane_leave_the_projector_open() -> None:
    still = tuple(
        ClickSpec(mirror_deg=0.0, at=(u, v), pixel=(300.0 + 900 * u, 300.0 - 800 * v))
        for u in (-0.04, 0, 0.04)
        for v in (-0.04, 0.03)
    )
    with pytest.raises(DisplayError, match="all lie in one plane"):
        calibrate(CalibrationFile(image=(768, 768), points=still))


def test_points_that_fit_two_projectors_are_refused() -> None:
    """Points of a plane and a line through the projector are seen alike from all along the line."""
    centre = np.array([0.0, 0.6, 0.0])
    plane = [(-0.04, 0, -0.04), (0.04, 0, -0.04), (0.04, 0, 0.04), (-0.04, 0, 0.04), (0.0, 0, 0.02)]
    line = [tuple((1 - t) * np.array([0.02, 0, 0.01]) + t * centre) for t in (0.05, 0.1)]
    pinhole = Pinhole(3545.0, np.array([384.0, 384.0]), DOWN, centre)
    places = np.array([*plane, *line])
    points = tuple(
        ClickSpec(world=(x, y, z), pixel=(u, v))
        for (x, y, z), (u, v) in zip(places.tolist(), pinhole.project(places).tolist(), strict=True)
    )
    with pytest.raises(DisplayError, match="leave the projector open"):
        calibrate(CalibrationFile(image=(768, 768), points=points))
