"""Colours to tones: luminance, two colours, exposure and dwelling."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, nnls

from quiltcli.halftone.light import CYAN, ORANGE, dwell, expose, luminance, mixed, white_gain

TENT = np.array([ORANGE, CYAN])


def test_white_has_luminance_one_and_green_is_brightest() -> None:
    assert luminance(np.ones(3)) == pytest.approx(1, abs=1e-7)
    np.testing.assert_allclose(luminance(np.eye(3)), [0.2126, 0.7152, 0.0722], rtol=1e-6)


def test_shares_are_those_of_non_negative_least_squares() -> None:
    colours = np.random.default_rng(8).random((300, 3)) ** 2
    colours[:4] = [[1, 0, 0], [0, 0, 1], [0, 1, 0], [0, 0, 0]]
    for colour, shares in zip(colours, mixed(colours, TENT), strict=True):
        np.testing.assert_allclose(shares, nnls(TENT.T, colour)[0], atol=1e-12)


def test_what_is_left_over_is_square_to_the_colours_that_are_used() -> None:
    colours = np.random.default_rng(2).random((200, 3))
    shares = mixed(colours, TENT)
    left = colours - shares @ TENT
    along = left @ TENT.T
    assert np.abs(along[shares > 0]).max() < 1e-12
    assert (along[shares == 0] <= 1e-12).all()  # more of an unused colour would not help
    plain = np.maximum(np.linalg.lstsq(TENT.T, colours.T, rcond=None)[0].T, 0)
    cut = np.linalg.norm(colours - plain @ TENT, axis=1)
    assert (np.linalg.norm(left, axis=1) <= cut + 1e-12).all()
    assert (shares == 0).any()


def test_red_is_orange_alone_and_not_what_cutting_would_leave() -> None:
    shares = mixed(np.array([1.0, 0, 0]), TENT)
    assert shares == pytest.approx([0.94, 0], abs=5e-3)


def test_white_takes_more_cyan_than_there_is_unless_all_is_darker() -> None:
    white = mixed(np.ones(3), TENT)
    assert white[1] == pytest.approx(1.23, abs=0.01)
    assert (white * white_gain(TENT)).max() == pytest.approx(1)


def test_one_filter_shows_what_lies_along_its_colour() -> None:
    np.testing.assert_allclose(mixed(np.array([ORANGE, [0, 0, 0]]), TENT[:1]), [[1], [0]], atol=1e-7)


def test_exposure_cuts_at_white_and_says_how_much() -> None:
    tones = np.zeros((2, 4, 4), np.float32)
    tones[0, :2] = 0.6
    inside = np.ones((4, 4), np.bool_)
    inside[:, 3] = False
    found = expose(tones, inside, 2.0)
    assert found.clipped.tolist() == [0.5, 0]
    assert found.tones[0].max() == 1
    assert not found.tones[:, :, 3].any()
    assert expose(tones, inside, 0.5).tones[0, 0, 0] == np.float32(0.3)
    assert expose(tones, np.zeros((4, 4), np.bool_)).clipped.tolist() == [0, 0]


def test_what_dwells_longer_gets_a_darker_tone_and_none_a_brighter_one() -> None:
    x = np.linspace(-0.1, 0.1, 9)
    time = dwell(*np.meshgrid(x, x))
    assert time[4, 4] == 1
    inside = np.ones((9, 9), np.bool_)
    inside[0] = False
    tones = np.full((1, 9, 9), 0.8, np.float32)
    found = expose(tones, inside, 1.0, time).tones[0]
    seen = (found * time)[inside]
    np.testing.assert_allclose(seen, seen[0], rtol=1e-6)
    assert found.max() == pytest.approx(0.8)


def aside(theta: float, pixel: tuple[float, float], eye: tuple[float, float], height: float = 0.6) -> float:
    """Angle in plan from a pixel's fan to the line from its place on the mirror to an eye."""
    e = np.array([np.cos(theta), np.sin(theta)])
    ray = np.array(pixel)
    spot = height / (1 - e @ ray) * ray
    fan, look = spot + height * e, np.array(eye) - spot
    return float(np.arctan2(fan[0] * look[1] - fan[1] * look[0], fan @ look))


@pytest.mark.parametrize("pixel", [(0.0, 0.0), (0.1, 0.0), (-0.1, 0.02), (0.0, 0.1), (0.07, -0.07)])
def test_a_pixel_dwells_as_long_as_its_fan_takes_to_sweep_past_an_eye(pixel: tuple[float, float]) -> None:
    eye, step = (1e5, 0.0), 1e-5
    theta = float(brentq(lambda angle: aside(angle, pixel, eye), -1, 1, xtol=1e-14))
    speed = (aside(theta + step, pixel, eye) - aside(theta - step, pixel, eye)) / (2 * step)
    e, f = np.array([np.cos(theta), np.sin(theta)]), np.array([np.sin(theta), -np.cos(theta)])
    found = dwell(np.array(e @ pixel), np.array(f @ pixel))
    assert found == pytest.approx(1 / abs(speed), rel=1e-5)
