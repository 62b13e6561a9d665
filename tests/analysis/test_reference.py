"""What resampling alone costs: direct pictures with the display's pixels, and the display against them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.analysis.simulate.images import shown_images
from quiltcli.analysis.simulate.lookup import Shown, look_up
from quiltcli.analysis.simulate.picture import (
    camera_stage,
    direct_light,
    displayed_light,
    exact,
    picture_rays,
    visible_facets,
    with_channels,
)
from quiltcli.analysis.simulate.reference import facet_windows, resampled_light
from quiltcli.cli import main
from quiltcli.geometry import dot
from quiltcli.job import load_job
from quiltcli.layout import quilt_polygons
from quiltcli.projection.camera import camera_display, raster_display
from quiltcli.render.buffers import new_buffers
from quiltcli.render.frame import draw_frame
from quiltcli.render.setup import set_stage
from quiltcli.viewer.view import views_at
from tests.helpers.flat_displays import PITCH
from tests.helpers.sky_scene import sky_job
from tests.helpers.tiny_job import write_tiny_job
from tests.helpers.turned_layout import turned_display, turned_layout

MODELS = Path(__file__).parents[2] / "display_models"


def staged(job, folder: Path):
    """Stage, viewer and images of a job's first frame."""
    stage = set_stage(with_channels(job, ("rgba",)))
    view = views_at(stage.job, 1)[0]
    who = view.viewer
    shown, _ = shown_images(stage, view, folder / "none", "", 1)
    return stage, who, shown


def test_windows_have_pixels_where_the_facets_have_theirs_however_these_are_turned() -> None:
    facets, layout, eye = turned_display(), turned_layout(), np.array([3.0, 1.0, 2.0])
    row = np.repeat(np.arange(8), np.diff(layout.corner_start))
    (windows, pages), corner = facet_windows(facets, layout, np.arange(8), row, quilt_polygons(layout).T, eye)
    assert (pages.pages == windows.size).all()
    np.testing.assert_allclose(dot(np.cross(windows.du, windows.dv), windows.normal) > 0, windows.mirrored)
    assert windows.mirrored.tolist() == [False] * 4 + [True] * 4
    for k in range(8):
        # A quilt pixel's centre, by the layout's own map, is the window's pixel in the same place.
        there = corner[k] + [3.5, 4.5]
        maps = layout.quilt_from_facet[k]
        i, j = np.linalg.solve(maps[:, :2], there - maps[:, 2])
        expected = facets.origin[k] + i * facets.du[k] + j * facets.dv[k]
        found = windows.origin[k] + 3.5 * windows.du[k] + 4.5 * windows.dv[k]
        np.testing.assert_allclose(found, expected, atol=1e-12)
        # All corners are inside, with room for the pixels around.
        inside = quilt_polygons(layout)[row == k] - corner[k]
        assert inside.min() >= 2
        assert (inside <= windows.size[k] - 2).all()


@pytest.mark.parametrize("degrees", [0, 60, 80])
def test_a_window_has_as_many_pixels_to_the_solid_angle_as_its_facet_and_as_many_each_way(degrees) -> None:
    """A panel r metres away that is turned by θ: a pixel of a metres is a/r high and a·cos θ/r wide."""
    facets, layout = turned_display([0]), turned_layout([0])
    middle = facets.origin[0] + 6 * facets.du[0] + 4 * facets.dv[0]
    turn, away = np.radians(degrees), 5.0
    eye = middle + away * np.array([np.sin(turn), 0, np.cos(turn)])
    place = quilt_polygons(layout).T
    (windows, _), _ = facet_windows(facets, layout, np.array([0]), np.zeros(place.shape[1], int), place, eye)
    look = (middle - eye) / away
    high = np.linalg.norm(np.cross(windows.dv[0], look)) / away
    wide = np.linalg.norm(np.cross(windows.du[0], look)) / away
    solid = abs(np.cross(windows.du[0], windows.dv[0]) @ look) / away**2
    np.testing.assert_allclose(
        (wide, high, solid),
        (PITCH * np.cos(turn) / away, PITCH / away, PITCH**2 * np.cos(turn) / away**2),
        rtol=1e-12,
    )


def test_a_picture_as_dense_as_the_rays_is_the_direct_one(tmp_path) -> None:
    stage, who, shown = staged(load_job(write_tiny_job(tmp_path)), tmp_path)
    # 32 rays to 32 pixels of the wall 2 m away: both at the same places.
    through = camera_display(who, 32, 32, 2 * np.degrees(np.arctan(0.25)))
    facet = visible_facets(stage, who, through, 1)
    once = resampled_light(stage, who, shown, who, through, facet, 1)
    np.testing.assert_allclose(once, direct_light(stage, who, through, 1), atol=2e-4)
    nothing = np.full(facet.size, -1, np.int32)
    assert resampled_light(stage, who, shown, who, through, nothing, 1) is None


def test_windows_that_are_drawn_one_by_one_are_the_same(tmp_path, monkeypatch) -> None:
    stage, who, shown = staged(load_job(write_tiny_job(tmp_path)), tmp_path)
    through = camera_display(who, 60, 40, 70)
    facet = visible_facets(stage, who, through, 1)
    assert set(np.unique(facet)) == {-1, 0, 1}
    together = resampled_light(stage, who, shown, who, through, facet, 1)
    monkeypatch.setattr("quiltcli.analysis.simulate.reference._TOGETHER", 1)
    assert (resampled_light(stage, who, shown, who, through, facet, 1) == together).all()


def test_the_cost_of_a_slanted_panel_is_that_of_its_lattice_not_of_square_pixels(tmp_path) -> None:
    """Against plain pictures on the camera's own plane, which know nothing of the panel's.

    Seen at 75°, the panel's pixels are to the eye as high as ever and a quarter as wide. A picture of
    such pixels costs what the windows and the display cost. One of square pixels, as many to the solid
    angle, costs less: an edge is blurred by a pixel's extent across it, in the mean over all directions
    by (1 + cos θ)/2 for the one and √cos θ for the other.
    """
    turn, eye = np.radians(75), (0.0, 0.0, 8.0)
    x, z = np.cos(turn), np.sin(turn)
    (tmp_path / "panel.obj").write_text(
        f"v {-x} -0.4 {z}\nv {x} -0.4 {-z}\nv {x} 0.4 {-z}\nv {-x} 0.4 {z}\nf 1 2 3 4\n"
    )
    job = sky_job(tmp_path, tmp_path / "panel.obj", 240, eye, (0, 0, 0), count=150_000, extent=0.006)
    stage, who, shown = staged(job, tmp_path)
    through = camera_display(who, 600, 900, 6.5)
    facet = visible_facets(stage, who, through, 1)
    met = np.flatnonzero(facet >= 0)
    direct = direct_light(stage, who, through, 1)

    def cost(light) -> float:
        return float(np.abs(light[:, met] - direct[:, met]).max(axis=0).mean())

    own = cost(displayed_light(shown, who, through, facet, "linear")[0])
    windows = cost(resampled_light(stage, who, shown, who, through, facet, 1))
    rays = picture_rays(who, through, met).T
    slope = rays[:, :2] / -rays[:, 2:]
    pixel = 1 / 240 / 8
    wide, high = pixel * np.cos(turn), pixel

    def plain(width: float, height: float) -> float:
        light = np.zeros_like(direct)
        light[:, met] = _plain_picture(stage, who, slope, width, height)
        return cost(light)

    assert own == pytest.approx(windows, rel=0.005)  # at the panel's edges it has no pixels beyond
    assert windows == pytest.approx(plain(wide, high), rel=0.03)
    square = plain(np.sqrt(wide * high), np.sqrt(wide * high))
    assert windows / square == pytest.approx((1 + np.cos(turn)) / 2 / np.sqrt(np.cos(turn)), rel=0.05)


def _plain_picture(stage, who, slope, width: float, height: float):
    """The scene on the plane 1 m before a camera that looks along −z, resampled to slopes (P, 2)."""
    reach = np.abs(slope).max(axis=0) + 2 * np.array([width, height])
    size = np.ceil(2 * reach / (width, height)).astype(np.int32)
    corner = who.eye + [-reach[0], reach[1], -1]
    du, dv = np.array([[width, 0, 0]]), np.array([[0, -height, 0]])
    raster = raster_display(corner[None], du, dv, size[None], np.array([[0, 0, 1.0]]))
    plain = camera_stage(exact(stage.job), raster, stage.scene)
    buffers = new_buffers(plain)
    draw_frame(plain, who, buffers, 1)
    place = np.stack(((slope[:, 0] + reach[0]) / width, (reach[1] - slope[:, 1]) / height))
    shown = Shown(*raster, np.ones(1, bool), buffers, plain.owners, who.eye)
    return look_up(shown, np.zeros(len(slope), np.int32), place)


@pytest.mark.parametrize(
    ("model", "pixels", "side", "eye", "look_at"),
    [
        ("cube5", 1200, "front", (0.5, 0.7, 0.9), (0, 0.15, 0)),
        pytest.param("sphere840", 1200, "front", (0.5, 0.7, 0.9), (0, 0.15, 0), marks=pytest.mark.long),
        pytest.param("knot1200", 1200, "front", (0.5, 0.7, 0.9), (0, 0.15, 0), marks=pytest.mark.long),
        ("cave5", 250, "back", (0.2, 1.6, 0.3), (0, 1.3, -2)),
    ],
)
def test_a_display_shows_no_more_error_than_its_pixels_cost_and_no_seams(
    tmp_path, model, pixels, side, eye, look_at
) -> None:
    job = sky_job(tmp_path, MODELS / f"{model}.obj", pixels, eye, look_at, side=side)
    options = PictureOptions(size=(360, 270), samples=2, resampled=True, threads=1)
    (result,) = simulate(job, [1], options)
    found = result.comparison
    assert found.mean > 1e-3
    assert found.mean <= found.resampled * 1.0001
    assert found.seams_alone == pytest.approx(1, abs=0.01)


def test_single_pixels_are_held_against_single_pixels(tmp_path) -> None:
    job = sky_job(tmp_path, MODELS / "cube5.obj", 600, (0.5, 0.7, 0.9), (0, 0.15, 0))
    options = PictureOptions(size=(180, 135), samples=2, resampled=True, threads=1, filter="nearest")
    (result,) = simulate(job, [1], options)
    assert result.comparison.mean == pytest.approx(result.comparison.resampled, rel=1e-3)


def test_seams_do_not_show_where_facets_have_no_bleed_either(tmp_path) -> None:
    mesh = MODELS / "sphere840.obj"
    job = sky_job(tmp_path, mesh, 1200, (0.5, 0.7, 0.9), (0, 0.15, 0), "render.bleed=0")
    options = PictureOptions(size=(360, 270), samples=2, resampled=True, threads=1)
    (result,) = simulate(job, [1], options)
    assert result.comparison.seams_alone < 1.05


def test_the_figure_is_told_beside_the_display_s_own(tmp_path) -> None:
    job = write_tiny_job(tmp_path)
    more = ["--size", "60x40", "--supersample", "2", "-j", "1"]
    result = CliRunner().invoke(main, ["simulate", str(job), "-o", str(tmp_path / "a.png"), *more])
    assert result.exit_code == 0, result.output
    figures = {line[:24].strip(): line[24:].split()[0].rstrip(",") for line in result.output.splitlines()}
    own, once = float(figures["error, mean"]), float(figures["resampled once, mean"])
    assert 0 < own <= 1.002 * once
