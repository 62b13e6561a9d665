from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from quiltcli.analysis.info import Info, describe
from quiltcli.analysis.info.record import finite, number, spread
from quiltcli.cli import main
from quiltcli.errors import DisplayError, JobError, OutputError
from quiltcli.formats.exr.image import write_exr
from tests.helpers.projected import WALL, projected
from tests.helpers.tiny_job import replaced, write_tiny_job

MODELS = Path(__file__).parents[2] / "display_models"


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_tiny_job(tmp_path).parent


def lines(info: Info) -> dict[str, str]:
    return dict(info.lines)


def out(*words: str) -> str:
    result = CliRunner().invoke(main, ["info", *words])
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def test_a_display(tiny: Path) -> None:
    info = describe("display.yaml")
    assert info.kind == "display"
    assert lines(info) | {"geometry": ""} == {
        "mesh": "walls.obj",
        "facets": "2: 2 quadrilaterals",
        "lit side": "front (walked around)",
        "area": "8 m²",
        "pixels": "8,192",
        "pitch": "31.25 mm",
        "bounds": "[-1, -1, 0] to [1, 1, 2] m, 2 × 2 × 2 m",
        "shared edges": "1",
        "geometry": "",
    }
    assert info.rows == [
        ["1", "back", "4", "64×64", "4", "31.25", "[0, 0, 1]", ""],
        ["2", "right", "4", "64×64", "4", "31.25", "[-1, 0, 0]", ""],
    ]


def test_a_display_with_facets_of_their_own(tiny: Path) -> None:
    extra = "viewing_side: back\nfacets: {1: {enabled: false}, 2: {mirror: true, facet_pixels: [8, 32]}}\n"
    replaced(tiny, "display.yaml", "resolution:", extra + "resolution:")
    info = describe("display.yaml")
    assert lines(info)["facets"] == "2: 2 quadrilaterals, 1 enabled"
    assert lines(info)["lit side"] == "back (seen from inside)"
    assert lines(info)["pitch"] == "62.5 to 250 mm"
    assert lines(info)["pixels"] == "256"
    assert [row[-1] for row in info.rows] == ["not enabled", "mirrored"]
    assert info.rows[1][5] == "250 × 62.5"


@pytest.mark.parametrize(
    ("name", "facets"),
    [
        ("cube5", "5: 5 quadrilaterals"),
        ("dodecahedron", "12: 12 pentagons"),
        ("icosahedron", "20: 20 triangles"),
        ("cave5", "5: 5 quadrilaterals"),
    ],
)
def test_the_models(name: str, facets: str) -> None:
    assert lines(describe(MODELS / f"{name}.yaml"))["facets"] == facets


def test_a_mesh(tiny: Path) -> None:
    info = describe("walls.obj")
    assert info.kind == "mesh"
    assert info.data["polygons"] == {"4": 2}
    assert info.data["texture_coordinates"] is False
    assert info.data["triangles"] == 4
    assert lines(info)["area"] == "8 square units of the file"
    assert lines(info)["note"].startswith("the scene has no lights")


def test_a_layout(tiny: Path) -> None:
    assert (
        CliRunner().invoke(main, ["pack", "display.yaml", "-o", "a.yaml", "--size", "200x100"]).exit_code == 0
    )
    info = describe("a.yaml")
    assert info.kind == "layout"
    assert lines(info)["pages"] == "1 page of 200×100 pixels"
    assert lines(info)["facets"] == "2, 8,192 pixels"
    assert lines(info)["fill"] == "41.0 %"
    assert lines(info)["padding"] == "2 pixels"
    assert info.data["transforms"]["resampled"] == 0
    assert sum(info.data["transforms"].values()) == 2


@pytest.mark.parametrize(
    ("rows", "kind", "corner"),
    [
        ("[[1, 0, 5], [0, 1, 6]]", "upright", [5, 6]),
        ("[[0, -1, 69], [1, 0, 6]]", "turned", [5, 6]),
        ("[[-1, 0, 69], [0, 1, 6]]", "mirrored", [5, 6]),
        ("[[0.5, 0, 5], [0, 0.5, 6]]", "resampled", [5, 6]),
        ("[[1, 0, 5.5], [0, 1, 6]]", "resampled", [5.5, 6]),
    ],
)
def test_the_transforms_of_a_layout(rows: str, kind: str, corner: list[float], tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "quilt_layout: 1\npages:\n- size: [100, 100]\nfacets:\n"
        f"- {{id: 3, page: 1, size: [64, 64], quilt_from_facet: {rows}, origin: [0, 0, 0],"
        " du: [1, 0, 0], dv: [0, -1, 0], polygon: [[0, 0], [64, 0], [0, 64]]}\n"
    )
    [place] = describe(path).data["places"]
    assert (place["transform"], place["corner"]) == (kind, corner)


def test_a_scene(tiny: Path) -> None:
    replaced(
        tiny, "scene.yaml", "lights:", "- {mesh: walls.obj}\nlights:\n- {type: point, position: [0, 3, 0]}"
    )
    info = describe("scene.yaml")
    assert info.kind == "scene"
    assert lines(info)["objects"] == "2"
    assert lines(info)["triangles"] == "8"
    assert lines(info)["lights"] == "1 directional light, 1 point light"
    assert lines(info)["bounds"] == "[-1, -1, -1] to [1, 1, 2] m, 2 × 2 × 3 m"
    assert [row[:3] for row in info.rows] == [["1", "ball", "4"], ["2", "walls", "4"]]
    assert info.rows[0][3:] == ["[-0.5, -0.5, -1]", "[0.5, 0.5, -0.2]"]


def test_a_job(tiny: Path) -> None:
    replaced(tiny, "job.yaml", "[-0.5, 0.2, 3]", "[0, 3, -2]")
    replaced(tiny, "job.yaml", "frames: 1-4", "frames: 1,4\nfps: 30000/1001")
    info = describe("job.yaml")
    said = lines(info)
    assert said["frames"] == "1,4"
    assert said["fps"] == "30000/1001"
    assert said["viewer.path.keyframes"] == "2 keyframes"
    assert said["render.bleed"] == "2"
    assert said["output.channels"] == "[rgba, Z]"
    assert said["length"] == "2 frames, 0.0667333 s"
    assert said["eye's way"] == "5 m"
    assert said["eye's bounds"] == "[0, 0, -2] to [0, 3, 2] m, 0 × 3 × 4 m"
    assert [(row[0], row[3]) for row in info.rows] == [("1", "2"), ("4", "1")]


def test_a_job_that_is_wrong(tiny: Path) -> None:
    replaced(tiny, "walls.obj", "f 1 2 3 4", "f 1 2 4 3")
    with pytest.raises(DisplayError):
        describe("job.yaml")


def test_an_image(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    z = np.array([[1, 2, np.inf], [np.nan, 4, -np.inf]], np.float32)
    channels = {
        "Z": z,
        "id": np.array([[0, 7, 4_000_000_000]] * 2, np.uint32),
        "A": np.zeros((2, 3), np.float16),
    }
    write_exr(path, channels, {"quilt:frame": 3}, "piz", data_window=((10, 20), (12, 21)))
    info = describe(path)
    [part] = info.data["parts"]
    assert info.kind == "image"
    assert lines(info)["data window"] == "3×2 pixels, from (10, 20)"
    assert "display window" not in lines(info)
    assert lines(info)["compression"] == "piz"
    assert lines(info)["quilt:frame"] == "3"
    assert list(info.columns) == ["channel", "type", "least", "greatest", "finite pixels", "nan", "inf"]
    assert info.rows == [
        ["A", "half", "0", "0", "6", "0", "0"],
        ["Z", "float", "1", "4", "3", "1", "2"],
        ["id", "uint", "0", "4000000000", "6", "0", "0"],
    ]
    assert part["channels"][2]["range"] == [0, 4_000_000_000]


def test_an_image_without_a_finite_pixel(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", {"Z": np.full((2, 2), np.inf, np.float32)}, {})
    info = describe(tmp_path / "a.exr")
    assert info.rows == [["Z", "float", "none", "none", "0", "0", "4"]]
    assert info.data["parts"][0]["channels"][0]["range"] is None


def test_an_image_of_several_parts(tmp_path: Path) -> None:
    import OpenEXR

    header = {"displayWindow": ((0, 0), (3, 1)), "type": OpenEXR.scanlineimage}
    parts = [OpenEXR.Part(dict(header), {"Y": np.zeros((2, 4), "f4")}, name) for name in ("left", "right")]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    info = describe(tmp_path / "a.exr")
    assert [row[:2] for row in info.rows] == [["left", "Y"], ["right", "Y"]]
    assert lines(info)["right data window"] == "4×2 pixels, from (0, 0)"


def test_what_is_no_image(tmp_path: Path) -> None:
    (tmp_path / "a.exr").write_text("hello, this is text")
    with pytest.raises(OutputError) as caught:
        describe(tmp_path / "a.exr")
    assert str(caught.value) == f"{tmp_path / 'a.exr'}: is no OpenEXR image"


def test_what_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(JobError) as caught:
        describe(tmp_path / "a.yaml")
    assert str(caught.value) == f"{tmp_path / 'a.yaml'}: no such file"


KEYS = {
    "display.yaml": "area_m2 bounds enabled facet_table facets from_uv kind mesh path pitch_mm pixels"
    " polygons sha256 shared_edges viewing_side",
    "out/layout.yaml": "display display_sha256 facets fill kind method padding pages path pixels places"
    " quilt_pixels transforms",
    "scene.yaml": "background bounds kind lights materials moves notices objects path textures triangles"
    " vertices",
    "walls.obj": "area background bounds kind lights materials notices objects path polygons"
    " texture_coordinates textures triangles vertices",
    "job.yaml": "eye_bounds frame_count frames job kind path path_length_m seconds sha256",
    "out/quilt/page_01.0001.exr": "kind parts path",
}


@pytest.mark.parametrize("name", KEYS)
def test_programs_find_the_same_keys_for_ever(name: str, tiny: Path) -> None:
    assert CliRunner().invoke(main, ["render", "job.yaml", "-f", "1"]).exit_code == 0
    found: dict[str, Any] = json.loads(out(name, "--json"))
    assert sorted(found) == KEYS[name].split()
    assert found["path"] == name


def test_json_has_no_numbers_that_are_none() -> None:
    assert finite({"a": [1.0, float("inf"), {"b": float("nan")}], "c": True}) == {
        "a": [1.0, None, {"b": None}],
        "c": True,
    }


def test_the_table_is_cut_unless_all_is_asked_for() -> None:
    path = str(MODELS / "dodecahedron.yaml")
    sphere = str(MODELS / "sphere840.yaml")
    assert "more (--all shows them)" not in out(path)
    short = out(sphere).splitlines()
    assert short[-1] == "and 820 more (--all shows them)"
    assert short[-2].startswith("20 ")
    assert out(sphere, "--all").splitlines()[-1].startswith("840 ")


def test_columns_are_aligned_without_a_terminal(tiny: Path) -> None:
    text = out("display.yaml").splitlines()
    assert text[0] == "display display.yaml"
    assert text[2] == "facets        2: 2 quadrilaterals"
    assert text[-3:] == [
        "facet  name   corners  pixels  area m²  pitch mm  normal",
        "1      back   4        64×64   4        31.25     [0, 0, 1]",
        "2      right  4        64×64   4        31.25     [-1, 0, 0]",
    ]


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_terminal_shows_a_table_and_leaves_brackets_alone(tiny: Path) -> None:
    replaced(tiny, "walls.obj", "g back", "g [red]")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "quiltcli", "info", "display.yaml"]
    environment = os.environ | {"COLUMNS": "100", "TERM": "xterm"}
    with subprocess.Popen(command, stdout=theirs, env=environment) as running:
        os.close(theirs)
        shown = b""
        while True:
            try:
                piece = os.read(ours, 65536)
            except OSError:
                break  # the other end is closed
            if not piece:
                break
            shown += piece
    os.close(ours)
    assert running.returncode == 0
    assert "────" in shown.decode()
    assert "[red]" in shown.decode()


def test_numbers_are_short() -> None:
    assert [number(v) for v in (1.0, -0.0, 0.1234567, 12)] == ["1", "0", "0.123457", "12"]
    assert spread(1.0, 1.0000001, "mm") == "1 mm"
    assert spread(1.0, 2.0, "mm") == "1 to 2 mm"


def test_projectors_say_where_they_stand_and_how_well_they_fit(tmp_path: Path) -> None:
    # A lens 3 m before the wall, of 120 pixels focal length, its axis through (30, 24).
    rows = [((x, y, 0), (30 + 40 * x, 24 - 40 * y)) for x in (-0.5, 0.5) for y in (-0.4, 0.4)]
    rows += [((x, y, 1), (30 + 60 * x, 24 - 60 * y)) for x, y in ((0.2, 0.1), (-0.3, 0.2), (0.1, -0.25))]
    points = "".join(f"  - {{world: {list(w)}, pixel: {list(p)}}}\n" for w, p in rows)
    facets = projected(tmp_path, WALL, f"- name: a\n  pixels: [60, 48]\n  points:\n{points}")
    assert facets.count == 1
    words = lines(describe(tmp_path / "display.yaml"))
    assert words["projectors"] == "1"
    assert words["facet 1"].startswith("projector at (0.000, 0.000, 3.000) m, 100.0 % of its pixels")
    assert "px rms" in words["facet 1"]
