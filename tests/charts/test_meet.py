"""Rays that meet curved surfaces: Newton's steps against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quiltcli.charts.meet import meet, net
from tests.helpers.curved_jobs import chart_of


def aimed(chart: object, seed: int, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Facet pixels that the eye sees, the rays to them, and guesses beside them."""
    random = np.random.default_rng(seed)
    width, height = chart.size  # type: ignore[attr-defined]
    place = random.uniform((0.02 * width, 0.05 * height), (0.98 * width, 0.95 * height), (4000, 2)).T
    points = chart.points(*place)  # type: ignore[attr-defined]
    seen = chart.towards(*place, points, eye) > 0.05  # type: ignore[attr-defined]
    rays = (points - eye[:, None])[:, seen]
    guess = place[:, seen] + random.uniform(-3, 3, (2, int(seen.sum())))
    return place[:, seen], rays, guess


def test_a_sphere_is_met_where_the_closed_form_says(tmp_path: Path) -> None:
    chart = chart_of("kind: sphere, radius: 1", tmp_path, (8192, 4096))
    eye = np.array([0.7, 1.1, 2.5])
    place, rays, guess = aimed(chart, 1, eye)
    assert np.abs(meet(chart, eye, rays, guess) - place).max() < 1e-7


def test_a_cylinder_is_met_from_inside(tmp_path: Path) -> None:
    chart = chart_of(
        "kind: cylinder, radius: 5, height: 3, arc_deg: [-60, 60], lit: inside", tmp_path, (4096, 1024)
    )
    eye = np.array([0.3, 0.2, 1.0])
    place, rays, guess = aimed(chart, 2, eye)
    assert place.shape[1] > 1000
    assert np.abs(meet(chart, eye, rays, guess) - place).max() < 1e-7


def test_rays_that_miss_keep_their_guess(tmp_path: Path) -> None:
    chart = chart_of("kind: sphere, radius: 1", tmp_path, (512, 256))
    guess = np.array([[100.0, 200.0], [100.0, 128.0]])
    rays = np.array([[5.0, 0.0], [5.0, 1.0], [1.0, 0.0]])
    assert (meet(chart, np.array([0.0, 0, 3]), rays, guess) == guess).all()


def test_a_net_lies_on_its_chart_and_leaves_out_what_is_masked(tmp_path: Path) -> None:
    chart = chart_of("kind: torus, radius: 1, tube: 0.3", tmp_path, (256, 128))
    points, pixels, triangles = net(chart, 32)
    assert len(triangles) == 2 * 32 * 32
    assert np.abs(chart.points(*pixels.T).T - points).max() == 0
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    middle = pixels[triangles].mean(axis=1).T
    assert ((normal.T * chart.normals(*middle)).sum(axis=0) > 0).all()
