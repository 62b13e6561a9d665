"""Surfaces as shapes: where pixels are, and which way they face."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.charts.shapes import slopes
from quiltcli.charts.splines import basis
from tests.helpers.curved_jobs import SURFACES, chart_of, display_of


def centres(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)


def test_a_sphere_has_its_pixels_on_the_formula(tmp_path: Path) -> None:
    chart = chart_of("kind: sphere, radius: 2, at: [1, 2, 3]", tmp_path)
    x, y = centres(chart.size)
    a, b = np.pi * (2 * x / 64 - 1), np.pi * y / 32
    expected = 2 * np.stack((np.sin(b) * np.sin(a), np.cos(b), np.sin(b) * np.cos(a)))
    assert np.abs(chart.points(x, y) - expected - np.array([1, 2, 3])[:, None, None]).max() < 1e-14


@pytest.mark.parametrize("name", SURFACES)
def test_pictures_run_right_and_down_as_seen_from_the_lit_side(name: str, tmp_path: Path) -> None:
    chart = chart_of(SURFACES[name], tmp_path)
    x, y = centres(chart.size)
    normal = chart.normals(x, y)
    right = chart.points(x + 0.01, y) - chart.points(x - 0.01, y)
    down = chart.points(x, y + 0.01) - chart.points(x, y - 0.01)
    towards = (np.cross(down.T, right.T).T * normal).sum(axis=0)
    assert (towards > 0).all()
    assert np.abs((normal**2).sum(axis=0) - 1).max() < 1e-12


@pytest.mark.parametrize(
    "name", ["sphere", "dome", "cylinder", "cone", "torus", "superquadric", "paraboloid"]
)
def test_normals_that_are_known_are_those_of_differences(name: str, tmp_path: Path) -> None:
    chart = chart_of(SURFACES[name], tmp_path, more=", rotate_deg: [20, 30, 40]")
    s, t = np.meshgrid(np.linspace(0.03, 0.96, 31), np.linspace(0.04, 0.97, 29))
    along, down = slopes(chart.shape, s, t, (1e-6, 1e-6))
    across = np.cross(down.T, along.T).T
    unit = across / np.sqrt((across**2).sum(axis=0))
    assert np.abs(chart.normals(s * 64, t * 32) - chart.side * unit).max() < 1e-5


def test_a_torus_is_lit_outside_and_inside(tmp_path: Path) -> None:
    for side, sign in (("outside", 1), ("inside", -1)):
        chart = chart_of(f"kind: torus, radius: 1, tube: 0.3, lit: {side}", tmp_path)
        x, y = centres(chart.size)
        points = chart.points(x, y)
        ring = points * np.array([1, 0, 1])[:, None, None]
        ring /= np.sqrt((ring**2).sum(axis=0))
        assert (sign * ((points - ring) * chart.normals(x, y)).sum(axis=0) > 0.29).all()


def test_a_nurbs_arc_is_round(tmp_path: Path) -> None:
    chart = chart_of(SURFACES["nurbs"], tmp_path)
    x, y = centres(chart.size)
    points = chart.points(x, y)
    assert np.abs(np.hypot(points[0], points[2]) - 1).max() < 1e-14


def test_basis_functions_add_up_to_one_everywhere() -> None:
    knots = np.array([0, 0, 0, 0, 0.3, 0.3, 0.8, 1, 1, 1, 1.0])
    total = np.add.reduce(basis(knots, 3, np.linspace(-0.01, 1.01, 300)))
    assert np.abs(total - 1).max() < 1e-12


def test_a_bezier_patch_is_bernsteins(tmp_path: Path) -> None:
    chart = chart_of(
        "kind: bezier, points: [[[0, 1, 0], [1, 1, 3], [2, 1, 0]], [[0, 0, 0], [1, 0, 3], [2, 0, 0]]]",
        tmp_path,
    )
    x, y = centres(chart.size)
    s = x / 64
    assert np.abs(chart.points(x, y)[2] - 6 * s * (1 - s)).max() < 1e-14


def test_a_seam_is_found_and_goes_on_at_the_other_end(tmp_path: Path) -> None:
    chart = chart_of("kind: cylinder, radius: 1, height: 1", tmp_path)
    assert chart.wraps
    y = np.full(2, 7.5)
    beyond, inside = chart.points(np.array([-0.5, 64.5]), y), chart.points(np.array([63.5, 0.5]), y)
    assert (beyond == inside).all()
    assert not chart_of("kind: cylinder, radius: 1, height: 1, arc_deg: [0, 359]", tmp_path).wraps


def test_units_axes_and_the_displays_transform_place_a_surface(tmp_path: Path) -> None:
    line = "- {kind: sphere, radius: 100, pixels: [64, 32], at: [10, 20, 1 m]}"
    more = "units: cm\nup_axis: z\ntransform: {translate: [0, 0, 5]}\n"
    chart = display_of(line, tmp_path, more).charts[0]
    points = chart.points(*centres(chart.size)) - np.array([0.1, 1.0, 4.8])[:, None, None]
    assert np.abs(np.sqrt((points**2).sum(axis=0)) - 1).max() < 1e-12
    # The zenith of a sphere that was measured with z up is the world's.
    assert points[1, 0].min() > 0.99 or points[2, 0].max() < 1


def test_mirror_turns_columns_over(tmp_path: Path) -> None:
    plain, mirrored = (chart_of(SURFACES["cylinder"], tmp_path, more=more) for more in ("", ", mirror: true"))
    x, y = centres(plain.size)
    assert np.abs(mirrored.points(x, y) - plain.points(64 - x, y)).max() < 1e-14
    assert (mirrored.normals(x, y) == plain.normals(64 - x, y)).all()
