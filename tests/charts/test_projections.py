"""Projections as shapes: which way each pixel looks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.curved_jobs import PROJECTIONS, projection_of

FRONT, RIGHT, UP = np.array([0, 0, -1.0]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0])


def at(chart: object, s: float, t: float) -> np.ndarray:
    """The unit direction of a place of the picture."""
    w, h = chart.size  # type: ignore[attr-defined]
    found = chart.points(np.array([s * w]), np.array([t * h]))[:, 0]  # type: ignore[attr-defined]
    return found / np.sqrt(found @ found)


def test_a_dome_master_has_the_front_at_the_bottom_and_the_zenith_in_the_middle(tmp_path: Path) -> None:
    chart = projection_of("kind: dome_master", tmp_path)
    e = 1e-9
    for place, expected in (
        ((0.5, 0.5), UP),
        ((0.5, 1 - e), FRONT),
        ((0.5, e), -FRONT),
        ((e, 0.5), -RIGHT),
        ((1 - e, 0.5), RIGHT),
    ):
        assert np.abs(at(chart, *place) - expected).max() < 1e-7
    assert np.isnan(chart.points(np.array([1.0]), np.array([1.0]))).all()
    assert chart.mask is not None
    assert abs(chart.mask.mean() - np.pi / 4) < 0.01


def test_a_tilted_dome_leans_forward(tmp_path: Path) -> None:
    chart = projection_of("kind: dome_master, tilt_deg: 30", tmp_path)
    axis = at(chart, 0.5, 0.5)
    assert np.abs(axis - (UP * np.cos(np.pi / 6) + FRONT * np.sin(np.pi / 6))).max() < 1e-12


@pytest.mark.parametrize(
    ("mapping", "radius"),
    [
        ("equidistant", lambda a, f: a / (f / 2)),
        ("equisolid", lambda a, f: np.sin(a / 2) / np.sin(f / 4)),
        ("stereographic", lambda a, f: np.tan(a / 2) / np.tan(f / 4)),
        ("orthographic", lambda a, f: np.sin(a) / np.sin(f / 2)),
    ],
)
def test_lenses_have_their_radii(mapping: str, radius: object, tmp_path: Path) -> None:
    chart = projection_of(f"kind: fisheye, mapping: {mapping}, fov_deg: 160", tmp_path)
    for degrees in (30, 60):
        a = np.radians(degrees)
        r = radius(a, np.radians(160))  # type: ignore[operator]
        found = at(chart, 0.5 + r / 2, 0.5)
        assert np.abs(found - (FRONT * np.cos(a) + RIGHT * np.sin(a))).max() < 1e-12


def test_a_polynomial_lens_is_solved(tmp_path: Path) -> None:
    k1, k3 = 0.7, -0.03
    text = f"kind: fisheye, mapping: polynomial, polynomial: [{k1}, {k3}], fov_deg: 180"
    chart = projection_of(text, tmp_path)
    for degrees in (5, 30, 60, 80):
        a = np.radians(degrees)
        r = k1 * a + k3 * a**3
        assert abs(np.arccos(-at(chart, 0.5, 0.5 - r / 2)[2]) - a) < 1e-12


def test_cylinder_and_equirect_look_ahead_in_the_middle_and_right_at_three_quarters(tmp_path: Path) -> None:
    for name in ("cylinder", "equirect"):
        chart = projection_of(PROJECTIONS[name], tmp_path, (64, 32))
        assert np.abs(at(chart, 0.5, 0.5) - FRONT).max() < 1e-12
        assert np.abs(at(chart, 0.75, 0.5) - RIGHT).max() < 1e-12
        assert at(chart, 0.5, 0.2)[1] > 0
        assert chart.wraps


def test_positive_headings_turn_to_the_left(tmp_path: Path) -> None:
    chart = projection_of("kind: equirect, heading_deg: 90", tmp_path)
    assert np.abs(at(chart, 0.5, 0.5) + RIGHT).max() < 1e-12


@pytest.mark.parametrize("name", ["cross", "row"])
def test_a_cube_map_has_every_direction_once_and_upright_faces(name: str, tmp_path: Path) -> None:
    size = (64, 48) if name == "cross" else (96, 16)
    chart = projection_of(PROJECTIONS[name], tmp_path, size)
    cells = {"cross": [(1.5, 1.5), (2.5, 1.5), (1.5, 0.5)], "row": [(4.5, 0.5), (0.5, 0.5), (2.5, 0.5)]}[name]
    across, down = (4, 3) if name == "cross" else (6, 1)
    for (x, y), expected in zip(cells, (FRONT, RIGHT, UP), strict=True):
        assert np.abs(at(chart, x / across, y / down) - expected).max() < 1e-12
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    points = chart.points(x, y)
    known = np.isfinite(points[0])
    assert known.sum() == 6 * 16 * 16
    unit = (points / np.sqrt((points**2).sum(axis=0)))[:, known]
    assert np.abs(unit.mean(axis=1)).max() < 1e-9
    assert len(np.unique(np.round(unit.T, 9), axis=0)) == known.sum()


def test_strips_touch_and_lie_about_the_cylinder(tmp_path: Path) -> None:
    chart = projection_of("kind: cylinder, pieces: 12", tmp_path, (120, 40))
    x, y = np.linspace(0.01, 119.99, 997), np.full(997, 20.0)
    points = chart.points(x, y)
    far = np.hypot(points[0], points[2])
    assert far.max() / far.min() == pytest.approx(1 / np.cos(np.pi / 12), rel=1e-4)
    assert np.abs(np.diff(points, axis=1)).max() < 0.01


def test_a_mirror_ball_sees_ahead_and_almost_behind(tmp_path: Path) -> None:
    chart = projection_of("kind: mirror_ball", tmp_path)
    assert np.abs(at(chart, 0.5, 0.5) - FRONT).max() < 1e-12
    assert np.abs(at(chart, 0.5 + np.sqrt(0.5) / 2, 0.5) - RIGHT).max() < 1e-9
    assert at(chart, 1 - 1e-9, 0.5)[2] > 0.999
