"""What `check` and `render` say of displays that are not wrong."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from quiltcli.display import load_display
from quiltcli.display.notices import disagreeing, display_notices
from quiltcli.errors import DisplayError
from quiltcli.job import load_display_file

CORNER = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 1\nv 1 1 1\n"
TALL = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 -1 1\nv 1 2 1\nv 1 -1 0\nv 1 2 0\n"


def display(folder: Path, mesh: str, resolution: str = "pixels_per_metre: 100", more: str = "") -> Path:
    (folder / "m.obj").write_text(mesh)
    path = folder / "d.yaml"
    path.write_text(f"quilt_display: 1\nmesh: m.obj\nresolution: {{{resolution}}}\n{more}")
    return path


def facets(path: Path):  # type: ignore[no-untyped-def]
    return load_display(load_display_file(path))


@pytest.mark.parametrize(
    ("mesh", "pairs"),
    [
        (CORNER + "f 1 2 3 4\nf 2 5 6 3\n", []),
        (CORNER + "f 1 2 3 4\nf 3 6 5 2\n", [(0, 1)]),
        # The second wall is taller: the edges overlap in part only.
        (TALL + "f 1 2 3 4\nf 7 5 6 8\n", []),
        (TALL + "f 1 2 3 4\nf 8 6 5 7\n", [(0, 1)]),
        # Three walls at one edge tell nothing.
        (CORNER + "v 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 3 6 5 2\nf 2 7 8 3\n", []),
    ],
)
def test_facets_that_are_wound_the_other_way(tmp_path: Path, mesh: str, pairs: list[tuple[int, int]]) -> None:
    assert disagreeing(facets(display(tmp_path, mesh))) == pairs


def test_facets_lit_on_both_sides_cannot_disagree(tmp_path: Path) -> None:
    path = display(tmp_path, CORNER + "f 1 2 3 4\nf 3 6 5 2\n", more="viewing_side: both\n")
    assert list(display_notices(facets(path))) == []


@pytest.mark.parametrize(
    "name", ["cave5", "cube5", "dodecahedron", "sphere840", "teapot1024", "corner_billboard", "knot1200"]
)
def test_shipped_displays_agree(name: str) -> None:
    path = Path(__file__).parents[2] / "display_models" / f"{name}.yaml"
    assert disagreeing(facets(path)) == []


def test_check_says_so_and_passes(tmp_path: Path) -> None:
    path = display(tmp_path, CORNER + "g left\nf 1 2 3 4\ng right\nf 3 6 5 2\n")
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == 0
    assert "facets 1 (left) and 2 (right) disagree on their lit side" in result.stderr


def test_a_mesh_in_millimetres(tmp_path: Path) -> None:
    wall = "v 0 0 0\nv 4500 0 0\nv 4500 3000 0\nv 0 3000 0\nf 1 2 3 4\n"
    with pytest.raises(DisplayError) as caught:
        facets(display(tmp_path, wall))
    assert str(caught.value).endswith("a side; is the mesh in another unit? units: mm)")
    found = list(display_notices(facets(display(tmp_path, wall, "facet_pixels: [1500, 1000]"))))
    assert found[-1] == "the display is 4500 m large: is its mesh in another unit (units: mm?)"


@pytest.mark.parametrize(
    ("resolution", "width"),
    [
        ("pixels_per_metre: 166.6666667", 750),
        ("pixels_per_metre: 166.6667", 750),
        ("pitch_mm: 6", 750),
        ("pitch: 6 mm", 750),
        ("pitch: 36/6 mm", 750),
        ("pitch: 0.6 cm", 750),
        ("pitch: 0.006 m", 750),
        ("pitch: 1/4 in", 709),
    ],
)
def test_a_wall_is_as_wide_as_its_panels(tmp_path: Path, resolution: str, width: int) -> None:
    wall = "v 0 0 0\nv 4.500001 0 0\nv 4.500001 3 0\nv 0 3 0\nf 1 2 3 4\n"
    assert facets(display(tmp_path, wall, resolution)).size[0, 0] == width


def test_a_wall_that_needs_another_pixel_gets_it(tmp_path: Path) -> None:
    wall = "v 0 0 0\nv 4.50006 0 0\nv 4.50006 3 0\nv 0 3 0\nf 1 2 3 4\n"
    assert facets(display(tmp_path, wall, "pitch_mm: 6")).size[0].tolist() == [751, 500]
    assert np.allclose(facets(display(tmp_path, wall, "pitch: 6 mm")).du, [[0.006, 0, 0]])


@pytest.mark.parametrize(
    ("corner", "words"),
    [
        ("1e20", "facet 1 reaches 1e+20 m from the world's origin"),
        ("1e-300", "facet 1 is 1e-300 m large (expected 1e-09 or more)"),
    ],
)
def test_facets_beyond_measure(tmp_path: Path, corner: str, words: str) -> None:
    mesh = f"v 0 0 0\nv {corner} 0 0\nv {corner} {corner} 0\nv 0 {corner} 0\nf 1 2 3 4\n"
    with pytest.raises(DisplayError, match=re.escape(words)):
        facets(display(tmp_path, mesh))


def test_pixels_of_a_projection_have_no_pitch_to_doubt(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    for pixels in ("[8, 8]", "[4096, 4096]"):
        path.write_text(f"quilt_display: 1\nprojection: {{kind: dome_master, pixels: {pixels}}}\n")
        assert list(display_notices(facets(path))) == []
    path.write_text("quilt_display: 1\npanels:\n- {pixels: [8, 8], pitch: 25 cm, at: [0, 0, 0]}\n")
    (notice,) = display_notices(facets(path))
    assert notice.startswith("the pixel pitch is 250 mm, outside 0.1 to 100 mm")
