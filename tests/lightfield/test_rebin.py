"""Rays between the photographs of a ring."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from quiltcli.formats.png import save_png
from quiltcli.geometry import FloatArray
from quiltcli.job import load_lightfield_file
from quiltcli.lightfield import Field, Rays, load_field, rebin
from quiltcli.lightfield.cameras import ring_cameras
from quiltcli.lightfield.rebin import _crossing, _rows, bilinear
from tests.helpers.ring_photos import RADIUS, ball, field_text, write_pictures


def field_of(folder: Path, views: int, heights: list[float], **how: object) -> Field:
    """A light field of a ball, drawn into a folder."""
    exr, depths = bool(how.get("exr")), how.get("focus") == "depth"
    if depths:
        how["depths"] = "h{row:02}/z{view:04}.exr"
    folder.mkdir(exist_ok=True)
    (folder / "field.yaml").write_text(field_text(views, heights, **how))  # type: ignore[arg-type]
    file = load_lightfield_file(folder / "field.yaml")
    write_pictures(ring_cameras(file), folder, exr=exr, depths=depths)
    return load_field(file)


def mirror_rays(theta: float, height: float, distance: float, count: int = 400) -> Rays:
    """Rays of a mirror tilted 45° at an angle, towards viewers on a circle."""
    rng = np.random.default_rng(7)
    e, f = np.array([np.cos(theta), 0, np.sin(theta)]), np.array([np.sin(theta), 0, -np.cos(theta)])
    along, across = rng.uniform(-0.045, 0.045, (2, count))
    mirror = along[:, None] * e + across[:, None] * f - along[:, None] * [0, 1, 0]
    # In plan the light comes from p = 60 cm behind.
    fan = np.arctan2(across, 0.6 + along)
    azimuth = theta - fan - np.arcsin(0.6 * np.sin(fan) / distance)
    viewer = np.stack(
        (distance * np.cos(azimuth), np.full(count, height), distance * np.sin(azimuth)), axis=-1
    )
    return Rays(viewer, mirror, distance * e + [0, height, 0])


def exact(rays: Rays) -> FloatArray:
    return ball(rays.viewer, rays.mirror - rays.viewer)[0]


def inside(rays: Rays) -> np.ndarray:
    """Rays that pass the ball's middle nearer than its rim, where one pixel more or less is everything."""
    way = rays.mirror - rays.viewer
    way = way / np.linalg.norm(way, axis=1)[:, None]
    return np.linalg.norm(np.cross(rays.viewer, way), axis=1) < 0.75 * RADIUS


def psnr(found: np.ndarray, expected: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((found - expected) ** 2)))


def test_a_ray_through_a_camera_is_what_that_camera_sees(tmp_path: Path) -> None:
    field = field_of(tmp_path, 12, [0.1, 0.3], exr=True)
    targets = np.random.default_rng(1).uniform(-0.03, 0.03, (50, 3))
    for r, row in enumerate(field.cameras.rows):
        for k in (0, 5, 11):
            start = np.broadcast_to(row.position[k], targets.shape)
            found = rebin(field, Rays(start, targets, row.position[k]))
            right, down, ahead = row.rotation[k] @ (targets - row.position[k]).T
            lens = field.cameras.lens
            x, y = (
                lens.centre[0] + lens.focal[0] * right / ahead,
                lens.centre[1] + lens.focal[1] * down / ahead,
            )
            values = field.pictures[field.picture(r, int(row.view[k]), 1)]
            expected, inside = bilinear(values, x, y, field.curve)
            assert inside.all()
            np.testing.assert_allclose(found, expected, atol=1e-6)


def test_more_views_come_nearer_to_the_exact_rays(tmp_path: Path) -> None:
    rays = mirror_rays(0.3, 0.2, 1.0)
    got = [
        psnr(rebin(field_of(tmp_path / str(n), n, [0.2], size=128, exr=True), rays), exact(rays))
        for n in (18, 36, 72)
    ]
    assert all(after > before + 1 for before, after in pairwise(got))
    assert got[-1] > 24


def test_depth_maps_say_where_cameras_agree_best(tmp_path: Path) -> None:
    rays = mirror_rays(1.1, 0.2, 1.0)
    inner = inside(rays)
    got = {}
    for focus in ("mirror", "axis", "depth"):
        field = field_of(tmp_path / focus, 24, [0.2], size=128, exr=True, focus=focus)
        got[focus] = psnr(rebin(field, rays)[inner], exact(rays)[inner])
    assert got["depth"] > max(got["mirror"], got["axis"]) + 3


@pytest.mark.parametrize("theta", [0.0, 2.0, 3.14, -1.3])
def test_every_angle_of_the_mirror_is_served(tmp_path: Path, theta: float) -> None:
    field = field_of(tmp_path, 72, [0.1, 0.3])
    rays = mirror_rays(theta, 0.2, 0.8)
    assert psnr(rebin(field, rays), exact(rays)) > 17
    assert psnr(rebin(field, mirror_rays(theta + 0.4, 0.2, 0.8)), exact(rays)) < 15


def test_light_is_blended_and_not_its_coding(tmp_path: Path) -> None:
    (tmp_path / "h01").mkdir()
    for view, value in enumerate((0, 255, 0, 255), start=1):
        save_png(tmp_path / f"h01/v{view:04}.png", np.full((16, 16, 3), value, np.uint8))
    (tmp_path / "field.yaml").write_text(field_text(4, [0.0], size=16))
    field = load_field(load_lightfield_file(tmp_path / "field.yaml"))
    between = np.array([[np.cos(np.pi / 4), 0, np.sin(np.pi / 4)]])
    found = rebin(field, Rays(between, np.zeros((1, 3)), between[0]))
    np.testing.assert_allclose(found, 0.5, atol=1e-6)


def test_rays_that_no_camera_sees_are_black(tmp_path: Path) -> None:
    field = field_of(tmp_path, 8, [0.2], size=16)
    viewer, aside = np.array([[1.0, 0.2, 0]]), np.array([[0.0, 0.5, 0]])
    assert rebin(field, Rays(viewer, aside, viewer[0])).tolist() == [[0, 0, 0]]


def row_numbers(field: Field, rays: Rays) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(_rows(field, rays, _crossing(rays.viewer, rays.mirror, field.cameras.distance)))


def test_rows_are_chosen_by_where_a_ray_crosses_the_ring(tmp_path: Path) -> None:
    heights = [0.05 * k for k in range(15)]
    fields = {
        name: field_of(tmp_path / name, 4, heights, size=8, slices=name)
        for name in ("linear", "nearest", "quads")
    }
    rays = mirror_rays(0.7, 0.3, 0.6)
    (low, under), (high, over) = row_numbers(fields["linear"], rays)
    np.testing.assert_allclose(under + over, 1)
    crossing = _crossing(rays.viewer, rays.mirror, 1.0)
    np.testing.assert_allclose(np.hypot(crossing[:, 0], crossing[:, 2]), 1)
    np.testing.assert_allclose(under * low * 0.05 + over * high * 0.05, crossing[:, 1], atol=1e-12)
    ((nearest, _),) = row_numbers(fields["nearest"], rays)
    np.testing.assert_array_equal(nearest, np.where(over < 0.5, low, high))
    ((quads, _),) = row_numbers(fields["quads"], rays)
    assert np.abs(quads - nearest).max() == 1
    assert 0 < np.mean(quads != nearest) < 0.25
    assert len(np.unique(nearest)) > 2
    # On the ring of the cameras themselves one row serves everybody.
    ((same, _),) = row_numbers(fields["nearest"], mirror_rays(0.7, 0.3, 1.0))
    assert set(same.tolist()) == {6}


def test_beyond_the_rows_the_last_one_holds(tmp_path: Path) -> None:
    field = field_of(tmp_path, 4, [0.1, 0.2], size=8)
    low, high, share = field.cameras.levels(np.array([-1.0, 0.1, 0.125, 0.2, 5.0]))
    assert (low.tolist(), high.tolist()) == ([0, 0, 0, 0, 0], [1, 1, 1, 1, 1])
    np.testing.assert_allclose(share, [0, 0, 0.25, 1, 1])
