"""Free-form surfaces of OBJ files: on the circle they describe, and what is wrong with others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.errors import QuiltError
from tests.helpers.curved_jobs import chart_of

W = 0.7071067811865476
QUARTER = f"""# a quarter of a cylinder of radius 1 about y, u to the right, v up
v -1 -1 0
v -1 -1 1 {W}
v 0 -1 1
v -1 1 0
v -1 1 1 {W}
v 0 1 1
cstype rat bspline
deg 2 1
surf 0 1 0 1 1/1/1 2 3 \\
  4 5 -1
parm u 0 0 0 1 1 1
parm v 0 0 1 1
end
"""


def chart(folder: Path, text: str, more: str = ""):
    (folder / "patch.obj").write_text(text)
    return chart_of("kind: nurbs, file: patch.obj" + more, folder)


def test_a_rational_patch_lies_on_its_cylinder_the_right_way_up(tmp_path: Path) -> None:
    found = chart(tmp_path, QUARTER)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(32) + 0.5)
    points = found.points(x, y)
    # The middle of the circle is (-1 + 1, y, 0): u goes from (-1, 0) by (-1, 1) to (0, 1).
    assert np.abs(np.hypot(points[0], points[2]) - 1).max() < 1e-12
    assert np.abs(points[1] - (1 - 2 * y / 32)).max() < 1e-12
    assert points[0, 0, -1] > points[0, 0, 0]


def test_it_is_the_patch_that_a_display_file_writes_down(tmp_path: Path) -> None:
    rows = "[[[-1, 1, 0], [-1, 1, 1], [0, 1, 1]], [[-1, -1, 0], [-1, -1, 1], [0, -1, 1]]]"
    weights = f"[[1, {W}, 1], [1, {W}, 1]]"
    other = chart_of(f"kind: nurbs, degree: [2, 1], weights: {weights}, points: {rows}", tmp_path)
    found = chart(tmp_path, QUARTER)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(32) + 0.5)
    assert np.abs(found.points(x, y) - other.points(x, y)).max() < 1e-15
    assert (found.normals(x, y) * other.normals(x, y)).sum(axis=0).min() > 1 - 1e-12


def test_a_part_of_a_patch_is_that_part(tmp_path: Path) -> None:
    whole = chart(tmp_path, QUARTER)
    part = chart(tmp_path, QUARTER.replace("surf 0 1 0 1", "surf 0.25 0.75 0.5 1"))
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(32) + 0.5)
    expected = whole.points(16 + x / 2, y / 2)  # v runs up: its upper half is the upper half
    assert np.abs(part.points(x, y) - expected).max() < 1e-12


def test_pieces_of_bezier_join(tmp_path: Path) -> None:
    # Two quadratic pieces along u, (x, x²) cut at x = 0: control points by blossoming.
    rows = [[(-1, 1), (-0.5, 0), (0, 0), (0.5, 0), (1, 1)]] * 2
    vertices = [f"v {x} {y} {z}" for y, row in zip((0, 1), rows, strict=True) for x, z in row]
    numbers = " ".join(map(str, range(1, 11)))
    text = "\n".join(vertices) + f"\ncstype bezier\ndeg 2 1\nsurf 0 2 0 1 {numbers}\n"
    found = chart(tmp_path, text + "parm u 0 1 2\nparm v 0 1\nend\n")
    x, _, z = found.points(np.linspace(0, 64, 33), np.full(33, 7.0))
    assert np.abs(x - np.linspace(-1, 1, 33)).max() < 1e-12
    assert np.abs(z - x * x).max() < 1e-12


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "cstype rat bspline",
            "cstype cardinal",
            "patch.obj:8: cstype is 'cardinal' (expected bezier or bspline)",
        ),
        ("deg 2 1", "deg 2 0", "patch.obj:9: deg is 2 0 (expected two whole numbers from 1 to 9)"),
        ("4 5 -1", "4 5 7", "patch.obj:10: has no vertex '7' (there are 6)"),
        ("4 5 -1", "4 5", "has 5 control points (expected 3 × 2 = 6 by its parm and deg)"),
        ("parm u 0 0 0 1 1 1", "parm u 0 0 1 1 1 0", "parm u descends"),
        ("parm u 0 0 0 1 1 1", "parm u 0 0 1 1", "parm u has 4 numbers (expected 6 or more)"),
        ("parm v 0 0 1 1", "", "the surface has no parm v"),
        ("surf 0 1 0 1", "surf 0 2 0 1", "the surface's u is 0 to 2 (expected a range in 0 to 1)"),
        ("end\n", "trim 0 1 1\nend\n", "has trim: the surface is cut"),
        ("end\n", "surf 0 1 0 1 1 2 3 4 5 6\nend\n", "has a second surface, the first is in line 10"),
        (f"v -1 1 1 {W}", "v -1 1 1 -2", "has the weight -2 (expected weights above 0)"),
        ("v 0 1 1", "v 0 1 one", "expected 3 numbers or more, got '0 1 one'"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(old: str, new: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(QuiltError) as error:
        chart(tmp_path, QUARTER.replace(old, new))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (", degree: [2, 1]", "degree: the file has it"),
        (", points: [[[0,0,0],[1,0,0]],[[0,1,0],[1,1,0]]]", "points:"),
    ],
)
def test_a_file_and_control_points_exclude_each_other(more: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(QuiltError) as error:
        chart(tmp_path, QUARTER, more)
    assert words in str(error.value)
    with pytest.raises(QuiltError) as error:
        chart_of("kind: nurbs", tmp_path)
    assert "missing key (rows of control points, or file with a free-form surface)" in str(error.value)
