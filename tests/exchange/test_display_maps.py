"""Displays as maps of points and as meshes, and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import SURFACES


def written(keys: str, folder: Path, name: str, *more: str) -> Path:
    (folder / "d.yaml").write_text(f"quilt_display: 1\nsurfaces:\n- {{{keys}, pixels: [48, 32]}}\n")
    result = CliRunner().invoke(main, ["export", str(folder / "d.yaml"), "-o", str(folder / name), *more])
    assert result.exit_code == 0, result.output
    return folder / name


@pytest.mark.parametrize("suffix", ["exr", "pfm"])
@pytest.mark.parametrize("name", ["sphere", "dome", "bezier", "torus"])
def test_a_map_of_points_reads_back_as_the_same_pixels(name: str, suffix: str, tmp_path: Path) -> None:
    written(SURFACES[name], tmp_path, f"map.{suffix}")
    first = load_display(load_display_file(tmp_path / "d.yaml")).charts[0]
    (tmp_path / "m.yaml").write_text(f"quilt_display: 1\nsurfaces:\n- {{kind: map, file: map.{suffix}}}\n")
    second = load_display(load_display_file(tmp_path / "m.yaml")).charts[0]
    assert first is not None
    assert second is not None
    assert second.size == first.size
    x, y = np.meshgrid(np.arange(48) + 0.5, np.arange(32) + 0.5)
    assert np.abs(first.points(x, y) - second.points(x, y)).max() < 3e-7
    # Between centres it goes along with the surface, and faces the same way.
    inner = np.s_[:, 2:-3, 2:-3]
    assert np.abs(first.points(x + 0.4, y + 0.3) - second.points(x + 0.4, y + 0.3))[inner].max() < 3e-3
    assert (first.normals(x, y) * second.normals(x, y)).sum(axis=0)[2:-2, 2:-2].min() > 0.99


def test_a_map_of_a_ring_is_a_ring(tmp_path: Path) -> None:
    for arc, closes in (("[-180, 180]", True), ("[-180, 179]", False)):
        written(f"kind: cylinder, radius: 2, height: 1, arc_deg: {arc}", tmp_path, "map.exr")
        text = "quilt_display: 1\nsurfaces:\n- {kind: map, file: map.exr}\n"
        (tmp_path / "m.yaml").write_text(text)
        (chart,) = load_display(load_display_file(tmp_path / "m.yaml")).charts
        assert chart is not None
        assert chart.wraps == closes
    # Beyond an edge the other one goes on.
    written("kind: cylinder, radius: 2, height: 1", tmp_path, "map.exr")
    (chart,) = load_display(load_display_file(tmp_path / "m.yaml")).charts
    y = np.full(3, 10.5)
    beyond, other = (chart.points(np.array(x), y) for x in ([48.5, 49.5, -0.5], [0.5, 1.5, 47.5]))
    assert np.abs(beyond - other).max() < 1e-12


def test_a_mesh_of_a_surface_reads_back_as_a_surface(tmp_path: Path) -> None:
    written(SURFACES["cylinder"], tmp_path, "mesh.obj")
    first = load_display(load_display_file(tmp_path / "d.yaml")).charts[0]
    text = "quilt_display: 1\nsurfaces:\n- {kind: mesh, file: mesh.obj, pixels: [48, 32]}\n"
    (tmp_path / "m.yaml").write_text(text)
    second = load_display(load_display_file(tmp_path / "m.yaml")).charts[0]
    assert first is not None
    assert second is not None
    x, y = np.meshgrid(np.arange(48) + 0.5, np.arange(32) + 0.5)
    assert np.abs(first.points(x, y) - second.points(x, y)).max() < 1e-3
    assert (first.normals(x, y) * second.normals(x, y)).sum(axis=0).min() > 0.99


def test_a_warp_mesh_of_a_projection_reads_back_as_the_same_directions(tmp_path: Path) -> None:
    keys = "kind: cylinder, hfov_deg: 120, pixels: [256, 128]"
    (tmp_path / "d.yaml").write_text(f"quilt_display: 1\nprojection: {{{keys}}}\n")
    result = CliRunner().invoke(main, ["export", str(tmp_path / "d.yaml"), "-o", str(tmp_path / "warp.data")])
    assert result.exit_code == 0, result.output
    first = load_display(load_display_file(tmp_path / "d.yaml")).charts[0]
    text = "quilt_display: 1\nprojection: {kind: mesh, file: warp.data, pixels: [256, 128]}\n"
    (tmp_path / "m.yaml").write_text(text)
    second = load_display(load_display_file(tmp_path / "m.yaml")).charts[0]
    assert first is not None
    assert second is not None
    x, y = np.meshgrid(np.arange(256) + 0.5, np.arange(128) + 0.5)
    ways = [chart.points(x, y) for chart in (first, second)]
    ways = [way / np.sqrt((way**2).sum(axis=0)) for way in ways]
    known = np.isfinite(ways[1].sum(axis=0))
    assert known.mean() > 0.95
    assert np.abs(ways[0] - ways[1])[:, known].max() < 2e-3


@pytest.mark.parametrize(
    "keys",
    [
        "kind: cylinder, hfov_deg: 120, heading_deg: 70, pixels: [256, 128]",
        "kind: fisheye, fov_deg: 200, pixels: [128, 128]",
    ],
)
def test_an_st_map_of_a_projection_reads_back_as_the_same_directions(keys: str, tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text(f"quilt_display: 1\nprojection: {{{keys}}}\n")
    words = ["export", str(tmp_path / "d.yaml"), "-o", str(tmp_path / "st.exr"), "--format", "st"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    first = load_display(load_display_file(tmp_path / "d.yaml")).charts[0]
    assert first is not None
    width, height = first.size
    # Its angle and its aspect stand in the file.
    heading = "heading_deg: 70, " if "heading" in keys else ""
    text = f"{{kind: st, file: st.exr, {heading}pixels: [{width}, {height}]}}"
    (tmp_path / "m.yaml").write_text(f"quilt_display: 1\nprojection: {text}\n")
    second = load_display(load_display_file(tmp_path / "m.yaml")).charts[0]
    assert second is not None
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    ways = [chart.points(x, y) for chart in (first, second)]
    ways = [way / np.sqrt((way**2).sum(axis=0)) for way in ways]
    known = np.ones(x.shape, dtype=bool) if second.mask is None else second.mask
    across, up, back = np.einsum("ij,jhw->ihw", first.shape.linear.T, ways[0])
    ahead = (back < 0) & (np.maximum(np.abs(across), np.abs(up)) <= -back * np.tan(np.radians(79)))
    assert known[ahead].all()
    assert known.mean() > 0.3
    assert np.abs(ways[0] - ways[1])[:, known].max() < 1e-6


def test_an_st_map_needs_something_ahead(tmp_path: Path) -> None:
    keys = "kind: equirect, longitude_deg: [100, 170], pixels: [64, 32]"
    (tmp_path / "d.yaml").write_text(f"quilt_display: 1\nprojection: {{{keys}}}\n")
    words = ["export", str(tmp_path / "d.yaml"), "-o", str(tmp_path / "st.exr"), "--format", "st"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2
    assert "facet 1 looks nowhere ahead" in result.output + result.stderr


def test_a_display_has_no_other_forms(tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text("quilt_display: 1\nprojection: {kind: equirect, pixels: [64, 32]}\n")
    arguments = ["export", str(tmp_path / "d.yaml"), "-o", str(tmp_path / "m.exr"), "--format", "csv"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert "a display has no form 'csv'" in result.output
