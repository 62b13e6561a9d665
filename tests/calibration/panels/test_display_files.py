"""Display files with facets where they were measured: read again they are just that."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quiltcli.calibration.panels.corners import (
    COLUMNS,
    corner_table,
    doubtful_corners,
    fit_corners,
    read_corners,
    turned_facets,
)
from quiltcli.calibration.panels.display_files import moved_display, panel_angles
from quiltcli.calibration.panels.distances import enlarged
from quiltcli.calibration.panels.start import middles_of
from quiltcli.calibration.pattern import corner_letter
from quiltcli.display import load_display
from quiltcli.display.panels import panel_axes
from quiltcli.errors import JobError
from quiltcli.job import load_display_file
from tests.calibration.panels.made_up import MODELS
from tests.helpers.photos import moved

PANELS = """quilt_display: 1
units: mm
up_axis: z
panels:
- {name: a, pixels: [100, 50], pitch: 6 mm, at: [0, 100, 1000], yaw_deg: 30, pitch_deg: 20, mirror: true}
- {name: b, pixels: [100, 50], size: [600, 300], at: [0, 2000, 1000], pitch_deg: 90,
   place: {at: [10, 20], rotate: 90}}
- {name: c, pixels: [10, 20], pitch: 1/3 mm, at: [500, 0, 0], enabled: false}
transform: {scale: 2, rotate_deg: [10, 20, 30]}
"""


@pytest.fixture(params=["cube5", "cave5", "sphere840", "corner_billboard", "panels"])
def display(request, tmp_path):
    path = MODELS / f"{request.param}.yaml"
    if request.param == "panels":
        path = tmp_path / "panels.yaml"
        path.write_text(PANELS)
    spec = load_display_file(path)
    return spec, load_display(spec)


def written(texts, folder):
    for name, text in texts.items():
        (folder / (name or "fixed.yaml")).write_text(text)
    return load_display(load_display_file(folder / "fixed.yaml"))


@pytest.mark.parametrize("scale", [1.0, 1.0213])
def test_moved_facets_come_back_with_their_rasters(display, tmp_path, scale):
    spec, facets = display
    rng = np.random.default_rng(1)
    turns, shifts = 0.1 * rng.normal(size=(2, facets.count, 3))
    large = facets if scale == 1 else enlarged(facets, scale, np.array([0.1, 0.2, 0.3]))
    middles = middles_of(large.corners, large.corner_start)
    matrices = Rotation.from_rotvec(turns).as_matrix()
    texts = moved_display(spec, large, matrices, middles, shifts, "fixed.obj", scale)
    found, should = written(texts, tmp_path), moved(large, turns, shifts)
    assert found.names == facets.names
    np.testing.assert_array_equal(found.size, facets.size)
    np.testing.assert_array_equal(found.enabled, facets.enabled)
    np.testing.assert_array_equal(found.mirrored, facets.mirrored)
    for name in ("corners", "origin", "du", "dv", "normal"):
        np.testing.assert_allclose(getattr(found, name), getattr(should, name), atol=2e-8, err_msg=name)


def test_angles_of_a_panel_are_those_it_was_turned_by():
    for angles in ((30.0, 20.0, 100.0), (-170.0, -80.0, 3.0), (0.0, 90.0, 40.0), (0.0, -90.0, -120.0)):
        _, up, facing = panel_axes(*angles)
        np.testing.assert_allclose(panel_angles(facing, up), angles, atol=1e-6)


def corner_rows(facets, corners):
    lines = [",".join(COLUMNS)]
    for k in range(facets.count):
        first, last = facets.corner_start[k : k + 2]
        for at in range(first, last):
            name = corner_letter(at - first) if k % 2 else str(at - first + 1)
            lines.append(f"{k + 1},{name},{','.join(repr(1000 * c) for c in corners[at].tolist())}")
    return lines


def test_measured_corners_become_flat_facets(display, tmp_path):
    spec, facets = display
    rng = np.random.default_rng(2)
    turns, shifts = 0.05 * rng.normal(size=(2, facets.count, 3))
    real = moved(facets, turns, shifts)
    noisy = real.corners + 0.001 * rng.normal(size=real.corners.shape)
    (tmp_path / "corners.csv").write_text("\n".join(corner_rows(facets, noisy)) + "\n")
    corners = read_corners(tmp_path / "corners.csv", facets, "mm")
    np.testing.assert_allclose(corners, noisy, atol=1e-12)
    measured = fit_corners(spec, facets, corners, "fixed.obj")
    found = written(measured.files, tmp_path)
    assert np.abs(found.corners - noisy).max() < (0.006 if spec.panels else 0.004)
    assert np.linalg.norm(found.corners - noisy, axis=1) == pytest.approx(measured.residual, abs=1e-7)
    assert len(list(corner_table(facets, measured.residual))) == facets.count + 1
    # What is exact comes back exactly.
    exact = written(fit_corners(spec, facets, real.corners, "fixed.obj").files, tmp_path)
    np.testing.assert_allclose(exact.corners, real.corners, atol=2e-8)
    np.testing.assert_array_equal(exact.size, facets.size)


def test_tables_that_cannot_be_read_are_told_by_line(tmp_path):
    spec = load_display_file(MODELS / "cube5.yaml")
    facets = load_display(spec)
    path = tmp_path / "corners.csv"

    def said(change):
        lines = corner_rows(facets, facets.corners)
        change(lines)
        path.write_text("\n".join(lines))
        with pytest.raises(JobError) as caught:
            read_corners(path, facets)
        return str(caught.value)

    assert "corners.csv:1: expected a first row facet, corner, x, y, z" in said(lambda rows: rows.pop(0))
    assert "corners B of facet 3 are missing" in said(lambda rows: rows.pop(10))
    assert ":4: facet 1 has corner 2 already" in said(lambda rows: rows.__setitem__(3, rows[2]))
    assert ":3: there is no facet '9' (expected a name, or an id from 1 to 5)" in said(
        lambda rows: rows.__setitem__(2, "9,1,0,0,0")
    )
    assert ":3: facet 1 has no corner '7' (expected 1 to 4, or a letter)" in said(
        lambda rows: rows.__setitem__(2, "1,7,0,0,0")
    )
    assert ":3: expected numbers x, y, z, got 0, nan, 0" in said(
        lambda rows: rows.__setitem__(2, "1,2,0,nan,0")
    )
    assert ":3: expected 5 values, got 3" in said(lambda rows: rows.__setitem__(2, "1,2,0"))
    with pytest.raises(JobError, match="no such file"):
        read_corners(tmp_path / "none.csv", facets)


def test_tables_of_another_display_or_unit_are_doubted(display, tmp_path):
    _, facets = display

    def said(corners, units="m"):
        return "\n".join(map(str, doubtful_corners(tmp_path / "t.csv", facets, corners, units)))

    # A survey has axes of its own, and noise.
    rng = np.random.default_rng(5)
    turns, shifts = 0.05 * rng.normal(size=(2, facets.count, 3))
    around = Rotation.from_euler("xyz", (40, 120, 200), degrees=True)
    real = around.apply(moved(facets, turns, shifts).corners) + (3, 40, -200)
    real += 0.0005 * rng.normal(size=real.shape)
    assert said(real) == ""
    assert list(turned_facets(facets, real)) == []
    for unit, metres in (("mm", 0.001), ("ft", 0.3048), ("in", 0.0254), ("cm", 0.01)):
        assert f"is it measured in {unit}?" in said(real / metres)
    assert "taken in in (is it measured in m? --units)" in said(0.0254 * real, "in")
    assert "facet 1" in said(np.zeros_like(real))
    last = slice(facets.corner_start[-2], None)
    for first, second in ((0, 1), (1, 2), (0, 2)):
        wrong = real.copy()
        wrong[last][[first, second]] = real[last][[second, first]]
        # Exchanged across, those of a square make the same square, seen from behind.
        found = said(wrong) or "\n".join(turned_facets(facets, wrong))
        assert re.search(
            rf"the corners of facet {facets.count} |facet {facets.count}.* turned by 1[678]\d°", found
        )
    wrong = real.copy()
    wrong[last] *= 3
    assert f"facet {facets.count}" in said(wrong)
    assert "× as large as in the display (expected about its size)" in said(wrong)
