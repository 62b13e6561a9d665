"""What can be wrong with a surface or a projection, and what is said of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quiltcli.display import load_display
from quiltcli.errors import QuiltError
from quiltcli.formats.exr.image import write_exr
from quiltcli.job import load_display_file
from tests.helpers.curved_jobs import write_map

SHEET = np.stack(np.meshgrid(np.linspace(-1, 1, 8), np.linspace(1, -1, 6)))


def message(text: str, folder: Path) -> str:
    (folder / "d.yaml").write_text(f"quilt_display: 1\n{text}\n")
    with pytest.raises(QuiltError) as error:
        load_display(load_display_file(folder / "d.yaml"))
    return str(error.value).replace(f"{folder}/", "")


def surface(keys: str) -> str:
    return f"surfaces:\n- {{{keys}, pixels: [8, 6]}}"


FORMULA = 'kind: formula, x: "2*s-1", y: "1-2*t", z: "0*s"'


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("kind: spher", "d.yaml:3:10: surfaces[0].kind: expected plane, sphere, cylinder"),
        ("kind: sphere", "d.yaml:3:3: surfaces[0].radius: missing key (radius R"),
        ("kind: sphere, radius: 1, arc_deg: [30, 30]", "are both 30 (expected a range)"),
        ("kind: sphere, radius: 1, zenith_deg: [0, 200]", "must be from 0 to 180 degrees, got 200"),
        (
            "kind: sphere, radius: 1, arc_deg: [180, -180]",
            "d.yaml:3:3: surfaces[0].lit: the picture is mirrored",
        ),
        (
            FORMULA + ", lit: back",
            "mirrored as seen from back (say mirror: true, or let s run the other way)",
        ),
        (FORMULA.replace("2*s-1", "2*q-1"), "surfaces[0].x: at character 3: unknown name 'q'"),
        (FORMULA.replace("0*s", "s.real"), "at character 1: expected numbers, names"),
        (FORMULA.replace("0*s", "open(s)"), "unknown function 'open'"),
        (FORMULA.replace("0*s", "log(s-2)"), "has no point at s ="),
        *(
            (FORMULA.replace(place, wild), "has no point at s =")
            for place in ("2*s-1", "0*s")
            for wild in ("s/0", "1/(s-0.5)", "9**9**9**9", "1e308*10*s", "exp(1000*s)-exp(999*t)", "sqrt(-s)")
        ),
        (FORMULA.replace("2*s-1", "0*s"), "is degenerate at s ="),
        (FORMULA.replace("2*s-1", "abs(s-0.41)"), "is folded over near s ="),
        ('kind: implicit, x: s, y: "-t", z: "0*s"', "surfaces[0].zero: missing key"),
        ('kind: implicit, x: s, y: "-t", z: "0*s", zero: z-0.1', "surfaces[0].zero: is not 0 on the surface"),
        ("kind: map, file: half.exr", "half.exr: holds half floats"),
        ("kind: map, file: none.exr", "none.exr: has no pixel with a point (all are NaN)"),
        ("kind: map, file: other.exr", "surfaces[0].pixels: the map is 4 × 3, got 8 × 6"),
        ("kind: map, file: flat.exr", "flat.exr: has the channels R, Z (expected X, Y, Z or R, G, B)"),
        ("kind: map, file: gone.exr", "surfaces[0].file: no such file"),
        (
            "kind: plane, width: 1, height: 1, mask: mask.exr",
            "surfaces[0].mask: is 4 × 3 pixels (expected 8 × 6",
        ),
        ("kind: plane, width: 1, height: 1, mask: black.exr", "leaves no pixel"),
        ("kind: bezier, points: [[[0, 0, 0], [1, 0, 0]], [[0, -1, 0]]]", "at least 2 items, got 1"),
        (
            "kind: nurbs, degree: [3, 1], points: [[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]]",
            "at most 1 for 2",
        ),
        ("kind: mesh, file: bare.obj", "bare.obj: has faces without texture coordinates"),
        ("kind: mesh, file: twice.obj", "twice.obj: its texture is used twice at pixel"),
    ],
)
def test_surfaces(keys: str, expected: str, tmp_path: Path) -> None:
    flat = np.stack((*SHEET, np.zeros((6, 8))))
    write_map(tmp_path / "half.exr", flat, np.float16)
    write_map(tmp_path / "none.exr", flat * np.nan)
    write_map(tmp_path / "other.exr", flat[:, ::2, ::2])
    write_map(tmp_path / "mask.exr", np.ones((3, 3, 4)))
    write_map(tmp_path / "black.exr", np.zeros((3, 6, 8)))
    write_exr(tmp_path / "flat.exr", {name: np.zeros((6, 8), np.float32) for name in "RZ"}, {})
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    (tmp_path / "bare.obj").write_text(square + "f 1 2 3 4\n")
    uv = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (tmp_path / "twice.obj").write_text(
        square + "v 0 0 1\nv 1 0 1\nv 1 1 1\n" + uv + "f 1/1 2/2 3/3 4/4\nf 5/1 6/2 7/3\n"
    )
    assert expected in message(surface(keys), tmp_path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("projection: {kind: cubemap, pixels: [64, 64]}", "projection.pixels: expected 4 × 3 square faces"),
        (
            "projection: {kind: fisheye, pixels: [64, 64], mapping: polynomial}",
            "projection.polynomial: missing key",
        ),
        ("projection: {kind: fisheye, pixels: [64, 64], mapping: orthographic, fov_deg: 200}", "at most 180"),
        (
            "projection: {kind: equirect, pixels: [64, 64]}\nresolution: {pitch_mm: 4}",
            "cannot stand beside projection",
        ),
        (
            "projection: {kind: offset, pixels: [64, 64], file: fold.exr}",
            "fold.exr: cell (3, 0) is folded over",
        ),
        (
            "projection: {kind: mesh, pixels: [64, 64], file: warp.data}",
            "warp.data:3: expected five numbers, x y u v i",
        ),
        (
            "projection: {kind: map, pixels: [64, 64], file: small.exr}",
            "small.exr: is 8 × 6 pixels (expected 64 × 64",
        ),
        (
            "surfaces:\n- {kind: sphere, radius: 1, pixels: [8, 8]}\nresolution: {pitch_mm: 4}",
            "belongs to a mesh",
        ),
    ],
)
def test_projections_and_what_stands_beside(text: str, expected: str, tmp_path: Path) -> None:
    fold = np.zeros((3, 6, 8))
    fold[0, :, 4] = -2.0
    write_map(tmp_path / "fold.exr", fold)
    write_map(tmp_path / "small.exr", np.ones((3, 6, 8)))
    (tmp_path / "warp.data").write_text("2\n2 2\n-1 1 0 1\n1 1 1 1 1\n-1 -1 0 0 1\n1 -1 1 0 1\n")
    assert expected in message(text, tmp_path)


def test_all_surfaces_faults_come_at_once(tmp_path: Path) -> None:
    lines = [FORMULA + ", lit: back", FORMULA.replace("2*s-1", "0*s")]
    text = "surfaces:\n" + "".join(f"- {{{line}, pixels: [8, 6]}}\n" for line in lines)
    found = message(text, tmp_path)
    assert "surfaces[0]" in found
    assert "surfaces[1]: surface 2: is degenerate" in found
