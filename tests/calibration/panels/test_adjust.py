"""Bundle adjustment: slopes, truth found again, honest uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("cv2")

from quiltcli.calibration.panels.adjust import Bundle, Corners, _slopes, residuals
from quiltcli.calibration.panels.camera import Camera, projected
from quiltcli.calibration.panels.solve import solve
from tests.calibration.panels.made_up import made_up
from tests.helpers.photos import camera


def errors(case, found):
    """Metres and degrees (K,) by which facets are off."""
    bundle = found.motions
    turned = Rotation.from_rotvec(bundle[:, :3]) * Rotation.from_rotvec(case.turns).inv()
    return np.linalg.norm(bundle[:, 3:] - case.shifts, axis=1), np.degrees(turned.magnitude())


def test_slopes_of_the_camera_are_differences():
    rng = np.random.default_rng(1)
    points = rng.uniform((-1, -1, 1), (1, 1, 3), (40, 3))
    lens = camera()
    _, by_points, by_camera = projected(lens, points)
    for k in range(3):
        step = np.eye(3)[k] * 1e-6
        change = (projected(lens, points + step)[0] - projected(lens, points - step)[0]) / 2e-6
        np.testing.assert_allclose(by_points[:, :, k], change, rtol=1e-6, atol=1e-4)
    for k, size in enumerate((1e-2, 1e-2, 1e-2, 1e-6, 1e-6, 1e-6, 1e-6)):
        step = np.eye(7)[k] * size
        above, below = (lens.with_numbers(lens.numbers + sign * step) for sign in (1, -1))
        change = (projected(above, points)[0] - projected(below, points)[0]) / (2 * size)
        np.testing.assert_allclose(by_camera[:, :, k], change, rtol=1e-5, atol=1e-4)


def test_slopes_of_all_that_is_sought_are_differences():
    rng = np.random.default_rng(2)
    corners = Corners(
        np.array([0, 0, 1, 1, 1]),
        np.array([0, 1, 2, 1, 0]),
        rng.uniform(-1, 1, (5, 3)),
        rng.uniform(0, 1000, (5, 2)),
    )
    photos = np.concatenate((rng.normal(size=(2, 3)), [[0.1, 0.2, 4.0], [0.3, -0.2, 5.0]]), axis=1)
    bundle = Bundle(camera(), photos, 0.1 * rng.normal(size=(3, 6)), rng.normal(size=(3, 3)), 1, free=True)
    slopes, numbers = _slopes(bundle, corners).toarray(), bundle.numbers
    assert slopes.shape == (10, numbers.size)
    for k in range(numbers.size):
        step = np.zeros(numbers.size)
        step[k] = 1e-6 * max(1.0, abs(numbers[k]))
        above, below = (residuals(bundle.with_numbers(numbers + sign * step), corners) for sign in (1, -1))
        change = (above - below).reshape(-1) / (2 * step[k])
        np.testing.assert_allclose(slopes[:, k], change, rtol=2e-5, atol=2e-3)


def test_without_noise_the_truth_is_found():
    case = made_up(noise=0.0, views=8)
    found = solve(case.facets, case.markers, case.seen, anchor=1)
    metres, degrees = errors(case, found)
    assert metres.max() < 1e-8
    assert degrees.max() < 1e-6
    np.testing.assert_allclose(found.camera.numbers, case.lens.numbers, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("name", "metre"), [("cube5", 1.0), ("cave5", 3.0)])
def test_noise_and_outliers_leave_a_fifth_of_a_millimetre_at_a_metre(name, metre):
    case = made_up(name, seed=3, outliers=3)
    found = solve(case.facets, case.markers, case.seen, anchor=1)
    metres, degrees = errors(case, found)
    assert metres.max() < 0.0002 * metre
    assert degrees.max() < 0.05
    assert found.adjusted.deviation == pytest.approx(0.3, rel=0.1)
    assert 3 <= (~found.adjusted.used).sum() <= 12


def test_a_display_put_up_loosely_is_found():
    case = made_up(seed=4, wrong=(0.06, 10.0))
    found = solve(case.facets, case.markers, case.seen, anchor=1)
    metres, degrees = errors(case, found)
    assert metres.max() < 0.0004
    assert degrees.max() < 0.1


def test_a_known_camera_is_left_as_it_is():
    case = made_up(seed=5, views=8)
    found = solve(case.facets, case.markers, case.seen, case.lens, anchor=1)
    assert found.camera is case.lens
    assert errors(case, found)[0].max() < 0.0005
    assert not found.adjusted.camera_deviation.any()


@pytest.mark.parametrize("trials", [8, pytest.param(200, marks=pytest.mark.long)])
def test_uncertainty_is_honest(trials):
    """Errors are within two standard deviations nine times in ten or more, and not always."""
    within = []
    for seed in range(trials):
        case = made_up(seed=seed, outliers=3)
        found = solve(case.facets, case.markers, case.seen, anchor=1)
        bundle = found.adjusted.bundle.facets
        shift = np.abs(bundle[1:, 3:] - case.shifts[1:]) / found.shift_deviation[1:]
        within.append(shift < 2)
    share = np.mean(within)
    assert share >= 0.85 if trials < 100 else 0.9 <= share <= 0.99


def test_another_facet_can_be_the_anchor():
    case = made_up(seed=6, noise=0.0, views=8)
    found = solve(case.facets, case.markers, case.seen, anchor=3)
    assert found.anchor == 3
    assert not found.adjusted.bundle.facets[2].any()
    # The others stand to each other as they do.
    turns = Rotation.from_rotvec(found.adjusted.bundle.facets[:, :3])
    between = (turns[0].inv() * turns[1]).as_rotvec()
    truth = Rotation.from_rotvec(case.turns)
    np.testing.assert_allclose(between, (truth[0].inv() * truth[1]).as_rotvec(), atol=1e-7)


def test_a_camera_of_other_photos_is_refused():
    case = made_up(views=4)
    other = Camera((800, 600), case.lens.focal, case.lens.centre, case.lens.distortion)
    with pytest.raises(ValueError, match=r"the camera's photos are 800 × 600 pixels, these are 4000 × 3000"):
        solve(case.facets, case.markers, case.seen, other)
