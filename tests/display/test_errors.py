"""Displays that cannot be: the exact message for each, all of them at once."""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

from pathlib import Path

import pytest

from quiltcli.display import load_display
from quiltcli.errors import DisplayError
from quiltcli.job import load_display_file

POINTS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 0.5 0.5 0.1\nv 0.4 -1 0\nv 0 0 0\nv 1.2 0.4 0\n"
DENSITY = "resolution: {pixels_per_metre: 100}\n"


def problem(tmp_path: Path, faces: str, display: str = DENSITY) -> str:
    """The message, with paths shortened to MESH and FILE."""
    (tmp_path / "m.obj").write_text(POINTS + faces)
    path = tmp_path / "d.yaml"
    path.write_text("quilt_display: 1\nmesh: m.obj\n" + display)
    with pytest.raises(DisplayError) as caught:
        load_display(load_display_file(path))
    return str(caught.value).replace(str(tmp_path / "m.obj"), "MESH").replace(str(path), "FILE")


BAD_FACES = {
    "f 1 2 6 4": "MESH:10: facet 1: not planar: its corners lie up to 0.0495 m off its plane "
    "(expected at most 0.000142 m, 0.0001 of its size)",
    "f 1 3 2 4": "MESH:10: facet 1: its outline crosses itself and encloses no area (expected a simple polygon)",
    "f 1 3 9 7 4": "MESH:10: facet 1: edges 1 and 4 cross or touch (expected a simple polygon)",
    "f 1 2 5": "MESH:10: facet 1: all its corners lie on one line (expected a face with an area)",
    "f 1 2 2 3": "MESH:10: facet 1: corners 2 and 3 are the same point (expected distinct corners)",
    "f 1 2 3 8": "MESH:10: facet 1: corners 4 and 1 are the same point (expected distinct corners)",
    "f 1 5 2 3": "MESH:10: facet 1: edges 1 and 2 cross or touch (expected a simple polygon)",
    "f 1 2 3\nf 2 3 4\nf 3 1 2": "MESH:12: facet 3: has the same corners as facet 1 (expected every face once)",
    "f 1 2 3\nf 3 2 8": "MESH:11: facet 2: has the same corners as facet 1 (expected every face once)",
    "g top\nf 1 2 5": "MESH:11: facet 1 (top): all its corners lie on one line (expected a face with an area)",
}


@pytest.mark.parametrize("faces", BAD_FACES)
def test_faces_that_are_no_facets(tmp_path: Path, faces: str) -> None:
    assert problem(tmp_path, faces + "\n") == BAD_FACES[faces]


BAD_DISPLAYS = {
    "facets: {3: {name: none}}\n"
    + DENSITY: "FILE:3:13: facets.3: there is no facet 3 (the mesh has facets 1 to 1)",
    "facets:\n  1: {name: wall, up: [0, 0, 1]}\n"
    + DENSITY: "FILE:4:23: facets.1.up: [0, 0, 1] is perpendicular to "
    "facet 1 (wall) (expected a direction that leans along it by 1 degree or more)",
    "resolution: {pixels_per_metre: 100000}\n": "FILE:3:32: resolution.pixels_per_metre: makes facet 1 "
    "over 65536 × over 65536 pixels (expected 1 to 65536 a side)",
    "resolution: {pixels_per_metre: 0.5}\n": "FILE:3:32: resolution.pixels_per_metre: makes facet 1 "
    "less than 1 × less than 1 pixels (expected 1 to 65536 a side)",
    "layout: {from_uv: true, size: [64, 64]}\nresolution: {pixels_per_metre: 0.5}\n": "FILE:4:32: "
    "resolution.pixels_per_metre: makes facet 1 less than 1 × less than 1 pixels (expected 1 to 65536 a side; "
    "leave resolution out, since the texture coordinates tell)",
    "layout: {from_uv: true, size: [64, 64]}\n": "FILE:3:9: layout: the mesh has no texture coordinates "
    "(expected them, or resolution beside another layout)",
    "resolution: {facet_pixels: [70000, 10]}\n": "FILE:3:28: resolution.facet_pixels: makes facet 1 "
    "over 65536 × 10 pixels (expected 1 to 65536 a side)",
    "facets: {1: {facet_pixels: [10, 70000]}}\n" + DENSITY: "FILE:3:28: facets.1.facet_pixels: makes facet 1 "
    "10 × over 65536 pixels (expected 1 to 65536 a side)",
}


@pytest.mark.parametrize("display", BAD_DISPLAYS)
def test_displays_that_do_not_fit_their_mesh(tmp_path: Path, display: str) -> None:
    assert problem(tmp_path, "f 1 2 3 4\n", display) == BAD_DISPLAYS[display]


def test_every_problem_is_told_once(tmp_path: Path) -> None:
    faces = "f 1 2 5\nf 1 2 3\nf 1 3 2 4\nf 1 2 6 4\n"
    lines = problem(tmp_path, faces, "facets: {9: {mirror: true}}\n" + DENSITY).splitlines()
    starts = [line.split(" (")[0] for line in lines]
    assert starts == [
        "FILE:3:13: facets.9: there is no facet 9",
        "MESH:10: facet 1: all its corners lie on one line",
        "MESH:12: facet 3: its outline crosses itself and encloses no area",
        "MESH:13: facet 4: not planar: its corners lie up to 0.0495 m off its plane",
    ]


def test_many_problems_are_cut_short(tmp_path: Path) -> None:
    lines = problem(tmp_path, "f 1 2 5\n" * 60).splitlines()
    assert len(lines) == 51
    assert lines[50] == "FILE: and 10 problems more"


def test_nearly_planar_is_planar(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0.0002\nv 0 1 0\nf 1 2 3 4\n")
    (tmp_path / "d.yaml").write_text("quilt_display: 1\nmesh: m.obj\n" + DENSITY)
    assert load_display(load_display_file(tmp_path / "d.yaml")).count == 1
