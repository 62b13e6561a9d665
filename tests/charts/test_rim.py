"""Nets for looking at charts: no gap at cuts, and rims and masks to a pixel or an eighth of a cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from quiltcli.charts.chart import Chart
from quiltcli.charts.meet import CELLS, net
from quiltcli.charts.rim import net_to_the_rim
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import chart_of


def projection(words: str, folder: Path) -> Chart:
    (folder / "d.yaml").write_text(f"quilt_display: 1\nprojection: {{{words}}}\n")
    (chart,) = load_display(load_display_file(folder / "d.yaml")).charts
    assert chart is not None
    return chart


def hit(chart: Chart, directions: np.ndarray, nets=net_to_the_rim) -> np.ndarray:
    """Which directions (N, 3) from the middle meet a net."""
    points, pixels, triangles = nets(chart)
    assert len(points) == len(pixels)
    body = trimesh.Trimesh(points, triangles, process=False)
    return body.ray.intersects_any(np.zeros_like(directions), directions)


def directions(count: int) -> np.ndarray:
    found = np.random.default_rng(7).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize(
    "words",
    [
        "kind: cubemap, pixels: [384, 288]",
        "kind: cubemap, pixels: [4096, 3072]",
        "kind: cubemap, pixels: [44, 33]",
        "kind: cubemap, layout: row, pixels: [1500, 250]",
        "kind: cubemap, layout: row, equiangular: true, pixels: [600, 100]",
    ],
)
def test_the_faces_of_a_cube_meet(words: str, tmp_path: Path) -> None:
    chart = projection(words, tmp_path)
    rays = directions(50_000)
    # Along the cube's edges, too.
    rays[:2000, 0] = rays[:2000, 1] * (1 + 1e-4)
    rays[2000:4000, 2] = -rays[2000:4000, 1] * (1 - 1e-4)
    assert hit(chart, rays).mean() == 1.0
    assert hit(chart, rays, net).mean() < 0.998


@pytest.mark.parametrize(("size", "step"), [(200, 1.0), (1024, 1.0), (4096, 4.0)])
def test_a_dome_ends_at_its_horizon(size: int, step: float, tmp_path: Path) -> None:
    chart = projection(f"kind: dome_master, pixels: [{size}, {size}]", tmp_path)
    rays = directions(50_000)
    rays[:, 1] *= 0.05  # most of them close to the horizon
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    height = np.degrees(np.arcsin(rays[:, 1])) / (180 / size)
    found = hit(chart, rays)
    # A small cell of this many pixels is there when its corners are, and the pixel in its middle.
    assert found[height > 2 * step].all()
    assert not found[height < -0.1].any()
    cell = size / min(CELLS, size)
    assert hit(chart, rays, net)[(height > 0) & (height < cell / 2)].mean() < 0.8


def test_masks_are_kept_to_an_eighth_of_a_cell(tmp_path: Path) -> None:
    from dataclasses import replace

    chart = chart_of("kind: plane, width: 2, height: 1", tmp_path, (2048, 1024))
    y, x = np.mgrid[:1024, :2048] + 0.5
    away = np.hypot(x - 900, y - 500)
    chart = replace(chart, mask=away < 400)
    points, pixels, triangles = net_to_the_rim(chart)
    np.testing.assert_allclose(points.T, chart.points(*pixels.T))
    middle = pixels[triangles].mean(axis=1)
    assert np.hypot(*(middle - (900, 500)).T).max() < 400 + 2
    a, b, c = (pixels[triangles[:, k]] for k in range(3))
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    fine = area < 4  # the cells of the net are 16 × 8 pixels
    assert np.hypot(*(middle[fine] - (900, 500)).T).min() > 400 - 45
    # Every pixel that is well inside lies in a triangle.
    body = trimesh.Trimesh(np.c_[pixels, np.zeros(len(pixels))], triangles, process=False)
    inside = np.stack((x, y, np.ones_like(x)), axis=-1)[away < 397][::37]
    assert body.ray.intersects_any(inside, np.tile((0, 0, -1.0), (len(inside), 1))).all()


def test_a_surface_without_rims_has_the_net_it_always_had(tmp_path: Path) -> None:
    chart = chart_of("kind: torus, radius: 1, tube: 0.3", tmp_path, (256, 128))
    for old, new in zip(net(chart), net_to_the_rim(chart), strict=True):
        assert set(map(tuple, old[:400].tolist())) <= set(map(tuple, new.tolist()))
        assert len(old) == len(new)
