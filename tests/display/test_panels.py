"""Panels: facets without a mesh, from what a tape measure says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import Facets, corner_pixels, load_display
from quiltcli.display.panels import panel_axes
from quiltcli.errors import DisplayError, JobError
from quiltcli.job import PackSpec, load_display_file
from quiltcli.layout.from_job import layout_for

WALLS = """quilt_display: 1
panels:
- {name: left, pixels: [80, 40], pitch: 5 cm, at: [-2, 1, 0]}
- {name: right, pixels: [60, 40], size: [3 m, 2 m], at: [0, 100 cm, 1.5], yaw_deg: -90}
"""
MESH = """v -4 0 0
v 0 0 0
v 0 2 0
v -4 2 0
v 0 0 3
v 0 2 3
g left
f 1 2 3 4
g right
f 6 3 2 5
"""
AS_MESH = """quilt_display: 1
mesh: walls.obj
resolution: {pixels_per_metre: 20}
"""


def built(folder: Path, text: str) -> Facets:
    (folder / "display.yaml").write_text(text)
    return load_display(load_display_file(folder / "display.yaml"))


def rejected(folder: Path, text: str) -> str:
    with pytest.raises((JobError, DisplayError)) as caught:
        built(folder, text)
    return str(caught.value)


def one(keys: str, more: str = "") -> str:
    return f"quilt_display: 1\n{more}panels:\n- {{pixels: [20, 10], pitch: 1 m, at: [1, 2, 3], {keys}}}\n"


def test_panels_are_the_facets_of_the_mesh_that_says_the_same(tmp_path: Path) -> None:
    walls = MESH.replace("f 6 3 2 5", "f 5 2 3 6").replace("f 5 2 3 6", "f 2 5 6 3")
    (tmp_path / "walls.obj").write_text(walls)
    mesh = built(tmp_path, AS_MESH + "viewing_side: front\n")
    panels = built(tmp_path, WALLS)
    assert panels.names == mesh.names == ("left", "right")
    for name in ("origin", "du", "dv", "normal"):
        np.testing.assert_allclose(getattr(panels, name), getattr(mesh, name), atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(panels.size, mesh.size)
    for facet in range(2):
        ours = {tuple(corner) for corner in np.round(panels.polygon(facet), 12) + 0.0}
        assert ours == {tuple(corner) for corner in np.round(mesh.polygon(facet), 12) + 0.0}


# Corners from the lower left one, anticlockwise as seen from the lit side, of a 20 × 10 m panel at
# (1, 2, 3), by hand.
@pytest.mark.parametrize(
    ("keys", "corners"),
    [
        ("yaw_deg: 0", [[-9, -3, 3], [11, -3, 3], [11, 7, 3], [-9, 7, 3]]),
        ("yaw_deg: 90", [[1, -3, 13], [1, -3, -7], [1, 7, -7], [1, 7, 13]]),
        ("yaw_deg: -90", [[1, -3, -7], [1, -3, 13], [1, 7, 13], [1, 7, -7]]),
        ("pitch_deg: 90", [[-9, 2, 8], [11, 2, 8], [11, 2, -2], [-9, 2, -2]]),
        ("pitch_deg: -90", [[-9, 2, -2], [11, 2, -2], [11, 2, 8], [-9, 2, 8]]),
        ("roll_deg: 90", [[-4, 12, 3], [-4, -8, 3], [6, -8, 3], [6, 12, 3]]),
        # The three in order: facing +X, then up to the sky (up in the image is now -X), then a quarter turn.
        ("yaw_deg: 90, pitch_deg: 90, roll_deg: 90", [[-9, 2, 8], [11, 2, 8], [11, 2, -2], [-9, 2, -2]]),
    ],
)
def test_a_panel_is_turned_as_its_key_says(tmp_path: Path, keys: str, corners: list[list[float]]) -> None:
    facets = built(tmp_path, one(keys))
    np.testing.assert_array_equal(facets.polygon(0), corners)
    np.testing.assert_array_equal(corner_pixels(facets), [[0, 10], [20, 10], [20, 0], [0, 0]])


def test_turns_follow_one_another_as_rotations_do() -> None:
    yaw, pitch, roll = np.radians((25.0, -40.0, 70.0))

    def about(axis: int, angle: float) -> np.ndarray:
        turn, (i, j) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
        return turn

    turned = about(1, yaw) @ about(0, -pitch) @ about(2, -roll)
    np.testing.assert_allclose(panel_axes(25, -40, 70), turned.T, atol=1e-15)


def test_a_raster_has_exactly_the_pixels_it_was_given(tmp_path: Path) -> None:
    text = "quilt_display: 1\nunits: mm\npanels:\n- {pixels: [1333, 751], pitch: 1/6 cm, at: [0, 0, 0]}\n"
    facets = built(tmp_path, text)
    assert facets.size.tolist() == [[1333, 751]]
    assert facets.du[0, 0] == pytest.approx(0.01 / 6, rel=1e-15)
    assert facets.polygon(0)[1, 0] == pytest.approx(1333 * 0.01 / 12, rel=1e-15)


def test_numbers_are_units_and_texts_bring_their_own(tmp_path: Path) -> None:
    panel = "panels:\n- {pixels: [10, 5], size: [1000, 0.5 m], at: [200, 1 m, -1/4 m]}\n"
    facets = built(tmp_path, f"quilt_display: 1\nunits: mm\n{panel}")
    np.testing.assert_allclose(facets.polygon(0)[0], [-0.3, 0.75, -0.25], atol=1e-15)


def test_with_z_up_a_panel_stands_where_it_would_with_y_up(tmp_path: Path) -> None:
    y_up = built(tmp_path, one("yaw_deg: 30, pitch_deg: 10"))
    z_up = built(
        tmp_path, one("yaw_deg: 30, pitch_deg: 10", "up_axis: z\n").replace("[1, 2, 3]", "[1, -3, 2]")
    )
    np.testing.assert_array_equal(y_up.corners, z_up.corners)


def test_a_mesh_with_z_up_is_set_upright(tmp_path: Path) -> None:
    upright = re.sub(r"^v (\S+) (\S+) (\S+)$", r"v \1 -\3 \2", MESH, flags=re.MULTILINE)
    (tmp_path / "walls.obj").write_text(MESH)
    expected = built(tmp_path, AS_MESH)
    (tmp_path / "walls.obj").write_text(upright)
    found = built(tmp_path, AS_MESH + "up_axis: z\n")
    np.testing.assert_array_equal(found.corners + 0.0, expected.corners + 0.0)


def test_the_display_may_be_moved_and_scaled(tmp_path: Path) -> None:
    facets = built(tmp_path, one("yaw_deg: 90", "transform: {scale: 2, translate: [0, 0, 1]}\n"))
    np.testing.assert_array_equal(facets.polygon(0)[0], [2, -6, 27])
    np.testing.assert_array_equal(facets.du, [[0, 0, -2]])


def test_a_mirrored_panel_starts_at_its_right(tmp_path: Path) -> None:
    facets = built(tmp_path, one("mirror: true"))
    np.testing.assert_array_equal(facets.origin, [[11, 7, 3]])
    np.testing.assert_array_equal(facets.du, [[-1, 0, 0]])
    np.testing.assert_array_equal(facets.normal, [[0, 0, 1]])


def test_panels_keep_their_places_on_the_canvas(tmp_path: Path) -> None:
    text = WALLS.replace("-90}", "-90, place: {at: [80, 4], rotate: 90}}")
    layout = layout_for(PackSpec(size=(128, 64)), built(tmp_path, text))
    at = layout.quilt_from_facet[list(layout.facet).index(2)]
    np.testing.assert_array_equal(at, [[0, -1, 120], [1, 0, 4]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "quilt_display: 1\nunits: m\n",
            "mesh: missing key (polygon mesh; or panels: flat rectangles; or surfaces; or a projection)",
        ),
        (WALLS.replace("pitch: 5 cm, ", ""), "expected pitch or size, got neither"),
        (WALLS.replace("5 cm", "5 parsec"), "expected a length such as 6 mm, 1/6 mm or a number"),
        (WALLS.replace("5 cm", "0 cm"), "must be greater than 0"),
        (WALLS.replace("[-2, 1, 0]", "[-2, 1]"), "expected 3 lengths, x, y and z, got 2"),
        (WALLS + "resolution: {pixels_per_metre: 2}\n", "belongs to a mesh"),
        (WALLS + "facets: {1: {name: x}}\n", "keys of each panel"),
        (WALLS + "viewing_side: back\n", "turn one by yaw_deg: 180"),
        (WALLS + "up_axis: x\n", "expected y or z"),
        (WALLS + "layout: {from_uv: true, size: [8, 8]}\n", "texture coordinates of a mesh"),
        (one("roll_deg: 20", "transform: {scale: [1, 2, 1]}\n"), "shears facet 1"),
        (WALLS + "- {pixels: [8, 4], size: [4, 2], at: [-2, 1, 0]}\n", "same corners as facet 1"),
        (WALLS.replace("[80, 40]", "[70000, 40]"), "at most 65536"),
    ],
)
def test_what_cannot_be_meant_is_said(tmp_path: Path, text: str, said: str) -> None:
    message = rejected(tmp_path, text)
    assert said in message
    assert "display.yaml" in message


def test_a_doubled_panel_is_shown_in_its_line(tmp_path: Path) -> None:
    message = rejected(tmp_path, WALLS + "- {pixels: [8, 4], size: [4, 2], at: [-2, 1, 0]}\n")
    assert "display.yaml:5:3: panels[2]" in message
