"""Surfaces cut into flat facets: the error is kept, and falls as it should."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.charts.flat import flat_pieces
from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import SURFACES, bumpy_ball, chart_of, curved_job
from tests.render.test_curved import drawn, page, staged


@pytest.mark.parametrize("name", ["sphere", "cylinder", "torus", "paraboloid", "bezier"])
def test_pieces_keep_the_error_and_are_second_order(name: str, tmp_path: Path) -> None:
    chart = chart_of(SURFACES[name], tmp_path, (1024, 512))
    few, many = flat_pieces(chart, 1.0, 10**6), flat_pieces(chart, 0.25, 10**6)
    assert few is not None
    assert many is not None
    assert few.error <= 1.0
    assert many.error <= 0.25
    # A quarter of the error takes twice the cuts in each bent direction, in steps of two.
    assert 1.4 < len(many.faces) / len(few.faces) < 9


def test_a_cylinder_is_cut_one_way_into_quadrilaterals(tmp_path: Path) -> None:
    chart = chart_of(SURFACES["cylinder"], tmp_path, (1024, 512))
    pieces = flat_pieces(chart, 0.25, 10**6)
    assert pieces is not None
    assert {len(face) for face in pieces.faces} == {4}
    rows = len(np.unique(pieces.pixels[:, 1]))
    assert rows <= 5


def test_too_few_pieces_are_an_error(tmp_path: Path) -> None:
    text = "quilt_display: 1\nsurfaces:\n- {kind: sphere, radius: 1, pixels: [1024, 512]}\n"
    (tmp_path / "d.yaml").write_text(text)
    arguments = ["facet", str(tmp_path / "d.yaml"), "-o", str(tmp_path / "flat.yaml"), "--limit", "50"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert "needs more than 50 facets for an error of 0.25 pixels" in result.output


@pytest.mark.parametrize("name", ["cylinder", "paraboloid"])
def test_the_flat_display_shows_almost_the_same_picture(name: str, tmp_path: Path) -> None:
    (tmp_path / "curved").mkdir()
    display = f"surfaces:\n- {{{SURFACES[name]}, pixels: [256, 192]}}"
    eye = (0.1, 0.3, 0.2) if name == "cylinder" else (0.6, 1.6, 1.1)
    more = "render: {depth: radial, bleed: 0}\noutput: {channels: [Z, triangle]}\n"
    job = curved_job(tmp_path, display, bumpy_ball(4.0, 2), eye, (0.1, 0, 0), more)
    arguments = [
        "facet",
        str(tmp_path / "display.yaml"),
        "-o",
        str(tmp_path / "flat.yaml"),
        "--error",
        "0.1px",
    ]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    stated = int(re.search(r"([\d,]+) facets", result.output)[1].replace(",", ""))  # type: ignore[index]
    flat = load_display(load_display_file(tmp_path / "flat.yaml"))
    assert flat.count == stated
    pictures = []
    for path in ("display.yaml", "flat.yaml"):
        spec = load_display_file(tmp_path / path)
        update = {"display": tmp_path / path, **({"layout": spec.layout} if spec.layout else {})}
        stage, viewer = staged(job.model_copy(update=update))
        buffers = drawn(stage, viewer)
        pictures.append([page(stage, buffers[key])[:192, :256] for key in ("Z", "triangle")])
    (z, triangle), (flat_z, flat_triangle) = pictures
    lit = np.isfinite(z) & np.isfinite(flat_z)
    assert lit.mean() > 0.9
    assert (triangle != flat_triangle)[lit].mean() < 0.01
    assert np.abs(z / np.where(lit, flat_z, 1) - 1)[lit].max() < 0.01
