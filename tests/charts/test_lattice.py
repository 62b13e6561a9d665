"""Places spread over surfaces: their areas, their normals, and the lines drawn of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from quiltcli.charts.lattice import chart_lines, surface_lattice
from tests.helpers.curved_jobs import SURFACES, chart_of


def test_a_sphere_has_its_area_its_middle_and_no_column_twice(tmp_path: Path) -> None:
    chart = chart_of("kind: sphere, radius: 2, at: [1, 2, 3]", tmp_path, (256, 128))
    found = surface_lattice(chart, 800)
    assert abs(found.area.sum() - 16 * np.pi) < 2e-3 * 16 * np.pi
    away = found.point - (1, 2, 3)
    # Normals are those of the ball, and the mean place is its middle: nothing counts twice.
    assert np.abs(away / 2 - found.normal).max() < 1e-6
    assert np.abs((away * found.area[:, None]).sum(axis=0) / found.area.sum()).max() < 1e-3
    assert len(np.unique(np.round(found.point, 6), axis=0)) == len(found.point)


@pytest.mark.parametrize("name", SURFACES)
def test_places_lie_on_the_surface_and_are_about_as_many_as_asked_for(name: str, tmp_path: Path) -> None:
    chart = chart_of(SURFACES[name], tmp_path)
    found = surface_lattice(chart, 300)
    assert 150 < len(found.area) < 600
    assert (found.area > 0).all()
    assert np.isfinite(found.point).all()
    assert np.abs((found.normal**2).sum(axis=1) - 1).max() < 1e-12


def test_what_a_mask_takes_away_is_no_place_and_no_line(tmp_path: Path) -> None:
    mask = np.zeros((32, 64), np.uint8)
    mask[:, :32] = 255
    Image.fromarray(mask).save(tmp_path / "mask.png")
    chart = chart_of("kind: plane, width: 2, height: 1, mask: mask.png", tmp_path)
    found = surface_lattice(chart, 200)
    assert found.point[:, 0].max() <= 0.02
    assert abs(found.area.sum() - 1.0) < 0.05
    lines = chart_lines(chart)
    assert max(line[:, 0].max() for line in lines) <= 0.02
    assert len(lines) == 4 + 5  # the columns before the middle, and all rows as far as that
